"""Half-widths of goals in a run, from its accepted steps: of dU, velocities, shapes and the pressure drop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from pairsim.physics.liquids import Liquid
from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.time_error import LEAST, SET_IN, TimeError
from pairsim.solvers.goals import IN_TIME, Goal, dU
from pairsim.solvers.stepping.step_size import extrapolation_weights

# Widening of intervals, determined on 73 quasi-steady solutions and six runs: without it errors were up to 1.4 and 1.9
# half-widths; with it all of them are inside their intervals, and so are those of two further runs, which were not
# used.
RESOLVED = 1.1  # largest change of log c within a cell at which half-widths are large enough without widening
# Power of the ratio of that change to RESOLVED in the widening of quasi-steady solutions. With the power 1 one of
# twelve points was off by 1.51 half-widths, at a change of 2.4, and one of thirteen later ones by 1.04.
OF_POINTS = 2
OF_RUNS = 3  # the power for runs, whose estimate has no scatter
KNOWN = 3  # number of accepted values from which a goal is extrapolated over a remeshing
# Power of the inverse distance with which errors of quasi-steady dU grow on given cells; measured.
NARROWING = 2


def widening(s_jump: float, power: int) -> float:
    """Factor omega of the cells' part of a half-width, above 1 where cells do not resolve the stress of a polymer.

    Estimates see only a part of the error of an unresolved stress.

    Args:
        s_jump: Largest change of log c within a cell; 0 in a Newtonian liquid.
        power: OF_POINTS or OF_RUNS.
    """
    return max(1.0, s_jump / RESOLVED) ** power


@dataclass
class Interval:
    """Half-width of the interval around the values of a goal in a run that is meant to contain the exact ones.

    With the symbols of "Runs" in docs/explanation/error-estimate.md it is

        omega |delta| + max(omega delta_max + f sigma_s, (d_0/d_min)^2 epsilon_0) + epsilon_t + epsilon_r,

    and |delta| more where the estimate delta is not added to the values.

    - |delta| of each value is at least the fraction `of_others` of the largest one. delta_max (`largest`) is the
      largest |delta| so far, which decays; it counts because the error of the estimate itself does not vanish where the
      estimate changes its sign. Estimates before SET_IN, while soft shapes take up missing stress, do not count in
      delta_max if there is an epsilon_0, nor do those in the same time after a kink of the flow.
    - f sigma_s (`irregular`) is the effect of errors on the viscosity of a liquid without a memory, beyond the first
      order.
    - epsilon_0 (`start`) is the error of the quasi-steady state at the first distances. It counts where it is larger,
      since estimates are carried forward from zero at t = 0, and do not see the scatter of the cells. It does not
      decay: on the same cells the states that the run passes have the same error, or a larger one as a gap narrows, and
      their estimates may be too small. From rest it sets in with the stress. It contains f sigma_s of the start.
    - epsilon_t is the indicator of the error due to the time steps.
    - epsilon_r (`jumps`) is the error due to remeshings, at which the stress is interpolated to another mesh; no
      residual shows it. The exact value is continuous in time, and the corrected one nearly so, since it depends little
      on the mesh: its deviation from a parabola through the last values counts as an error.

    Attributes:
        memory: Time constant with which the largest estimate and the jumps decay [D_c/U_av].
        added: Whether the estimate is added to the values.
        of_others: Lower bound on |delta| of one value, as a fraction of the largest one.
        start: Error of the discrete values in the quasi-steady state at the first distances, shape (k,); 0 if it is not
            known, or does not count.
        setting_in: Time constant with which that state is reached [D_c/U_av]; 0 for a run that starts from it.
        mesh: Number of remeshings before the last step.
        times: Times of the last steps, newest first, at most KNOWN.
        values: Their corrected values, shape (k,) each.
        largest: delta_max with its decay, shape (k,).
        jumps: Sum of the jumps at remeshings with their decay, shape (k,).
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
            steps: epsilon_t, the largest indicator so far of the error due to the time steps.
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
        """Discard the last values at a kink or jump of the flow, time t [D_c/U_av]: none is extrapolated across it."""
        self.times, self.values, self.begun = self.times[:1], [], t


@dataclass
class GoalErrors:
    """The errors of one goal. Lists and arrays are replaced, never changed in place.

    Attributes:
        steps: Indicator of the error due to the time steps.
        interval: The half-width at each step, where the error due to the cells is estimated.
        irregular: f sigma_s of the last step, shape (k,); for a goal that the run integrates, the sum over all steps,
            which decays.
        largest: Largest half-width after stresses have set in.
    """

    steps: TimeError
    interval: Interval
    irregular: Array | float = 0.0
    largest: float = 0.0

    @property
    def part(self) -> float:
        """Largest half-width relative to the largest value; 0 where values consist of errors only."""
        return self.largest / self.steps.peak if self.steps.peak > LEAST else 0.0


@dataclass
class RunErrors:
    """The errors of the goals of a run up to its last step.

    Attributes:
        goals: The errors of each goal, by its name.
        lost: Time from which half-widths are unknown because the estimates diverged; infinite if they did not.
    """

    goals: dict[str, GoalErrors]
    lost: float = np.inf

    @classmethod
    def of(cls, liquid: Liquid) -> RunErrors:
        """Errors of a run that has not begun; they decay in a time of 1 + De (chosen), as liquid passes and relaxes."""
        order, memory = 2 if liquid.has_memory else 3, 1.0 + liquid.longest
        goals = {
            goal.name: GoalErrors(TimeError(order), Interval(memory, goal.added, goal.of_others)) for goal in IN_TIME
        }
        return cls(goals)

    def __getitem__(self, goal: Goal) -> GoalErrors:
        return self.goals[goal.name]

    def begin(self, start: Mapping[str, Array], setting_in: float = 0.0) -> None:
        """Set epsilon_0, the errors in the quasi-steady state at the first distances.

        Args:
            start: The errors of goals, by their names, (k,) each.
            setting_in: Time constant with which that state is reached [D_c/U_av].
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
        """The half-widths of goals after an accepted step, (k,) each; empty where errors are not estimated.

        Args:
            t: Time [D_c/U_av].
            mesh: Number of remeshings before the step.
            discrete: Values of goals at the discrete solution, (k,) each.
            corrections: Estimates of exact minus discrete values, (k,) each, NaN once they have diverged; None if
                errors are not estimated.
            s_jump: Largest change of log c within a cell; 0 in a Newtonian liquid.
            closer: d_0/d_min, the largest factor by which a gap is narrower than at the start, at least 1.
            irregular: f sigma_s in the step, (k,) each; None for none.
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
        """Discard values up to a time [D_c/U_av], after which goals may change abruptly and steps begin again."""
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
        """Largest half-width of dU over the largest |dU|; 0 where dU is mere error, as for equal rigid particles."""
        return self[dU].part
