"""The errors of goals to quote in a run, from its accepted steps: of dU, velocities, shapes and the pressure drop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from pairsim.physics.liquids import Liquid
from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.time_error import LEAST, SET_IN, TimeError
from pairsim.solvers.goals import IN_TIME, Goal, dU
from pairsim.solvers.stepping.step_size import extrapolation_weights

# Widening of intervals, read off 73 quasi-steady solutions and six runs: before it was there, errors were up to 1.4 and
# 1.9 half-widths, outside the intervals; with it all are inside, and so are those of two further runs, which were not
# used.
RESOLVED = 1.1  # largest change of log c within a cell up to which half-widths are large enough without it
# Power of that change over RESOLVED with which half-widths of quasi-steady solutions grow above it. With the power 1
# one of twelve points was off by 1.51 half-widths, at a change of 2.4, and one of thirteen later ones by 1.04.
OF_POINTS = 2
OF_RUNS = 3  # the power for runs, whose estimate has no scatter
KNOWN = 3  # accepted values from which a goal is extrapolated over a remeshing
# Power of the distances with which errors of quasi-steady dU grow on given cells as particles come closer; measured.
NARROWING = 2


def widening(s_jump: float, power: int) -> float:
    """Factor of the cells' part of an interval where cells do not resolve the stress of a polymer.

    Estimates see only a part of what this does.

    Args:
        s_jump: Largest change of log c within a cell; 0 in a Newtonian liquid.
        power: OF_POINTS or OF_RUNS.
    """
    return max(1.0, s_jump / RESOLVED) ** power


@dataclass
class Interval:
    """Half-width of the interval around the values of a goal that is meant to contain the exact ones.

    With the symbols of "Runs" in docs/explanation/error-estimate.md it is

        omega |delta| + max(omega delta_max + f sigma_s, (d_0/d_min)^2 epsilon_0) + epsilon_t + epsilon_r,

    and |delta| more where the estimate delta is not added to the values.

    - |delta| is at least the part `of_others` of its largest value; delta_max, the largest |delta| so far (`largest`),
      counts too, as the estimate has an error of its own, which does not vanish where the estimate changes its sign.
      Estimates before SET_IN, in which soft shapes take up the stress that is missing, do not count in delta_max where
      there is an epsilon_0.
    - f sigma_s (`irregular`) is what errors do to the viscosity of a liquid without modes beyond the first order.
    - epsilon_0 (`start`) is the error of the quasi-steady state of the first distances, where that is larger: estimates
      are carried forward from zero at t = 0, and do not see the scatter of the cells. It does not decay, as the same
      cells leave the same error in the states nearby that the run passes, where the estimates may be too small, and a
      larger one as a gap narrows. From rest it sets in with the stress. It contains f sigma_s of the start.
    - epsilon_t is the indicator of the error by the time steps.
    - epsilon_r (`jumps`) is what remeshings have left, which no residual sees, as the stress is interpolated to another
      mesh. The exact value is continuous in time, and so is the corrected one but for errors, since it depends little
      on the mesh: its jump, against a parabola through its last values, counts as an error.

    Attributes:
        memory: Time in which the largest estimate and the jumps are forgotten [D_c/U_av].
        added: Whether the estimate is added to the values.
        of_others: Least part of what counts in one value of what counts in another one.
        start: Error of the discrete values in the quasi-steady state of the first distances, shape (k,); 0 where it is
            not wanted.
        setting_in: Time in which that state is reached [D_c/U_av]; 0 for a run that starts from it.
        mesh: Number of remeshings before the last step.
        times: Times of the last steps, newest first, at most KNOWN.
        values: Their corrected values, shape (k,) each.
        largest: Largest |correction|, as far as it is remembered, shape (k,).
        jumps: Sum of the jumps at remeshings, as far as they are remembered, shape (k,).
        begun: Time of the last kink or jump of the flow [D_c/U_av], after which estimates set in again.
    """

    memory: float
    added: bool = True
    of_others: float = 0.0
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
        discrete: Array,
        correction: Array,
        steps: float,
        s_jump: float = 0.0,
        closer: float = 1.0,
        irregular: Array | float = 0.0,
    ) -> Array:
        """The half-width after an accepted step, shape (k,).

        Args:
            t: Time [D_c/U_av].
            mesh: Number of remeshings before the step.
            discrete: Values of the discrete solution, shape (k,).
            correction: Estimates of exact minus discrete values, shape (k,).
            steps: epsilon_t, the largest indicator of the error by the time steps so far.
            s_jump: Largest change of log c within a cell; 0 in a Newtonian liquid.
            closer: d_0/d_min, the largest factor by which a gap is narrower than at the start, at least 1.
            irregular: f sigma_s, shape (k,).
        """
        corrected, own = discrete + correction, np.abs(correction)
        size = np.maximum(own, self.of_others * own.max(initial=0.0))
        if self.times:
            left = np.exp(-(t - self.times[0]) / self.memory)
            self.largest, self.jumps = self.largest * left, self.jumps * left
            if mesh != self.mesh and self.values:
                weights = extrapolation_weights(self.times, t)
                expected = sum(w * value for w, value in zip(weights, self.values, strict=True))
                self.jumps = self.jumps + np.abs(corrected - expected)
        self.mesh = mesh
        if t - self.begun > SET_IN or not (self.begun or np.any(self.start)):
            self.largest = np.maximum(self.largest, size)
        self.times = [t, *self.times[: len(self.values)][: KNOWN - 1]]
        self.values = [corrected, *self.values[: KNOWN - 1]]
        wider = widening(s_jump, OF_RUNS)
        largest = wider * self.largest + irregular
        start = self.start * (-np.expm1(-t / self.setting_in) if self.setting_in else 1.0)
        cells = wider * size + np.maximum(largest, closer**NARROWING * start)
        half_width = np.asarray(cells + steps + self.jumps)
        return half_width if self.added else half_width + size

    def begin_again(self, t: float) -> None:
        """Forget the last values, from which none is extrapolated over a jump of the flow at a time [D_c/U_av]."""
        self.times, self.values, self.begun = self.times[:1], [], t


@dataclass
class GoalErrors:
    """The errors of one goal. Lists and arrays are replaced, never changed in place.

    Attributes:
        steps: Indicator of the error due to the time steps.
        interval: The interval to quote at each step, where the error of the cells is estimated.
        irregular: What errors do to a viscosity beyond the first order; of a goal that the run integrates the sum of
            what all steps have left of it, as far as it is remembered, shape (k,).
        largest: Largest half-width after stresses have set in.
    """

    steps: TimeError
    interval: Interval
    irregular: Array | float = 0.0
    largest: float = 0.0

    @property
    def part(self) -> float:
        """Largest half-width relative to the largest value; 0 where values are errors alone."""
        return self.largest / self.steps.peak if self.steps.peak > LEAST else 0.0


@dataclass
class RunErrors:
    """The errors of the goals of a run up to its last step.

    Attributes:
        goals: Those of each goal, by its name.
        lost: Time from which half-widths are unknown, since their estimates diverged; infinite if they did not.
    """

    goals: dict[str, GoalErrors]
    lost: float = np.inf

    @classmethod
    def of(cls, liquid: Liquid) -> RunErrors:
        """Errors of a run that has not begun; it forgets in a time of 1 + De (chosen), as liquid passes and relaxes."""
        order, memory = 2 if liquid.has_memory else 3, 1.0 + liquid.longest
        goals = {
            goal.name: GoalErrors(TimeError(order), Interval(memory, goal.added, goal.of_others)) for goal in IN_TIME
        }
        return cls(goals)

    def __getitem__(self, goal: Goal) -> GoalErrors:
        return self.goals[goal.name]

    def begin(self, start: Mapping[str, Array], setting_in: float = 0.0) -> None:
        """Take the errors in the quasi-steady state of the first distances.

        Args:
            start: Those of goals, by their names.
            setting_in: Time in which that state is reached [D_c/U_av].
        """
        for name, error in start.items():
            interval = self.goals[name].interval
            interval.start, interval.setting_in = error, setting_in

    def add(
        self,
        t: float,
        mesh: int,
        discrete: Mapping[Goal, Array],
        corrections: Mapping[Goal, Array] | None,
        s_jump: float,
        closer: float = 1.0,
        irregular: Mapping[Goal, Array] | None = None,
    ) -> dict[Goal, Array]:
        """The half-widths of goals after an accepted step, (k,) each; none where the errors are not estimated.

        Args:
            t: Time [D_c/U_av].
            mesh: Number of remeshings before the step.
            discrete: Values of goals of the discrete solution, (k,) each.
            corrections: Estimates of exact minus discrete values, (k,) each; NaN from where they diverge.
            s_jump: Largest change of log c within a cell; 0 in a Newtonian liquid.
            closer: Largest factor by which a gap is narrower than at the start, at least 1.
            irregular: What errors do to a viscosity beyond the first order in the step, (k,) each.
        """
        found = dict[Goal, Array]()
        for goal, values in discrete.items():
            own = self[goal]
            own.steps.add(t, mesh, values)
            if corrections is None:
                continue
            interval, new = own.interval, (irregular or {}).get(goal, 0.0)
            if goal.of_positions and interval.times:
                new = new + own.irregular * np.exp(-(t - interval.times[0]) / interval.memory)
            own.irregular, steps = new, own.steps.largest
            error = interval.add(t, mesh, values, corrections[goal], steps, s_jump, closer, own.irregular)
            found[goal] = error
            if not np.isnan(error).any() and t - own.steps.begun > SET_IN:
                own.largest = max(own.largest, float(error.max(initial=0.0)))
        if any(np.isnan(error).any() for error in found.values()):
            self.lost = min(self.lost, t)
        return found

    def begin_again(self, t: float) -> None:
        """Forget values up to a time [D_c/U_av] after which goals may change abruptly, as steps begin again."""
        for each in self.goals.values():
            each.steps.begin_again(t)
            each.interval.begin_again(t)

    def copy(self) -> RunErrors:
        """A copy that later steps do not change."""
        copies = {
            name: replace(each, steps=replace(each.steps), interval=replace(each.interval))
            for name, each in self.goals.items()
        }
        return replace(self, goals=copies)

    @property
    def part(self) -> float:
        """Largest half-width of dU over the largest |dU|; 0 where dU is error alone, as of equal rigid particles."""
        return self[dU].part
