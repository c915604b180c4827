"""The motion of a long row along a tube: an ordinary differential equation for its distances.

Nearer than any rows that were solved, films of liquid slow particles that come closer (`pairsim.solvers.rows.films`).
Particles that touch travel on together until they would have to pull at each other (`pairsim.solvers.rows.contact`).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import scipy

from pairsim.runtime.arrays import Array
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.rows.contact import without_overlap
from pairsim.solvers.rows.films import changed_by_films
from pairsim.solvers.rows.model import RowModel

type Places = Callable[[Array | float], Array]  # of one time (N,), of m times (N, m)

TOLERANCE = 1e-8  # of the distances [D_c]; chosen
STEP = 1e-5  # of differences of rates by distances [D_c]; they are exponentials of rates up to 48
PIECES = 100  # of the way, in each of which the linearised rates are constant; chosen


def move(model: RowModel, gaps: Array, contact: float, length: float, monitor: Monitor) -> tuple[Array, Places]:
    """Let a row move until each of its particles has moved by a length of tube.

    Args:
        model: Velocities of the row.
        gaps: First distances, all above `contact` [D_c], shape (N-1,).
        contact: Distance at which particles touch [D_c].
        length: The length [D_c].
        monitor: Ends the computation.

    Returns:
        Times of the steps [D_c/U_av], shape (m,), and the places of the particles, without their lengths, at times.
    """
    start = np.cumsum([0.0, *gaps])

    def velocities(_: float, places: Array) -> Array:
        monitor.check()
        return _velocities(model, np.diff(places), contact)

    def through(_: float, places: Array) -> float:
        return float(np.min(places - start)) - length

    through.terminal = True  # type: ignore[attr-defined]
    end = 2 * length / model.alone[0]  # no particle is half as fast as a single one
    tolerances = {"rtol": 1e-12, "atol": TOLERANCE}
    found = scipy.integrate.solve_ivp(velocities, (0.0, end), start, events=through, dense_output=True, **tolerances)
    return found.t, found.sol


def propagator(model: RowModel, places: Places, end: float) -> Array:
    """Derivatives of the distances at the end (rows) by those at the start, shape (N-1, N-1).

    Args:
        model: Velocities of the row.
        places: Its motion, without contact.
        end: Time at the end [D_c/U_av].
    """
    found = np.eye(len(places(0.0)) - 1)
    for begin, stop in pairwise(np.linspace(0.0, end, PIECES + 1)):
        middle = np.diff(places((begin + stop) / 2))
        slopes = scipy.optimize.approx_fprime(middle, lambda d: np.diff(_velocities(model, d, 0.0)), STEP)
        found = scipy.linalg.expm((stop - begin) * np.atleast_2d(slopes)) @ found
    return found


def _velocities(model: RowModel, gaps: Array, contact: float) -> Array:
    """Velocities of the particles, as far as these change the distances, with the forces between those that touch."""
    row = model.row(gaps)
    free = np.cumsum([row.U[0], *row.rates])
    return without_overlap(free + changed_by_films(model, gaps, row.rates, contact), gaps, contact)
