"""`pairsim run`: one case from its file to a folder of results."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
from mpi4py import MPI

from pairsim.case import Case
from pairsim.errors import RunFailure, TooManySteps, WallTime
from pairsim.fields import frame
from pairsim.mesh import MeshSettings
from pairsim.output import HEALTH, POLYMER_HEALTH, RunFolder, SeriesWriter, named_row, series_columns
from pairsim.progress import Reporter
from pairsim.record import Outcome, Record, new_folder
from pairsim.stepsize import StepControl
from pairsim.transient import Problem, Step, Transient
from pairsim.xdmf import FieldsWriter

SMALLEST_STEP = 1e-8


def problem_of(case: Case) -> Problem:
    """The transient problem of a validated case."""
    time_options = case.time
    largest = max(case.betas, default=0.0)
    return Problem(
        case.betas,
        case.Ca_es,
        case.gaps,
        case.tube_length,
        case.ends == "periodic",
        MeshSettings(**case.cell_sizes),
        StepControl(time_options.tol, SMALLEST_STEP, time_options.max_step, time_options.fixed_step),
        time_options.first_step,
        polymer=case.polymer,
        t_end=time_options.end,
        U_m=2 * (1 - 2 / 3 * largest**2),  # Faxen's law without wall corrections: only a first guess
    )


def milestones(case: Case) -> list[float]:
    """Times that steps land on: the wanted outputs and the end."""
    end, every = case.time.end, case.output.every
    times = {t for t in case.output.times if 0 < t < end}
    if every is not None:
        times |= {k * every for k in range(1, int(np.ceil(end / every - 1e-9)))}
    return [*sorted(times), end]


class _Signals:
    """Turns SIGINT and SIGTERM into a flag that all processes look at between steps."""

    def __init__(self) -> None:
        self.caught = 0
        self._old: dict[int, Any] = {}

    def _catch(self, number: int, _: FrameType | None) -> None:
        if self.caught:  # a second one does not wait for the step to end
            raise KeyboardInterrupt
        self.caught = number

    def __enter__(self) -> _Signals:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._old[number] = signal.signal(number, self._catch)
        return self

    def __exit__(self, *_: object) -> None:
        for number, old in self._old.items():
            signal.signal(number, old)


class _Recorder:
    """Writes what a run yields; does nothing on other processes than the first."""

    def __init__(self, case: Case, folder: RunFolder | None, transient: Transient) -> None:
        self.case, self.folder, self.pipe = case, folder, transient.pipe
        self.origin = transient.history.h[0].copy()
        self.columns = HEALTH + (POLYMER_HEALTH if case.polymer else ())
        if folder is not None:
            self.series = SeriesWriter(folder.file("series.csv"), [*series_columns(case.n), *self.columns])
            self.fields = FieldsWriter(folder.path) if case.output.fields else None

    def row(self, step: Step) -> None:
        o = step.observation
        if self.folder is None:
            return
        values = named_row(step.t, o.d, o.U, o.D, o.dp, o.dp - self.pipe(step.t).gradient * self.case.tube_length)
        health: tuple[float, ...] = (
            step.dt,
            step.report.iterations,
            step.mesh_id,
            o.m,
            o.volume_error,
            step.distortion,
        )
        if o.conformation is not None:
            c = o.conformation
            health += (c.c_max, c.z, c.r, c.c_min, c.s_jump)
        self.series.row(values | dict(zip(self.columns, map(float, health), strict=True)))

    def field(self, step: Step) -> None:
        if self.folder is not None and self.fields is not None:
            self.fields.write(frame(step, self.origin, self.pipe(step.t)))

    def close(self) -> None:
        if self.folder is not None:
            self.series.close()
            if self.fields is not None:
                self.fields.close()


def run_case(
    case: Case, directory: Path, *, comm: MPI.Comm, overwrite: bool, reporter: Reporter, command: str
) -> Outcome:
    """Run one case into a folder.

    Args:
        case: The validated case.
        directory: Where the results go.
        comm: Communicator of the case; every process calls this.
        overwrite: Replace the results of an earlier run.
        reporter: Shows progress (quiet on all processes but the first).
        command: The command line, for the record.

    Returns:
        How it ended. Whatever was computed is in the folder, also after a failure.

    Raises:
        InputError: The folder exists and may not be replaced.
    """
    folder = new_folder(comm, directory, overwrite, case.resolved())
    record = Record(folder, command, comm.size)
    record.write(None, {}, {})
    transient: Transient | None = None
    recorder: _Recorder | None = None
    reporter.start(case.name or case.slug, f"to t = {case.time.end:g}", case.time.end)
    for note in case.notes:
        reporter.note(note)
    try:
        with _Signals() as signals:
            transient = Transient(comm, problem_of(case))
            recorder = _Recorder(case, folder, transient)
            outcome = _march(case, transient, recorder, reporter, signals, record)
    except KeyboardInterrupt:
        outcome = Outcome("interrupted", "interrupted", "stopped at once; the rows written so far stand")
    except RunFailure as failure:
        outcome = Outcome("failed", failure.reason, str(failure))
    finally:
        if recorder is not None:
            recorder.close()
    record.write(outcome, *_told(transient))
    if transient is not None:
        transient.close()
    reporter.finish(outcome.message)
    return outcome


def _shown(step: Step, count: int) -> str:
    """A step in a line of progress."""
    o = step.observation
    gap = f"d = {o.d[0]:.5f}  dU = {o.U[1] - o.U[0]:+.4e}  " if o.d.size == 1 else ""
    return f"t = {step.t:.4g}  {gap}dt = {step.dt:.2g}  Newton {step.report.iterations}  step {count}"


def _told(transient: Transient | None) -> tuple[dict[str, Any], dict[str, float]]:
    """What run.json says of a march: its counts, and seconds by phase of the work."""
    if transient is None:
        return {}, {}
    counts = transient.counts
    told = {
        "t": transient.history.t[0],
        "steps": counts.steps,
        "rejected_steps": counts.rejected,
        "newton_iterations": counts.newton,
        "factorisations": counts.factorisations,
        "remeshings": counts.remeshings,
        "unknowns": transient.tie.size,
    }
    return told, dict(transient.clock.seconds)


def _march(
    case: Case, transient: Transient, recorder: _Recorder, reporter: Reporter, signals: _Signals, record: Record
) -> Outcome:
    """Take all steps, write them, and find the end."""
    comm, limits = transient.comm, case.limits
    wanted = milestones(case)
    pending: Step | None = None
    outcome: Outcome | None = None
    steps: Iterator[Step] = transient.steps(iter(wanted))
    try:
        for step in steps:
            o = step.observation
            with transient.clock("output"):
                recorder.row(step)
                at_output = any(abs(step.t - t) <= 1e-9 * max(1.0, t) for t in wanted)
                if at_output or transient.counts.steps == 1:
                    recorder.field(step)
                    pending = None
                else:
                    pending = step
            reporter.update(step.t, _shown(step, transient.counts.steps), transient.counts.steps)
            stop = comm.allreduce((signals.caught, record.passed), op=MPI.MAX)
            count = transient.counts.steps
            if o.d.size and o.d.min() < limits.min_gap:
                outcome = Outcome(
                    "finished", "contact", f"contact: the gap fell below {limits.min_gap:g} at t = {step.t:g}"
                )
            elif limits.max_gap is not None and o.d.size and o.d.max() > limits.max_gap:
                outcome = Outcome("finished", "max_gap", f"the gap passed {limits.max_gap:g} at t = {step.t:g}")
            elif stop[0]:
                name = signal.Signals(stop[0]).name
                outcome = Outcome(
                    "interrupted", "interrupted", f"{name} at t = {step.t:g}; the rows written so far stand"
                )
            elif limits.wall_time is not None and stop[1] > limits.wall_time:
                message = f"{stop[1]:.0f} s have passed"
                raise WallTime(message, t=step.t, step=count, advice="a larger limits.wall_time")
            elif transient.counts.steps >= limits.max_steps and step.t < case.time.end * (1 - 1e-12):
                message = f"{limits.max_steps} steps were taken"
                raise TooManySteps(message, t=step.t, step=count, advice="a larger limits.max_steps")
            if outcome is not None:
                break
    finally:
        if pending is not None and sys.exc_info()[0] is not KeyboardInterrupt:
            recorder.field(pending)
    return outcome or Outcome("finished", "end", f"finished at t = {transient.history.t[0]:g}")
