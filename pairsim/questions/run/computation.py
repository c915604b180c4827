"""The computation of a run: its steps, rows, fields and checkpoints, and the entries of run.json at the end."""

from __future__ import annotations

import math
from collections.abc import Iterator
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
from pairsim.quantities.kinds import LENGTH, TIME, VELOCITY
from pairsim.questions.run import QUESTION
from pairsim.questions.run.ends import end_of, frames_until, milestones, moment
from pairsim.questions.run.warnings import accuracy_of, warnings_of_run
from pairsim.questions.run.written import cycles_entry, row_of, settled_entry, summary
from pairsim.record.checkpoint import Checkpoint
from pairsim.record.column import Column, names_of, table_row
from pairsim.record.columns import (
    BRIDGE,
    CYCLE_COLUMNS,
    DRIFT,
    DRIFT_ERROR,
    ERROR_COLUMNS,
    ESTIMATE_COLUMNS,
    POLYMER_HEALTH,
    RUN_HEALTH,
    STATE_COLUMNS,
    Q,
)
from pairsim.record.fields_of_frame import frame
from pairsim.record.folder import plain
from pairsim.record.run_entries import (
    ADAPTATION,
    CYCLES,
    HOLD,
    START,
    Entry,
)
from pairsim.runtime.errors import RunFailure, TooManySteps, WallTime
from pairsim.runtime.message import Message, Text
from pairsim.runtime.monitor import Monitor
from pairsim.runtime.signals import Stopped
from pairsim.solvers.errors.run_errors import RunErrors
from pairsim.solvers.stepping.step import Step, at_step
from pairsim.solvers.transient.adaptation import RunAdaptation
from pairsim.solvers.transient.cycles import Cycles
from pairsim.solvers.transient.end import settled_branch
from pairsim.solvers.transient.state import Extremes
from pairsim.solvers.transient.transient import Transient

ADVICE = {
    WallTime: "a larger limits.wall_time",
    TooManySteps: "a larger limits.max_steps",
}
SAME = 1e-6  # relative change of distances below which rates off the axis are not computed twice; chosen
SETTLES = 10.0  # the settled state at the end of a run may take this long [s], or as long as the run if longer; chosen


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
        self._pending: Step | None = None  # the last step, until its fields are written

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
        transient.close()  # frees its memory for the quasi-steady solution
        monitor = self.problem.monitor
        longest = max(SETTLES, monitor.wall_time)
        problem = replace(self.problem, monitor=monitor.within(longest, "it was not found within {}"))
        with transient.clock("quasi-steady"):
            self._entries |= settled_entry(self.case, problem, transient.gaps, outcome)
        yield from self._off_axis(outcome, transient.gaps, transient.counts.steps)
        return self._with_accuracy(outcome, transient.run_errors)

    def _off_axis(self, outcome: events.Outcome, gaps: tuple[float, ...], steps: int) -> Iterator[events.Event]:
        """Compute rates off the axis, if asked for, in the quasi-steady states at the first and the last distances."""
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
        """The outcome, with a message that says whether an adapted run has kept its accuracy."""
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
        """The values of a row about a flow that varies, by column name."""
        values: dict[Column, Any] = {Q: self.problem.drive.flow_at(t)} if self._flowing else {}
        if cycles is not None:
            values |= {
                DRIFT: cycles.drift + np.zeros(cycles.d.size),
                DRIFT_ERROR: cycles.error + np.zeros(cycles.d.size),
            }
        return table_row(self.case.n, values)

    def _fields(self, transient: Transient) -> Iterator[events.Event]:
        """Yield the fields of the last step, unless they have been written."""
        step, self._pending = self._pending, None
        if step is not None and self.case.output.fields:
            yield events.Frame(frame(step, transient.origin, transient.pipe(step.t)))

    def _end(self) -> Iterator[events.Event]:
        """The last events: the summary for run.json, and the fields of the last step."""
        entries, seconds = dict[Entry[Any], Any](), dict[str, float]()
        errors, extremes = RunErrors.of(self.problem.liquid), Extremes()
        if (transient := self.transient) is not None:
            entries = summary(transient.counts, transient.history.t[0], transient.constraints.size)
            seconds, errors, extremes = transient.clock.seconds, transient.run_errors, transient.extremes
        elif self.old is not None:
            state = self.old.state
            entries = summary(state.counts, state.history.t[0], state.history.y[0].size)
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


def _shown(step: Step, count: int) -> Message:
    """A line of progress for a step."""
    o, texts = step.observation, list[Text]([Message("t = {}", TIME(step.t))])
    if o.d.size == 1:
        texts += [Message("d = {}", LENGTH(o.d[0], ".5f")), Message("dU = {}", VELOCITY(o.dU[0], "+.4g"))]
    texts += [Message("dt = {}", TIME(step.dt, ".2g")), f"Newton {step.report.iterations}", f"step {count}"]
    return Message.joined("  ", texts)
