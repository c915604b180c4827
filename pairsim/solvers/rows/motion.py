"""The motion of a long row along a tube: an ordinary differential equation for its distances.

What particles do once they touch is assumed: they travel on at the distance of contact, held there by equal and
opposite forces on both, until these would have to pull. If these move all particles equally easily, the velocities are
the nearest ones at which no distance of contact shrinks: an isotonic regression of those without them.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from pairsim.runtime.arrays import Array
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.rows.model import RowModel

RELATIVE, ABSOLUTE = 1e-6, 1e-8  # tolerances of the distances and positions; chosen
STEP = 1e-5  # of differences of rates by distances [D_c]; they are exponentials of rates up to 48
PIECES = 100  # of the way, in each of which the linearised rates are constant; chosen


@dataclass(frozen=True)
class RowMotion:
    """A row that has moved along a tube.

    Attributes:
        model: Velocities of the row.
        contact: Distance at which particles touch [D_c].
        t: Times of the steps [D_c/U_av], shape (m,).
        touching: Which distances are at contact at each of them, shape (N-1, m).
    """

    model: RowModel
    contact: float
    t: Array
    touching: NDArray[np.bool_]
    _solution: Any

    def gaps(self, t: float) -> Array:
        """The distances at a time [D_c], shape (N-1,)."""
        return np.asarray(self._solution(t)[1:])

    def way(self, t: float) -> Array:
        """How far the particles have moved along the tube [D_c], shape (N,)."""
        start, now = (_positions(self.model, self._solution(each)) for each in (0.0, t))
        return np.asarray(now - start)

    def propagator(self) -> Array:
        """Derivatives of the distances at the end (rows) by those at the start, shape (N-1, N-1)."""
        found = np.eye(len(self.touching))
        for begin, end in pairwise(np.linspace(0.0, self.t[-1], PIECES + 1)):
            slopes = scipy.optimize.approx_fprime(
                self.gaps((begin + end) / 2), lambda gaps: _motion(self.model, gaps, self.contact)[1], STEP
            )
            found = scipy.linalg.expm((end - begin) * np.atleast_2d(slopes)) @ found
        return found


def move(model: RowModel, gaps: Array, contact: float, length: float, monitor: Monitor) -> RowMotion:
    """Let a row move until each of its particles has moved by a length of tube.

    Args:
        model: Velocities of the row.
        gaps: First distances, all above `contact` [D_c], shape (N-1,).
        contact: Distance at which particles touch [D_c].
        length: The length [D_c].
        monitor: Ends the computation.
    """
    state = np.concatenate([[0.0], gaps])
    start = _positions(model, state)

    def rates(_: float, state: Array) -> Array:
        monitor.check()
        first, changes = _motion(model, state[1:], contact)
        return np.array([first, *changes])

    def through(_: float, state: Array) -> float:
        return float(np.min(_positions(model, state) - start)) - length

    through.terminal = True  # type: ignore[attr-defined]
    end = 2 * length / model.alone[0]  # no particle is half as fast as a single one
    found = scipy.integrate.solve_ivp(
        rates, (0.0, end), state, events=through, dense_output=True, rtol=RELATIVE, atol=ABSOLUTE
    )
    return RowMotion(model, contact, found.t, found.y[1:] <= contact + ABSOLUTE, found.sol)


def _positions(model: RowModel, state: Array) -> Array:
    gaps = state[1:]
    return np.asarray(state[0] + np.concatenate([[0.0], np.cumsum(gaps + model.row(gaps).values[:-1, 1])]))


def _motion(model: RowModel, gaps: Array, contact: float) -> tuple[float, Array]:
    """Velocity of the first particle and rates of the distances, with the forces between particles that touch."""
    row = model.row(np.maximum(gaps, contact))
    U = row.values[0, 0] + np.concatenate([[0.0], np.cumsum(row.rates)])
    for begin, end in pairwise([0, *(np.flatnonzero(gaps > contact) + 1), len(U)]):
        if end - begin > 1:
            U[begin:end] = scipy.optimize.isotonic_regression(U[begin:end]).x
    return float(U[0]), np.diff(U)
