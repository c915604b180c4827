"""The motion of a long row along a tube: ordinary differential equations for its distances.

Particles that come closer are slowed down by films of liquid where they are closer to each other than those in any row
that was solved (`pairsim.solvers.rows.films`). Particles that touch travel together as long as they push each other
(`pairsim.solvers.rows.contact`).
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

type Places = Callable[[Array | float], Array]
"""Places of the particles [D_c] as a function of time: shape (N,) for one time, (N, m) for m times."""

TOLERANCE = 1e-8  # allowed error of a distance in a time step [D_c]; chosen
# Step of the distances in differences of their rates [D_c]. The rates are sums of exponentials of the distances, with
# decay rates of up to 48/D_c.
STEP = 1e-5
PIECES = 100  # number of time intervals in each of which the derivatives of the rates are taken as constant; chosen


def move(model: RowModel, gaps: Array, contact: float, length: float, monitor: Monitor) -> tuple[Array, Places]:
    """Let a row move until each of its particles has moved by a length of tube.

    Args:
        model: The model of the velocities.
        gaps: Initial distances, all above `contact` [D_c], shape (N-1,).
        contact: Distance at which particles touch [D_c].
        length: The length [D_c].
        monitor: Ends the computation.

    Returns:
        Times of the steps [D_c/U_av], shape (m,), and the places of the particles as a function of time. Places are
        those of particles without length: neighbours are as far apart as their surfaces are.
    """
    start = np.cumsum([0.0, *gaps])

    def velocities(_: float, places: Array) -> Array:
        monitor.check()
        return _velocities(model, np.diff(places), contact)

    def through(_: float, places: Array) -> float:
        return float(np.min(places - start)) - length

    through.terminal = True  # type: ignore[attr-defined]
    end = 2 * length / model.alone[0]  # no particle is slower than half the velocity of a single one
    tolerances = {"rtol": 1e-12, "atol": TOLERANCE}
    found = scipy.integrate.solve_ivp(velocities, (0.0, end), start, events=through, dense_output=True, **tolerances)
    return found.t, found.sol


def propagator(model: RowModel, places: Places, end: float) -> Array:
    """Derivatives of the distances at the end (rows) with respect to those at the start (columns), shape (N-1, N-1).

    Args:
        model: The model of the velocities.
        places: The motion of the row, in which no particles touch.
        end: Time at the end [D_c/U_av].
    """
    found = np.eye(len(places(0.0)) - 1)
    for begin, stop in pairwise(np.linspace(0.0, end, PIECES + 1)):
        middle = np.diff(places((begin + stop) / 2))
        slopes = scipy.optimize.approx_fprime(middle, lambda d: np.diff(_velocities(model, d, 0.0)), STEP)
        found = scipy.linalg.expm((stop - begin) * np.atleast_2d(slopes)) @ found
    return found


def _velocities(model: RowModel, gaps: Array, contact: float) -> Array:
    """Rates of the places of `move`, with films and the forces between touching particles [U_av], shape (N,)."""
    row = model.row(gaps)
    free = np.cumsum([row.U[0], *row.rates])
    return without_overlap(free + changed_by_films(model, gaps, row.rates, contact), gaps, contact)
