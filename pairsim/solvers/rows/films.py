"""Films of liquid between particles that are nearer than any rows that were solved.

Where particles may differ films are known of a pair that was solved (`pairsim.solvers.rows.closing`). Elsewhere one is
assumed to slow particles that come closer as d/(d + c): its resistance grows as 1/d beside that of the tube, which it
equals at c. It acts on both of its neighbours by equal and opposite forces. If these move all particles equally easily,
and two particles alone come closer 1/(1 + q) as fast with a film, the rates r' of the distances follow from those r
without films by

    (1 + q_i) r'_i - (q_(i-1) r'_(i-1) + q_(i+1) r'_(i+1))/2 = r_i.
"""

from __future__ import annotations

import numpy as np
import scipy

from pairsim.runtime.arrays import Array
from pairsim.solvers.rows.model import RowModel


def changed_by_films(model: RowModel, gaps: Array, rates: Array, contact: float) -> Array:
    """What films change of the velocities of the particles of a row or stream [U_av], shape (N,).

    Args:
        model: Velocities without films.
        gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).
        rates: Their rates without films [U_av], shape (N-1,).
        contact: Distance at which particles touch [D_c]; nearer ones have the film there.
    """
    q = np.where(rates < 0, _slowing(model, gaps, contact), 0.0)
    if not q.any():
        return np.zeros(len(gaps) + 1)
    matrix = np.array([np.append(0.0, -q[1:] / 2), 1 + q, np.append(-q[:-1] / 2, 0.0)])
    forces = -q * scipy.linalg.solve_banded((1, 1), matrix, rates) / 2
    return np.append(0.0, forces) - np.append(forces, 0.0)


def _slowing(model: RowModel, gaps: Array, contact: float) -> Array:
    """The q of films, 0 where rows were solved, shape (N-1,)."""
    film, near = model.film * model.alone[1], np.minimum(np.maximum(gaps, contact) / model.least, 1.0)
    return (near * model.least + film) / (near * (model.least + film)) - 1
