"""A run as it advances: its steps, rows, fields and checkpoints, and what run.json says at the end."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from pairsim.cases.identity import sources_of
from pairsim.cases.run_case import Case
from pairsim.computing import events
from pairsim.computing.off_axis.beside import rates_beside
from pairsim.computing.problems import problem_of
from pairsim.fem.unyielded import bridges
from pairsim.quantities.kinds import LENGTH, TIME, VELOCITY
from pairsim.quantities.text import in_unit
from pairsim.questions.run import QUESTION
from pairsim.questions.run.warnings import accuracy_of, warnings_of_run
from pairsim.record.checkpoint import Checkpoint
from pairsim.record.column import Column, names_of, table_row
from pairsim.record.columns import (
    BRIDGE,
    CYCLE_COLUMNS,
    DISTANCE,
    DISTORTION,
    DP,
    DP_PLUS,
    DRIFT,
    DRIFT_ERROR,
    DT,
    DU,
    DU_CORRECTION,
    DU_DISCRETE,
    ERROR_COLUMNS,
    ESTIMATE_COLUMNS,
    MESH,
    NEWTON,
    POLYMER_HEALTH,
    RUN_HEALTH,
    STATE_COLUMNS,
    TAYLOR,
    Q,
    T,
    U,
    Z,
    observed,
)
from pairsim.record.fields_of_frame import frame
from pairsim.record.folder import plain
from pairsim.record.run_entries import (
    ADAPTATION,
    CYCLES,
    FACTORISATIONS,
    HOLD,
    NEWTON_ITERATIONS,
    REACHED,
    REJECTED,
    REMESHINGS,
    SETTLED,
    SIZE,
    START,
    TIME_STEPS,
    Entries,
    Entry,
    WholeCycles,
)
from pairsim.runtime.errors import RunFailure, TooManySteps, WallTime
from pairsim.runtime.message import Message, Text
from pairsim.runtime.monitor import Monitor
from pairsim.runtime.signals import Stopped
from pairsim.solvers.errors.run_errors import RunErrors
from pairsim.solvers.goals import IN_TIME, dU
from pairsim.solvers.problems import Problem
from pairsim.solvers.stepping.step import Step, at_step
from pairsim.solvers.transient.adaptation import RunAdaptation
from pairsim.solvers.transient.cycles import Cycles
from pairsim.solvers.transient.end import reason_to_end, settled, settled_branch
from pairsim.solvers.transient.state import Counts, Extremes
from pairsim.solvers.transient.transient import Transient

ADVICE = {
    WallTime: "a larger limits.wall_time",
    TooManySteps: "a larger limits.max_steps",
}
NEARLY_DUE = 1e-9  # part of a frame that may be missing by rounding when it is written
HALF_WIDTHS = {goal: next(each for each in ERROR_COLUMNS if each.name == goal.error_column) for goal in IN_TIME}
SAME = 1e-6  # relative change of distances below which rates off the axis are the same; chosen
SETTLES = 10.0  # time for the settled state at the end of a run [s], at least: else what the run itself took; chosen


class Run:
    """A run as it advances, from t = 0 or from where an earlier one has stopped."""

    def __init__(self, case: Case, monitor: Monitor, earlier: events.Earlier | None) -> None:
        self.case, self.problem, self.earlier = case, problem_of(case, monitor), earlier
        self.old = old = earlier.checkpoint if earlier is not None else None
        self.transient: Transient | None = None
        self._adapt(old.adaptation if old is not None else None)
        known = case.n > 1 and (case.estimates_error or (case.start == "steady" and case.waveform is None))
        self._errors = (*(ESTIMATE_COLUMNS if case.estimates_error else ()), *(ERROR_COLUMNS if known else ()))
        self._own = QUESTION.tables["series"].own
        self._entries: dict[Entry[Any], Any] = {}
        self._remarks: list[Text] = []
        self._pending: Step | None = None  # its fields are not written

    def _adapt(self, adaptation: RunAdaptation | None) -> None:
        """Use the cells that follow from a coarse run, if there was one."""
        self.adaptation = adaptation
        if adaptation is not None:
            self.problem = adaptation.adapted(self.problem)

    def computation(self) -> events.Events:
        case, old = self.case, self.old
        ended = None
        if old is not None:
            ended = end_of(case, self.problem, old.state.history.t[0], old.state.gaps, old.state.cycles)
        if self.earlier is not None and self.earlier.finished and ended is not None:
            return ended
        yield events.Begin("to " + moment(case.time.end), case.time.end)
        try:
            if old is not None and ended is not None:  # it was killed after its last checkpoint
                self._entries |= settled_entry(case, self.problem, old.state.gaps, ended)
                yield from self._off_axis(ended, old.state.gaps, old.state.counts.steps)
                return self._with_accuracy(ended, old.state.run_errors)
            polymer = POLYMER_HEALTH if case.liquid_model.modes else ()
            yielding = (BRIDGE,) if case.liquid_model.plastic.yield_stress else ()
            columns = (*STATE_COLUMNS, *self._flowing, *self._errors, *yielding, *RUN_HEALTH, *polymer, *self._own)
            yield events.Table("series", names_of(case.n, *columns), resumed=True)
            if old is not None:
                at = moment(old.state.history.t[0])
                yield events.Note(Message("resuming from {} (step {})", at, old.state.counts.steps))
            elif case.adapts:
                yield events.Note(f"a coarse run first: it tells which cells accuracy: {case.accuracy} needs")
                self._adapt(RunAdaptation.begin(self.problem, case.error_wanted))
            settled = self.adaptation.settled if self.adaptation is not None else None
            self.transient = Transient(self.problem, old.state if old is not None else None, settled)
            with closing(self.transient):
                return (yield from self._integrate(self.transient))
        except KeyboardInterrupt as interrupt:
            if not isinstance(interrupt, Stopped):  # in the middle of a step
                self._pending = None
            raise
        finally:
            yield from self._end()

    def _integrate(self, transient: Transient) -> events.Events:
        """Take all steps, and find what the particles do at the end."""
        outcome = yield from self._march(transient)
        transient.close()  # its memory serves the quasi-steady solution
        monitor = self.problem.monitor
        longest = max(SETTLES, monitor.wall_time)
        problem = replace(self.problem, monitor=monitor.within(longest, "it was not found within {}"))
        with transient.clock("quasi-steady"):
            self._entries |= settled_entry(self.case, problem, transient.gaps, outcome)
        yield from self._off_axis(outcome, transient.gaps, transient.counts.steps)
        return self._with_accuracy(outcome, transient.run_errors)

    def _off_axis(self, outcome: events.Outcome, gaps: tuple[float, ...], steps: int) -> Iterator[events.Event]:
        """Rates off the axis at the first and at the last distances, in the quasi-steady states there, if asked for."""
        if not self.case.focus or outcome.status != "finished":
            return
        first = self.problem.gaps
        distances = [first] if np.allclose(first, gaps, rtol=SAME, atol=0) else [first, tuple(map(float, gaps))]
        try:
            branch = settled_branch(self.problem, min((d for each in distances for d in each), default=math.inf))
        except RunFailure as failure:
            self._remarks.append(Message("no rate off the axis was found: {}", failure.message))
            return
        with closing(branch):
            places = [replace(branch.solver.parameters, gaps=each) for each in distances]
            self._remarks += yield from rates_beside(self.case, branch, places, self.case.time.end, steps)

    def _with_accuracy(self, outcome: events.Outcome, errors: RunErrors) -> events.Outcome:
        """An outcome whose message says whether an adapted run has kept its accuracy."""
        if self.adaptation is None or outcome.status != "finished":
            return outcome
        return replace(outcome, message=outcome.message + accuracy_of(self.case, errors)[1])

    def _march(self, transient: Transient) -> events.Events:
        """Take all time steps; returns how the run ended.

        Raises:
            Stopped: The process has received a signal; all steps taken are written.
            WallTime, TooManySteps: A limit of the case was exceeded.
        """
        case, limits = self.case, self.case.limits
        wanted, resolved = milestones(case), plain(case.resolved() | sources_of(case))
        before = frames_until(case, transient.history.t[0], transient.gaps)
        for step in transient.steps(iter(wanted)):
            count = transient.counts.steps
            with transient.clock("output"):
                row = row_of(step) | self._of_flow(step.t, transient.cycles) | self._own.own_row(case.n, step)
                yield events.Row("series", row)
                self._pending = step
                at_output = any(abs(step.t - t) <= 1e-9 * max(1.0, t) for t in wanted)
                after = frames_until(case, step.t, transient.gaps)
                if at_output or count == 1 or after > before:
                    yield from self._fields(transient)
                before = after
                checkpoint = partial(Checkpoint, transient.state, resolved, self.adaptation)
                state = events.Resumable(checkpoint, case.output.checkpoint, convenient=at_output)
                yield events.Progress(step.t, _shown(step, count), count, state)
            if (outcome := end_of(case, self.problem, step.t, transient.gaps, transient.cycles)) is not None:
                return outcome
            self.problem.monitor.check()
            passed = self.problem.monitor.wall_time
            if limits.wall_time is not None and passed > limits.wall_time:
                raise WallTime(f"{passed:.0f} s have passed", at=at_step(step.t, count), advice=ADVICE[WallTime])
            if count >= limits.max_steps:
                message = f"{limits.max_steps} steps were taken"
                raise TooManySteps(message, at=at_step(step.t, count), advice=ADVICE[TooManySteps])
        return events.Outcome("finished", "end", "finished at " + moment(transient.history.t[0]))

    @property
    def _flowing(self) -> tuple[Column, ...]:
        """The columns of a flow that varies."""
        if not self.problem.drive.varies:
            return ()
        return (Q, *CYCLE_COLUMNS) if self.case.n > 1 else (Q,)

    def _of_flow(self, t: float, cycles: Cycles | None) -> dict[str, float]:
        """What a row has of a flow that varies."""
        values: dict[Column, Any] = {Q: self.problem.drive.flow_at(t)} if self._flowing else {}
        if cycles is not None:
            values |= {
                DRIFT: cycles.drift + np.zeros(cycles.d.size),
                DRIFT_ERROR: cycles.error + np.zeros(cycles.d.size),
            }
        return table_row(self.case.n, values)

    def _fields(self, transient: Transient) -> Iterator[events.Event]:
        """The fields of the last step, unless they were written."""
        step, self._pending = self._pending, None
        if step is not None and self.case.output.fields:
            yield events.Frame(frame(step, transient.origin, transient.pipe(step.t)))

    def _end(self) -> Iterator[events.Event]:
        """What run.json says, and the last fields."""
        entries, seconds = dict[Entry[Any], Any](), dict[str, float]()
        errors, extremes = RunErrors.of(self.problem.liquid), Extremes()
        if (transient := self.transient) is not None:
            entries = _summary(transient.counts, transient.history.t[0], transient.constraints.size)
            seconds, errors, extremes = transient.clock.seconds, transient.run_errors, transient.extremes
        elif self.old is not None:
            state = self.old.state
            entries = _summary(state.counts, state.history.t[0], state.history.y[0].size)
            seconds, errors, extremes = state.seconds, state.run_errors, state.extremes
        entries |= {START: self.case.start, HOLD: self.case.hold, **self._entries}
        done = transient or (self.old.state if self.old is not None else None)
        if done is not None and done.cycles is not None:
            entries[CYCLES] = cycles_entry(self.case, done.cycles)
        if (first := self.adaptation) is not None:
            coarse = {"t": first.t, "unknowns": first.unknowns, "dU": first.dU, "dU_error": first.error}
            entry = {"wanted": first.wanted, "cells": first.factor, "coarse_run": coarse}
            entries[ADAPTATION] = entry | accuracy_of(self.case, errors)[0]
        warnings = [*warnings_of_run(self.case, errors, extremes), *self._remarks]
        yield events.Summary(entries, warnings, seconds)
        if transient is not None:
            yield from self._fields(transient)


def milestones(case: Case) -> list[float]:
    """Times that steps must land on: the output times and the end time, ascending."""
    end, every = case.time.end, case.output.every
    times = {t for t in case.output.times if 0 < t < end}
    if every is not None:
        times |= {k * every for k in range(1, math.ceil(end / every - 1e-9))}
    return [*sorted(times), end]


def frames_until(case: Case, t: float, gaps: Sequence[float]) -> int:
    """How many of the `output.frames` are due at a time [D_c/U_av] and distances [D_c], N-1 values.

    They are spread evenly over the way to what ends the run: its end time, contact or `max_gap`, of which the nearest
    one counts. Unlike `milestones` they cost no steps. Where a run was stopped makes no difference to them.
    """
    output, limits = case.output, case.limits
    if output.times or output.every is not None:
        return 0
    passed = t / case.time.end
    for start, d in zip(case.gaps, gaps, strict=True):
        passed = max(passed, (start - d) / (start - limits.min_gap))
        if limits.max_gap is not None:
            passed = max(passed, (d - start) / (limits.max_gap - start))
    return int(output.frames * passed + NEARLY_DUE)


def moment(t: float) -> Message:
    """A time in words."""
    return Message("t = {}", TIME(t, ".6g"))


def end_of(
    case: Case, problem: Problem, t: float, gaps: Sequence[float], cycles: Cycles | None = None
) -> events.Outcome | None:
    """The outcome of a run that has reached its end at a time, distances and cycles, else None."""
    at, scales = moment(t), case.scales
    match reason_to_end(problem, t, gaps, cycles):
        case "contact":
            message = Message("contact: the gap fell below {} at {}", in_unit(scales, LENGTH, problem.min_gap), at)
            return events.Outcome("finished", "contact", message)
        case "max_gap":
            widest = in_unit(scales, LENGTH, problem.max_gap or 0.0)
            return events.Outcome("finished", "max_gap", Message("the gap exceeded {} at {}", widest, at))
        case "tube_too_short":
            pace = (sum(gaps) - sum(case.gaps)) / t
            least = math.ceil(case.cluster + max(pace, 0.0) * case.time.end + 2 * case.margin)
            message = Message(
                "the particles are only {} from the ends of the tube at {}; try a longer tube (--set length={}, enough "
                "until the end at the present pace), or limits.max_gap",
                LENGTH(problem.room(gaps), ".3g", named=True),
                at,
                least,
            )
            return events.Outcome("failed", "tube_too_short", message)
        case "periodic":
            known = f"cycles are periodic and the drift is known to accuracy: {case.accuracy}"
            return events.Outcome("finished", "periodic", Message("{} at {}", known, at))
        case "end":
            return events.Outcome("finished", "end", "finished at " + at)
        case None:
            return None


def settled_entry(case: Case, problem: Problem, gaps: tuple[float, ...], ended: events.Outcome) -> Entries:
    """The quasi-steady solution at the last distances of a run [D_c], N-1 values, on the cells of its problem.

    Returns the entry of run.json: dU with its error at every gap [U_av], the decay time of a disturbance [D_c/U_av],
    how the run started and which part of dU `accuracy` allows as error; a message, if there is no such solution. Empty
    for a single particle, held distances, a flow that varies, a run that ended early, and a polymer with a yield
    stress.
    """
    if case.waveform is not None:
        return {}
    if case.n < 2 or ended.reason not in ("end", "max_gap") or case.hold or case.liquid_model.yielding is not None:
        return {}
    try:
        point, creeps = settled(problem, gaps)
    except RunFailure as failure:
        return {SETTLED: {"message": failure.message}}
    except Stopped:
        return {SETTLED: {"message": "the quasi-steady solution at the last distances was interrupted"}}
    if not math.isfinite(point.t_relax):
        return {SETTLED: {"message": "disturbances of the quasi-steady state at the last distances do not decay"}}
    # What a run without estimates tends to is the solution on its cells, without the estimate of their error.
    left = 0 * point.correction if case.estimates_error else point.correction
    dU, error = point.dUs - left, point.dU_errors + abs(left)
    entry = {"d": list(point.gaps), "dU": dU.tolist(), "dU_error": error.tolist()}
    entry |= {"creeps": True} if creeps else {}
    entry |= {"held_together": True} if point.arrested else {}
    return {SETTLED: entry | {"t_relax": point.t_relax, "start": case.start, "accuracy": case.error_wanted}}


def cycles_entry(case: Case, cycles: Cycles) -> WholeCycles:
    """What run.json says of cycles."""
    assert case.waveform is not None, "there are no cycles"
    part, ones = case.error_wanted, np.zeros(cycles.d.size)
    entry = WholeCycles(
        shape=case.waveform.shape,
        cycle=cycles.cycle,
        repeats=cycles.repeats,
        U_av=case.unit_of_flow,
        whole=cycles.count,
        accuracy=part,
    )
    if cycles.count:
        drift, errors = (np.asarray(each + ones).tolist() for each in (cycles.drift, cycles.error))
        known = [each if math.isfinite(each) else None for each in errors]  # its estimate may have diverged
        entry |= {"drift": drift, "drift_error": known, "dU_peak": cycles.peak}
    if cycles.count > 1:
        entry |= {"change": cycles.remaining, "periodic": cycles.are_periodic(part), "known": cycles.are_known(part)}
    return entry


def row_of(step: Step) -> dict[str, float]:
    """The row of a step in series.csv."""
    o = step.observation
    values: dict[Column, Any] = {T: step.t, Z: step.z, DISTANCE: o.d, U: step.U, DU: step.dU, TAYLOR: o.D}
    values |= {DP: o.dp, DP_PLUS: o.dp_plus, DT: step.dt, NEWTON: step.report.iterations}
    values |= {MESH: step.mesh_id, DISTORTION: step.distortion, **observed(o)}
    values |= {HALF_WIDTHS[goal]: each if goal.per else float(each[0]) for goal, each in step.half_widths.items()}
    if step.scene.material.plastic.yield_stress:
        values[BRIDGE] = bridges(step.scene, step.x, step.h)
    if step.corrections:
        values |= {DU_DISCRETE: step.dU_discrete, DU_CORRECTION: step.corrections[dU]}
    return table_row(o.U.size, values)


def _shown(step: Step, count: int) -> Message:
    """A line of progress for a step."""
    o, texts = step.observation, list[Text]([Message("t = {}", TIME(step.t))])
    if o.d.size == 1:
        texts += [Message("d = {}", LENGTH(o.d[0], ".5f")), Message("dU = {}", VELOCITY(o.dU[0], "+.4g"))]
    texts += [Message("dt = {}", TIME(step.dt, ".2g")), f"Newton {step.report.iterations}", f"step {count}"]
    return Message.joined("  ", texts)


def _summary(counts: Counts, t: float, unknowns: int) -> dict[Entry[Any], Any]:
    """Entries of run.json: time, unknowns and counts."""
    return {
        REACHED: t,
        SIZE: unknowns,
        TIME_STEPS: counts.steps,
        REJECTED: counts.rejected,
        NEWTON_ITERATIONS: counts.newton,
        FACTORISATIONS: counts.factorisations,
        REMESHINGS: counts.remeshings,
    }
