"""Changes of the distances over the cycles of a flow that varies in time, and whether these have become periodic."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.time_error import LEAST
from pairsim.solvers.problems import Problem
from pairsim.solvers.stepping.step_size import reached

QUARTERS = 4  # parts of a cycle: a step ends at the end of each, and two cycles are compared part by part; chosen
# A soft pair forgets its shape as exp(-t/(6 Ca_e)) (beta .5, d .04), viscous ones more slowly; see `cases/run_case.py`.
MEMORY_PER_CAPILLARY = 6.0
MEMORY_PER_VISCOSITY = 0.45


@dataclass
class Cycles:
    """The drift of the distances from cycle to cycle. Lists and arrays are replaced, never changed in place.

    The half-width of a drift is that of dU integrated over the cycle. Where the error of dU is not estimated, it is
    that due to the time steps. In an oscillating flow errors have both signs and mostly cancel, which is not relied on.

    Attributes:
        cycle: Duration of a cycle [D_c/U_av].
        repeats: Whether the flow is periodic; a flow given by a table is a single cycle.
        held: Whether distances are held; the drift is then the integral of dU.
        memory: Time in which stresses and shapes forget their past [D_c/U_av].
        count: Number of whole cycles so far.
        drift: Change of the distances over the last whole cycle [D_c], shape (N-1,).
        error: Its half-width [D_c], shape (N-1,).
        change: Mean |dU| by which the last cycle differs from the one before it, over its quarters [U_av]; infinite
            before there are two.
        peak: Largest |dU| in the last whole cycle, at least `LEAST` [U_av].
        quarter: Number of whole quarters so far.
        d: Distances at the end of the last quarter [D_c], shape (N-1,).
        quarters: Change of the distances in the quarters of the present cycle so far [D_c], shape (N-1,) each.
        before: The same for the quarters of the last whole cycle.
        moved: Integral since the last quarter of the correction of dU, or of dU itself if distances are held [D_c],
            shape (N-1,).
        half_width: Integral of the half-width of dU in the present cycle [D_c], shape (N-1,).
        largest: Largest |dU| in the present cycle so far, without the estimate of its error [U_av].
        t: Time of the last step [D_c/U_av].
        times: Times of the last steps since a kink, newest first, at most two.
        values: The integrands of `moved` at these times [U_av], shape (N-1,) each.
    """

    cycle: float
    repeats: bool
    held: bool
    memory: float
    d: Array
    count: int = 0
    drift: Array | float = np.nan
    error: Array | float = np.nan
    change: float = np.inf
    peak: float = 0.0
    quarter: int = 0
    quarters: list[Array] = field(default_factory=list)
    before: list[Array] = field(default_factory=list)
    moved: Array | float = 0.0
    half_width: Array | float = 0.0
    largest: float = 0.0
    t: float = 0.0
    times: list[float] = field(default_factory=list)
    values: list[Array] = field(default_factory=list)

    @classmethod
    def of(cls, problem: Problem) -> Cycles | None:
        """The cycles of a run that has not begun; None without a flow that varies, or with fewer than two particles."""
        waveform = problem.drive.waveform
        if waveform is None or not problem.gaps:
            return None
        shapes = [
            MEMORY_PER_CAPILLARY * solid.Ca_e * (1 + MEMORY_PER_VISCOSITY * float(solid.viscosity or 0.0))
            for solid in problem.solids
            if solid is not None
        ]
        memory = problem.liquid.longest + max(shapes, default=0.0)
        return cls(waveform.cycle, waveform.period is not None, problem.held, memory, np.array(problem.gaps))

    def copy(self) -> Cycles:
        """A copy that later steps do not change."""
        return replace(self)

    def next_end(self) -> float:
        """The end of the present quarter [D_c/U_av]; infinite after the end of a table."""
        return math.inf if self.over else (self.quarter + 1) * self.cycle / QUARTERS

    @property
    def over(self) -> bool:
        """Whether no further cycle follows, as after the end of a table."""
        return not self.repeats and self.count > 0

    def begin_again(self) -> None:
        """Forget values before a kink of the flow, after which they change abruptly."""
        self.times, self.values = [], []

    def add(self, t: float, d: Array, dU: Array, correction: Array | float, half_width: Array | float) -> None:
        """Add an accepted step.

        Args:
            t: Time [D_c/U_av].
            d: Distances [D_c], shape (N-1,).
            dU: Relative velocities with the estimate of their error, where there is one [U_av], shape (N-1,).
            correction: This estimate [U_av], shape (N-1,), or 0.
            half_width: Half-width of dU [U_av], shape (N-1,), or one for all.
        """
        if self.over:
            return
        dt, self.t = t - self.t, t
        value = np.asarray(dU if self.held else correction + np.zeros(dU.size))
        self.moved = self.moved + dt * self._mean(t, dt, value)
        self.times, self.values = [t, *self.times[:1]], [value, *self.values[:1]]
        self.half_width = self.half_width + dt * np.asarray(half_width)
        # Estimates set in anew after a kink, and are far off for a moment.
        self.largest = max(self.largest, float(np.abs(dU - correction).max()))
        if reached(t, self.next_end()):
            self._end_quarter(d)

    def _mean(self, t: float, dt: float, value: Array) -> Array:
        """Mean over the last step of the parabola through the last three values, or of the polynomial through fewer."""
        if not self.times:
            return value
        linear = (value + self.values[0]) / 2
        if len(self.times) < 2:
            return np.asarray(linear)
        before = self.times[0] - self.times[1]
        slopes = (value - self.values[0]) / dt, (self.values[0] - self.values[1]) / before
        return np.asarray(linear - dt**2 / 6 * (slopes[0] - slopes[1]) / (dt + before))

    def _end_quarter(self, d: Array) -> None:
        change = self.moved if self.held else d - self.d + self.moved
        self.quarters, self.d, self.moved = [*self.quarters, np.asarray(change)], d, 0.0
        self.quarter += 1
        if self.quarter % QUARTERS:
            return
        if self.before:
            pairs = zip(self.quarters, self.before, strict=True)
            self.change = float(np.max(sum(np.abs(a - b) for a, b in pairs))) / self.cycle
        self.drift, self.error = np.sum(self.quarters, axis=0), self.half_width + np.zeros(d.size)
        self.count, self.peak = self.count + 1, max(self.largest, LEAST)
        self.before, self.quarters, self.half_width, self.largest = self.quarters, [], 0.0, 0.0

    @property
    def remaining(self) -> float:
        """Mean |dU| by which later cycles may still differ from the last one [U_av].

        Differences are taken to decay as exp(-t/memory), and are summed over all later cycles.
        """
        if not self.memory:
            return self.change
        faded = math.expm1(min(self.cycle / self.memory, 1.0))
        return self.change / min(faded, 1.0)

    def are_periodic(self, part: float) -> bool:
        """Whether cycles have become periodic, to a fraction `part` of the largest |dU|."""
        return self.count > 1 and self.remaining <= part * self.peak

    def are_known(self, part: float) -> bool:
        """Whether, in addition, the drift is known to this fraction of the largest |dU| times the cycle's duration."""
        return self.are_periodic(part) and bool(np.max(self.error) <= part * self.peak * self.cycle)
