"""The motion of a long row along a tube: an ordinary differential equation for its distances.

What particles do once they touch is assumed: they travel on at the distance of contact, held there by equal and
opposite forces on both, until these would have to pull. If these move all particles equally easily, the velocities are
the nearest ones at which no distance of contact shrinks: an isotonic regression of those without them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from pairsim.runtime.arrays import Array
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.rows.interaction import RowModel

RELATIVE, ABSOLUTE = 1e-6, 1e-8  # tolerances of the distances and positions; chosen
RELEASED = 1e-3  # part of the distance of contact by which particles that separate have left it; chosen


@dataclass(frozen=True)
class Contact:
    """The beginning or the end of a contact.

    Attributes:
        gap: Of which distance, counted from 0 upstream.
        t: When [D_c/U_av].
        z: Where along the tube the middle of the distance is then [D_c].
        begins: Whether it begins.
    """

    gap: int
    t: float
    z: float
    begins: bool


@dataclass
class RowMotion:
    """A row that moves along a tube.

    Attributes:
        model: Velocities of the row.
        contact: Distance at which particles touch [D_c].
        contacts: Beginnings and ends of contacts.
        t: Ends of the pieces of the solution, ascending [D_c/U_av].
    """

    model: RowModel
    contact: float
    contacts: list[Contact] = field(default_factory=list)
    t: list[float] = field(default_factory=list)
    _pieces: list[Any] = field(default_factory=list)

    def gaps(self, t: float) -> Array:
        """The distances at a time [D_c], shape (N-1,)."""
        return np.asarray(self._at(t)[1:])

    def positions(self, t: float) -> Array:
        """Where the particles are, from where the centre of the first one started [D_c], shape (N,)."""
        return self._positions(self._at(t))

    def times_after(self, length: float) -> Array:
        """When the middle of every distance has moved by a length of tube [D_c/U_av], shape (N-1,)."""
        start = self.positions(0.0)

        def beyond(t: float, gap: int) -> float:
            return float((self.positions(t) - start)[gap : gap + 2].mean()) - length * (1 - ABSOLUTE)

        gaps = range(len(start) - 1)
        return np.array([scipy.optimize.brentq(beyond, 0.0, self.t[-1], args=(gap,)) for gap in gaps])

    def _at(self, t: float) -> Array:
        return np.asarray(self._pieces[min(int(np.searchsorted(self.t, t)), len(self.t) - 1)](t))

    def _positions(self, state: Array) -> Array:
        gaps = state[1:]
        return state[0] + np.concatenate([[0.0], np.cumsum(gaps + self.model.lengths(gaps))])


def move(model: RowModel, gaps: Array, contact: float, length: float, monitor: Monitor) -> RowMotion:
    """Let a row move until each of its particles has moved by a length of tube.

    Args:
        model: Velocities of the row.
        gaps: First distances, all above `contact` [D_c], shape (N-1,).
        contact: Distance at which particles touch [D_c].
        length: The length [D_c].
        monitor: Ends the computation.
    """
    motion = RowMotion(model, contact)
    state, t = np.concatenate([[0.0], gaps]), 0.0
    touching = np.zeros(len(gaps), bool)
    start = motion._positions(state)
    most = 2 * length / model.U  # no particle is half as fast as a single one

    def rates(_: float, state: Array) -> Array:
        return _held(model.velocities(state[1:])[0], model.rates(state[1:]), touching)

    def through(_: float, state: Array) -> float:
        return float(np.min(motion._positions(state) - start)) - length

    def closing(_: float, state: Array) -> float:
        return float(np.min(state[1:][~touching], initial=np.inf)) - contact if not touching.all() else 1.0

    def leaving(_: float, state: Array) -> float:
        return float(np.max(state[1:][touching], initial=contact)) - contact * (1 + RELEASED)

    events: list[Any] = [through, closing, leaving]
    for event, direction in zip(events, (1, -1, 1), strict=True):
        event.terminal, event.direction = True, direction
    while True:
        monitor.check()
        found = scipy.integrate.solve_ivp(
            rates, (t, most), state, "RK45", events=events, dense_output=True, rtol=RELATIVE, atol=ABSOLUTE
        )
        t, state = float(found.t[-1]), found.y[:, -1]
        motion._pieces.append(found.sol)
        motion.t.append(t)
        if found.status != 1 or found.t_events[0].size:
            return motion
        begins = bool(found.t_events[1].size)
        distances = np.where(touching, np.inf, state[1:]) if begins else np.where(touching, -state[1:], np.inf)
        gap = int(np.argmin(distances))
        touching[gap] = begins
        if begins:
            state[1 + gap] = contact
        z = float(motion._positions(state)[gap : gap + 2].mean())
        motion.contacts.append(Contact(gap, t, z, begins))


def _held(first: float, rates: Array, touching: NDArray[np.bool_]) -> Array:
    """Velocity of the first particle and rates of the distances, with the forces between those that touch.

    Args:
        first: Velocity of the first particle without them [U_av].
        rates: Rates of the distances without them [U_av], shape (N-1,).
        touching: Which of them are at contact, shape (N-1,).
    """
    U = first + np.concatenate([[0.0], np.cumsum(rates)])
    if touching.any():
        ends = np.concatenate([[0], np.flatnonzero(~touching) + 1, [len(U)]])
        for begin, end in pairwise(ends):
            if end - begin > 1:
                U[begin:end] = scipy.optimize.isotonic_regression(U[begin:end]).x
    return np.concatenate([U[:1], np.diff(U)])


def random_gaps(count: int, mean: float, spread: float, seed: int, least: float) -> Array:
    """Distances at random: a gamma distribution beyond the least one, from even ones to those of particles anywhere.

    Args:
        count: How many.
        mean: Their mean [D_c].
        spread: Their standard deviation relative to the mean; 1 with `least` 0 is that of particles put anywhere.
        seed: Of the generator of random numbers.
        least: Least distance [D_c].
    """
    deviation, free = spread * mean, mean - least
    if deviation == 0:
        return np.full(count, mean)
    shape = (free / deviation) ** 2
    return np.asarray(least + np.random.default_rng(seed).gamma(shape, free / shape, count))
