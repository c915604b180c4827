"""Lubrication films between particles that are closer to each other than those in any row that was solved.

Where particles may differ, the effect of films is known from a pair that was solved (`pairsim.solvers.rows.closing`).
Elsewhere a film is assumed to multiply the rate at which two particles come closer by d/(d + c): its resistance grows
as 1/d, and at the distance c it is as large as that of the tube. A film exerts equal and opposite forces on its two
particles. Let all particles have the same mobility, and let 1/(1 + q) be the factor by which a film reduces the rate of
an isolated pair. Then the rates r' of the distances follow from the rates r without films by

    (1 + q_i) r'_i - (q_(i-1) r'_(i-1) + q_(i+1) r'_(i+1))/2 = r_i.
"""

from __future__ import annotations

import numpy as np
import scipy

from pairsim.runtime.arrays import Array
from pairsim.solvers.rows.model import RowModel


def changed_by_films(model: RowModel, gaps: Array, rates: Array, contact: float) -> Array:
    """Changes of the velocities of the particles of a row or stream by films [U_av], shape (N,).

    Args:
        model: The model of the velocities without films.
        gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).
        rates: Rates of the distances without films [U_av], shape (N-1,); there are no films where these are positive.
        contact: Distance at which particles touch [D_c]; at smaller ones the film is that at this distance.
    """
    q = np.where(rates < 0, _slowing(model, gaps, contact), 0.0)
    if not q.any():
        return np.zeros(len(gaps) + 1)
    matrix = np.array([np.append(0.0, -q[1:] / 2), 1 + q, np.append(-q[:-1] / 2, 0.0)])
    forces = -q * scipy.linalg.solve_banded((1, 1), matrix, rates) / 2
    return np.append(0.0, forces) - np.append(forces, 0.0)


def _slowing(model: RowModel, gaps: Array, contact: float) -> Array:
    """q of each film, relative to a film at the least distance that was solved; 0 at larger distances, shape (N-1,)."""
    film, near = model.film * model.alone[1], np.minimum(np.maximum(gaps, contact) / model.least, 1.0)
    return (near * model.least + film) / (near * (model.least + film)) - 1
