"""The motion of a stream of particles along a tube: a long row, whose particles may differ.

Velocities are those of the model of rows (`pairsim.solvers.rows.model`). Particles that come closer are slowed down by
films of liquid (`pairsim.solvers.rows.films`; where they may differ, `pairsim.solvers.rows.closing`), and particles
that touch push each other apart (`pairsim.solvers.rows.contact`). Where particles may differ, the shapes of soft ones
lag behind distances that change (`pairsim.solvers.rows.lag`). Work and memory are proportional to the number of
particles.

The time steps are those of the embedded Runge-Kutta method of Bogacki and Shampine (1989). Particles that overlap after
a step are moved back into contact. As velocities jump on contact, a method of higher order would not be more accurate.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from pairsim.runtime.arrays import Array, Flags
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.rows.contact import TOUCHING, without_overlap
from pairsim.solvers.rows.films import changed_by_films
from pairsim.solvers.rows.lag import Lag
from pairsim.solvers.rows.model import RowModel

# Error of a distance in a step, and overlap of particles that meet in a step, above which it is repeated [D_c]; chosen:
# contact is at 2e-3 by default.
TOLERANCE, OVERLAP = 1e-5, 5e-4
FIRST, SHORTEST = 0.1, 1e-4  # first and shortest time step [D_c/U_av]; the shortest one is not repeated
SOONEST = 0.3  # lower bound on the relaxation time of a lag [D_c/U_av]; chosen, as shorter ones would need short steps
SAFETY, MOST_GROWTH, LEAST_GROWTH = 0.85, 3.0, 0.2  # safety factor, and bounds on the ratio of successive steps; chosen


@dataclass(frozen=True)
class Stream:
    """A stream at one time.

    Attributes:
        time: Time [D_c/U_av].
        gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).
        way: Length of tube that each particle has covered [D_c], shape (N,).
        velocities: Velocities [U_av], shape (N,).
        contact: Distance at which particles touch [D_c].
    """

    time: float
    gaps: Array
    way: Array
    velocities: Array
    contact: float

    @property
    def touching(self) -> Flags:
        """Which neighbours touch; boolean, shape (N-1,)."""
        return np.asarray(self.gaps <= self.contact + TOUCHING)


def follow(
    model: RowModel, gaps: Array, parts: Array | None, contact: float, lengths: Sequence[float], monitor: Monitor
) -> Iterator[Stream]:
    """Let a stream move, and yield it when its particles have moved by given lengths of tube on average.

    Args:
        model: The model of the velocities.
        gaps: Initial distances, none below `contact` [D_c], shape (N-1,).
        parts: Deviations of the logarithms of diameter and Ca_e of each particle, shape (N, 2); None if all are equal.
        contact: Distance at which particles touch [D_c].
        lengths: The lengths, ascending; the first one may be 0 [D_c].
        monitor: Ends the computation.
    """
    count, start = len(gaps) + 1, np.cumsum(np.append(0.0, gaps))
    flow = _Velocities(model, parts, contact)
    state, time, step = flow.held(start), 0.0, FIRST
    slope = flow(state)
    for length in lengths:
        while (left := length - float(np.mean(state[:count] - start))) > TOLERANCE:
            monitor.check()
            last = left / float(slope[:count].mean())
            state, slope, taken, following = _step(flow, state, slope, min(step, last))
            step = max(step, following) if step > last else following
            time += taken
        places = state[:count]
        yield Stream(time, np.diff(places), places - start, slope[:count], contact)


def _step(flow: _Velocities, state: Array, slope: Array, step: float) -> tuple[Array, Array, float, float]:
    """One step from a state whose time derivatives are `slope`.

    Returns:
        State and time derivatives after the step, its size, and the size of the next one.
    """
    while True:
        second = flow(state + step / 2 * slope)
        third = flow(state + 3 / 4 * step * second)
        free = state + step * (2 * slope + 3 * second + 4 * third) / 9
        new = flow.apart(free)
        fourth = flow(new)
        error = flow.distances(step * (-5 * slope + 6 * second + 8 * third - 9 * fourth) / 72)
        overlap = float(np.abs(new - free).max(initial=0.0))
        # Where particles touch before or after the step, velocities jump, and the overlap is the measure of the error.
        before, after = flow.distances(state)[0], flow.distances(new)[0]
        open_ones = (before > flow.contact + TOUCHING) & (after > flow.contact + TOUCHING)
        beside = open_ones.copy()
        beside[1:] &= open_ones[:-1]
        beside[:-1] &= open_ones[1:]
        lags = error[1:]  # these change smoothly even where particles touch
        worst = max(float(np.abs(each).max(initial=0.0)) / TOLERANCE for each in (error[0, beside], lags))
        worst = max(worst, overlap / OVERLAP)
        growth = min(MOST_GROWTH, max(LEAST_GROWTH, SAFETY * max(worst, 1e-9) ** (-1 / 3)))
        if worst <= 1 or step <= SHORTEST:
            return new, fourth, step, max(step * growth, SHORTEST)
        step = max(step * growth, SHORTEST)


@dataclass(frozen=True)
class _Velocities:
    """Time derivatives of a stream, with the forces between touching particles.

    A state contains the places of all particles, which are those of particles without length: neighbours are as far
    apart as their surfaces are. Where the shapes of soft particles lag behind, it also contains the lag l of each
    distance, by which the distance between two centres is longer than for held particles. Let g be the rates of the
    distances if shapes did not lag behind, C' the derivative of the distance between two centres with respect to that
    between their surfaces, and lambda the lag that l approaches with the relaxation time tau
    (`pairsim.solvers.rows.lag`). Then

        d_t = g + (l - lambda)/tau,    l_t = -C' (l - lambda)/tau,

    so that C' d_t + l_t = dU. The effect of other distances on that between two centres is neglected here, and tau/C'
    is taken to be at least `SOONEST`.
    """

    model: RowModel
    parts: Array | None
    contact: float

    @property
    def lag(self) -> Lag | None:
        """The lag of shapes; None if it is not known, or if all particles are equal."""
        return None if self.parts is None else self.model.lag

    def held(self, places: Array) -> Array:
        """The state of particles that have been held at places, (N,), so that there are no lags."""
        return places if self.lag is None else np.append(places, np.zeros(len(places) - 1))

    def distances(self, state: Array) -> Array:
        """Distances between surfaces and, where shapes lag behind, the lags, shape (1 or 2, N-1)."""
        if self.lag is None:
            return np.diff(state)[None]
        count = (len(state) + 1) // 2
        return np.array([np.diff(state[:count]), state[count:]])

    def __call__(self, state: Array) -> Array:
        gaps, *lags = self.distances(state)
        U, stretch = self.model.along(gaps) if self.parts is None else self._of_unequal(gaps, self.parts)
        dU, closing, at = np.diff(U), self.model.closing, np.maximum(gaps, self.contact)
        rates = _rates(dU, stretch)
        if closing is None:
            free = np.cumsum(np.append(U[0], rates)) + changed_by_films(self.model, gaps, rates, self.contact)
        else:
            slowed = U + closing.changed(U, at)
            with_films = closing.rates(np.diff(slowed), _rates(np.diff(slowed), stretch), at)
            free = np.cumsum(np.append(slowed[0], with_films))
        if self.lag is None:
            return without_overlap(free, gaps, self.contact)
        solved = np.maximum(gaps, self.model.least)
        own = stretch[len(stretch) // 2]
        left = (self.lag.at(solved, dU, rates) - lags[0]) / np.maximum(self.lag.time(solved, dU) / own, SOONEST)
        moved = -left / own
        if closing is not None:
            moved *= np.where(rates + moved < 0, closing.factor(at)[:, 0], 1.0)
        free += np.cumsum(np.append(0.0, moved))
        return np.append(without_overlap(free, gaps, self.contact), left)

    def _of_unequal(self, gaps: Array, parts: Array) -> tuple[Array, Array]:
        """As `RowModel.along`, with deviations `parts`; below the least distance that was solved, as at that one."""
        differ = self.model.deviations
        assert differ is not None, "the model knows what particles change that differ"
        solved = np.maximum(gaps, self.model.least)
        U, stretch = self.model.along(solved)
        changes = differ.velocities(solved, parts)
        if differ.stretch is not None:
            stretch = differ.stretch.changed(stretch, solved, parts[:, 0], np.diff(changes))
        return U + changes, stretch

    def apart(self, state: Array) -> Array:
        """The nearest state in which no particles overlap."""
        gaps, *lags = self.distances(state)
        if (gaps >= self.contact).all():
            return state
        places = state[: len(gaps) + 1]
        touching = self.contact * np.arange(len(places))
        apart = np.asarray(scipy.optimize.isotonic_regression(places - touching).x + touching)
        return np.concatenate([apart, *lags])


def _rates(dU: Array, stretch: Array) -> Array:
    """Rates of the distances [U_av], (N-1,), at relative velocities dU; `stretch` is a result of `RowModel.along`."""
    width = len(stretch) // 2
    return np.asarray(scipy.linalg.solve_banded((width, width), stretch, dU))
