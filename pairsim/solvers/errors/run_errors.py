"""The errors of dU to quote in a run, from its accepted steps."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from pairsim.physics.liquids import Liquid
from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.time_error import LEAST, SET_IN, TimeError
from pairsim.solvers.stepping.step_size import extrapolation_weights

# Read off 73 quasi-steady solutions and six runs (scripts/error_bars), in which errors were up to 1.4 and 1.9 times the
# interval; two further runs, which were not used, all hold.
RESOLVED = 1.1  # largest change of log c within a cell up to which intervals hold
# Power of it by which intervals of quasi-steady solutions widen above. With the first power one of twelve points
# (scripts/error_bars --random) was off by 1.51 of its half-widths, at 2.4, and one of thirteen later ones by 1.04.
OF_POINTS = 2
OF_RUNS = 3  # the same of runs, whose estimate has no scatter
KNOWN = 3  # accepted values from which dU is extrapolated over a remeshing
# Power of the distances with which errors of quasi-steady dU grow on given cells as particles come closer; measured.
NARROWING = 2


def widening(s_jump: float, power: int) -> float:
    """Factor of the cells' part of an interval where cells do not resolve the stress of a polymer.

    Estimates see this only in part.

    Args:
        s_jump: Largest change of log c within a cell; 0 in a Newtonian liquid.
        power: OF_POINTS or OF_RUNS.
    """
    return max(1.0, s_jump / RESOLVED) ** power


@dataclass
class Interval:
    """Half-width of the interval around dU that should hold the exact one, with five terms.

    1. |dU_correction| plus the largest one so far: the estimate has an error of its own, which does not vanish where
       the estimate changes its sign. Both count more where cells do not resolve the stress.
    2. The error by the time steps.
    3. What remeshings have left, which no residual sees, as the stress is interpolated to another mesh. The exact dU is
       continuous in time, and so is dU + dU_correction but for errors, since it depends little on the mesh: what this
       sum jumps by, against a parabola through its last values, counts as an error.

    4. The error of the quasi-steady state of the first distances, where that is more than the largest estimate:
       estimates are carried forward from zero at t = 0, and do not see the scatter of the cells. It does not fade, as
       the same cells leave the same error in the states nearby that the run passes, where the estimates may be too
       small, and a larger one as a gap narrows. From rest it sets in with the stress. Estimates before SET_IN, in which
       soft shapes take up the stress that is missing, do not count as the largest one.
    5. In a liquid without modes what errors do to its viscosity beyond the first order, of which the error at the start
       has its part.

    Attributes:
        memory: Time in which the largest estimate and the jumps are forgotten [D_c/U_av].
        start: Error of the discrete dU in the quasi-steady state of the first distances [U_av], shape (N-1,); 0 where
            it is not wanted.
        setting_in: Time in which that state is reached [D_c/U_av]; 0 for a run that starts from it.
        mesh: Number of remeshings before the last step.
        times: Times of the last steps, newest first, at most KNOWN.
        values: Their corrected dU, shape (N-1,) each.
        largest: Largest |dU_correction|, as far as it is remembered, shape (N-1,).
        jumps: Sum of the jumps at remeshings, as far as they are remembered, shape (N-1,).
        begun: Time of the last kink or jump of the flow [D_c/U_av], after which estimates set in again.
    """

    memory: float
    start: Array | float = 0.0
    setting_in: float = 0.0
    mesh: int = 0
    times: list[float] = field(default_factory=list)
    values: list[Array] = field(default_factory=list)
    largest: Array | float = 0.0
    jumps: Array | float = 0.0
    begun: float = 0.0

    def add(
        self,
        t: float,
        mesh: int,
        dU: Array,
        correction: Array,
        steps: float,
        s_jump: float = 0.0,
        closer: float = 1.0,
        irregular: Array | float = 0.0,
    ) -> Array:
        """The half-width after an accepted step [U_av], shape (N-1,).

        Args:
            t: Time [D_c/U_av].
            mesh: Number of remeshings before the step.
            dU: Relative velocities of the discrete solution [U_av], shape (N-1,).
            correction: Estimates of exact minus discrete dU [U_av], shape (N-1,).
            steps: Error of dU by the time steps so far [U_av].
            s_jump: Largest change of log c within a cell; 0 in a Newtonian liquid.
            closer: Largest factor by which a gap is narrower than at the start, at least 1.
            irregular: The fifth term [U_av], shape (N-1,).
        """
        corrected = dU + correction
        if self.times:
            left = np.exp(-(t - self.times[0]) / self.memory)
            self.largest, self.jumps = self.largest * left, self.jumps * left
            if mesh != self.mesh and self.values:
                weights = extrapolation_weights(self.times, t)
                expected = sum(w * value for w, value in zip(weights, self.values, strict=True))
                self.jumps = self.jumps + np.abs(corrected - expected)
        self.mesh = mesh
        if t - self.begun > SET_IN or not (self.begun or np.any(self.start)):
            self.largest = np.maximum(self.largest, np.abs(correction))
        self.times = [t, *self.times[: len(self.values)][: KNOWN - 1]]
        self.values = [corrected, *self.values[: KNOWN - 1]]
        wider = widening(s_jump, OF_RUNS)
        largest = wider * self.largest + irregular
        start = self.start * (-np.expm1(-t / self.setting_in) if self.setting_in else 1.0)
        cells = wider * np.abs(correction) + np.maximum(largest, closer**NARROWING * start)
        return np.asarray(cells + steps + self.jumps)

    def begin_again(self, t: float) -> None:
        """Forget the last values, from which dU is not extrapolated over a jump of the flow at a time [D_c/U_av]."""
        self.times, self.values, self.begun = self.times[:1], [], t


@dataclass
class RunErrors:
    """The errors of dU in a run up to its last step. Lists and arrays are replaced, never changed in place.

    Attributes:
        steps: Estimate of the error due to the time steps.
        interval: The interval to quote at each step, where the error of the cells is estimated.
        largest: Largest half-width after stresses have set in [U_av].
        lost: Time from which the half-width is unknown, since its estimate diverged; infinite if it did not.
    """

    steps: TimeError
    interval: Interval
    largest: float = 0.0
    lost: float = np.inf

    @classmethod
    def of(cls, liquid: Liquid) -> RunErrors:
        """Those of a run that has not begun; it forgets in a time of 1 + De (chosen), as liquid passes and relaxes."""
        return cls(TimeError(order=2 if liquid.has_memory else 3), Interval(memory=1.0 + liquid.longest))

    def add(
        self,
        t: float,
        mesh: int,
        dU: Array,
        correction: Array | None,
        s_jump: float,
        closer: float = 1.0,
        irregular: Array | float = 0.0,
    ) -> Array | None:
        """The half-width after an accepted step [U_av], shape (N-1,); None where the error is not estimated.

        Args:
            t: Time [D_c/U_av].
            mesh: Number of remeshings before the step.
            dU: Relative velocities of the discrete solution [U_av], shape (N-1,).
            correction: Estimates of exact minus discrete dU [U_av], shape (N-1,); NaN from where they diverge.
            s_jump: Largest change of log c within a cell; 0 in a Newtonian liquid.
            closer: Largest factor by which a gap is narrower than at the start, at least 1.
            irregular: Half-width by what errors do to a viscosity beyond the first order [U_av], shape (N-1,).
        """
        self.steps.add(t, mesh, dU)
        if correction is None:
            return None
        error = self.interval.add(t, mesh, dU, correction, self.steps.largest, s_jump, closer, irregular)
        if np.isnan(error).any():
            self.lost = min(self.lost, t)
        elif t - self.steps.begun > SET_IN:
            self.largest = max(self.largest, float(error.max(initial=0.0)))
        return error

    def begin_again(self, t: float) -> None:
        """Forget values up to a time [D_c/U_av] after which dU may change abruptly, as steps begin again."""
        self.steps.begin_again(t)
        self.interval.begin_again(t)

    def copy(self) -> RunErrors:
        """A copy that later steps do not change."""
        return replace(self, steps=replace(self.steps), interval=replace(self.interval))

    @property
    def part(self) -> float:
        """Largest half-width relative to the largest |dU|; 0 where dU is error alone, as of equal rigid particles."""
        return self.largest / self.steps.peak if self.steps.peak > LEAST else 0.0
