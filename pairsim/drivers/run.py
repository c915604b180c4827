"""`pairsim run`: one case from its file to a folder of results."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from pairsim.config.case import FREE_ENDS, Case
from pairsim.config.form_kinds import forms_of
from pairsim.drivers.outcome import Outcome, Record, new_folder
from pairsim.drivers.problems import problem_of
from pairsim.drivers.progress import Reporter
from pairsim.drivers.run_output import RunOutput, RunWarnings, milestones
from pairsim.fem.form_cache import ensure_compiled
from pairsim.results.checkpoint import Checkpoint, check_same, load
from pairsim.results.output import CHECKPOINT, SERIES, RunFolder, plain, read_series
from pairsim.runtime.collective import collectively
from pairsim.runtime.errors import InputError, RunFailure, TooManySteps, WallTime, WriteFailure
from pairsim.runtime.fenicsx import MPI
from pairsim.runtime.locks import sole_writer
from pairsim.runtime.signals import Signals
from pairsim.solvers.history import Counts
from pairsim.solvers.step_size import reached
from pairsim.solvers.transient import Step, Transient

OTHERS = ("curve.csv", "critical.csv", "study.csv", "sweep.json", "grid.yaml")  # of folders that are no run's


def _end(case: Case, t: float, gaps: Sequence[float]) -> Outcome | None:
    """Whether a run is at its end, and why."""
    limits = case.limits
    if gaps and min(gaps) < limits.min_gap:
        return Outcome("finished", "contact", f"contact: the gap fell below {limits.min_gap:g} at t = {t:g}")
    if limits.max_gap is not None and gaps and max(gaps) > limits.max_gap:
        return Outcome("finished", "max_gap", f"the gap passed {limits.max_gap:g} at t = {t:g}")
    if case.n and (room := (case.tube_length - sum(case.betas) - sum(gaps)) / 2) < FREE_ENDS:
        message = (
            f"the particles are {room:.3g} from the ends of the tube at t = {t:g}; a longer length, or limits.max_gap"
        )
        return Outcome("failed", "tube_too_short", message)
    return Outcome("finished", "end", f"finished at t = {t:g}") if reached(t, case.time.end) else None


def _old(comm: MPI.Comm, case: Case, directory: Path) -> Checkpoint | None:
    """What a run goes on from, the same on every process; None where it must begin afresh.

    Raises:
        InputError: There are rows without a checkpoint, or the checkpoint is torn or that of another problem.
    """

    def read() -> Checkpoint | None:
        found = load(directory)
        series = directory / SERIES
        if found is not None:
            check_same(found.case, plain(case.resolved()), str(directory / CHECKPOINT))
        elif any((directory / name).exists() for name in OTHERS):
            raise InputError(str(directory), "--resume", None, "holds results of another command; give another folder")
        elif series.exists() and len(read_series(series)["t"]) > 1:
            allowed = f"has rows in {SERIES} but no {CHECKPOINT} to go on from; run the case again with --overwrite"
            raise InputError(str(directory), "--resume", None, allowed)
        return found

    return comm.bcast(collectively(comm, read))


def run_case(
    case: Case,
    directory: Path,
    *,
    comm: MPI.Comm,
    overwrite: bool,
    reporter: Reporter,
    command: str,
    resume: bool = False,
) -> Outcome:
    """Run one case into a folder.

    Args:
        case: The validated case.
        directory: Where the results go.
        comm: Communicator of the case; every process calls this.
        overwrite: Replace the results of an earlier run.
        reporter: Shows progress (quiet on all processes but the first).
        command: The command line, for the record.
        resume: Go on from the folder's checkpoint. Where there is neither one nor more than a row, begin afresh.

    Returns:
        How it ended. Whatever was computed is in the folder, also after a failure.

    Raises:
        InputError: The folder exists and may not be replaced, cannot be gone on with, or is another command's.
        WriteFailure: The last files could not be written.
    """
    with sole_writer(comm, directory, command):
        return _run(case, directory, comm, overwrite, reporter, command, resume)


def _run(
    case: Case, directory: Path, comm: MPI.Comm, overwrite: bool, reporter: Reporter, command: str, resume: bool
) -> Outcome:
    """What `run_case` does in a folder of its own."""
    old = _old(comm, case, directory) if resume else None
    ended = _end(case, old.state.history.t[0], old.gaps) if old is not None else None
    if old is None:
        folder = new_folder(comm, directory, overwrite or resume, case.resolved())
    else:
        folder = collectively(comm, lambda: RunFolder.reopen(directory))
    record = Record(folder, command, comm.size, old.wall if old is not None else 0.0)
    if old is not None and ended is not None:
        _confirm(comm, case, record, folder, ended, old)
        reporter.start(case.name or case.slug, f"to t = {case.time.end:g}", case.time.end)
        reporter.finish(f"nothing to do: {ended.message}")
        return ended

    def begin() -> RunOutput:
        assert folder is not None
        recorder = RunOutput(case, folder, old)
        folder.write_yaml("case.yaml", case.resolved())
        record.write(None, {}, {})
        return recorder

    recorder = _written(comm, begin, Counts(), 0.0)
    reporter.start(case.name or case.slug, f"to t = {case.time.end:g}", case.time.end)
    notes = list(case.notes)
    if old is not None:
        notes.append(f"goes on from t = {old.state.history.t[0]:g} (step {old.state.counts.steps})")
    elif resume:
        notes.append("there is no checkpoint: begins afresh")
    notes += recorder.damage if recorder is not None else []
    for note in notes:
        reporter.note(note)
    transient: Transient | None = None
    at_once = False
    try:
        with Signals(impatient=True) as signals:
            ensure_compiled(comm, forms_of(case))
            transient = Transient(comm, problem_of(case), old.state if old is not None else None)
            outcome = _march(case, transient, recorder, reporter, signals, record)
    except KeyboardInterrupt:
        at_once = True
        outcome = Outcome("interrupted", "interrupted", "stopped at once; the rows written so far stand")
    except RunFailure as failure:
        outcome = Outcome("failed", failure.reason, str(failure))

    counts, t = Counts(), 0.0
    told: dict[str, Any] = {}
    seconds: dict[str, float] = {}
    if transient is not None:
        counts, t, seconds = transient.counts, transient.history.t[0], transient.clock.seconds
        told = _told(counts, t, transient.constraints.size)

    def finish() -> None:
        if recorder is not None:
            ended = outcome
            try:
                recorder.finish(last_frame=not at_once)
            except OSError as error:
                ended = Outcome("failed", WriteFailure.reason, str(error))
                raise
            finally:
                record.write(ended, told | {"warnings": recorder.warnings}, dict(seconds))
                for warning in recorder.warnings:
                    reporter.note(warning)

    try:
        if at_once:  # the others may be anywhere
            finish()
        else:
            _written(comm, finish, counts, t)
    finally:
        if transient is not None:
            transient.close()
        reporter.finish(outcome.message)
    return outcome


def _confirm(
    comm: MPI.Comm, case: Case, record: Record, folder: RunFolder | None, ended: Outcome, old: Checkpoint
) -> None:
    """Say in run.json that a run is finished, if it was killed between its last checkpoint and that."""

    def confirm() -> None:
        assert folder is not None
        try:
            status = json.loads(folder.file("run.json").read_text(encoding="utf-8"))["status"]
        except (OSError, ValueError, KeyError):
            status = ""
        if status != "finished":
            history, series = old.state.history, read_series(folder.file(SERIES))
            told = _told(old.state.counts, history.t[0], history.y[0].size)
            told["warnings"] = RunWarnings.of(case, series, old.narrowest).warnings
            record.write(ended, told, old.state.seconds)

    _written(comm, confirm, old.state.counts, old.state.history.t[0])


def _shown(step: Step, count: int) -> str:
    """A step in a line of progress."""
    o = step.observation
    gap = f"d = {o.d[0]:.5f}  dU = {o.dU[0]:+.4e}  " if o.d.size == 1 else ""
    return f"t = {step.t:.4g}  {gap}dt = {step.dt:.2g}  Newton {step.report.iterations}  step {count}"


def _told(counts: Counts, t: float, unknowns: int) -> dict[str, Any]:
    """What run.json says of a march."""
    return {
        "t": t,
        "unknowns": unknowns,
        "steps": counts.steps,
        "rejected_steps": counts.rejected,
        "newton_iterations": counts.newton,
        "factorisations": counts.factorisations,
        "remeshings": counts.remeshings,
    }


def _written[T](comm: MPI.Comm, write: Callable[[], T], counts: Counts, t: float) -> T | None:
    """Write on the first process; every one fails if that does."""
    try:
        return collectively(comm, write)
    except OSError as error:
        advice = "more room on the disk, then --resume"
        raise WriteFailure(str(error), t=t, step=counts.steps, advice=advice) from error


def _march(
    case: Case,
    transient: Transient,
    recorder: RunOutput | None,
    reporter: Reporter,
    signals: Signals,
    record: Record,
) -> Outcome:
    """Take all steps, write them, and find the end."""
    comm, limits = transient.comm, case.limits
    if recorder is not None:
        recorder.attach(transient)
    for step in transient.steps(iter(milestones(case))):
        o, count = step.observation, transient.counts.steps

        def write(step: Step = step) -> None:
            assert recorder is not None
            recorder.take(step, record.passed)

        with transient.clock("output"):
            _written(comm, write, transient.counts, step.t)
        reporter.update(step.t, _shown(step, count), count)
        stop = comm.allreduce((signals.number, record.passed), op=MPI.MAX)
        if (outcome := _end(case, step.t, o.d.tolist())) is not None:
            return outcome
        if stop[0]:
            name = signal.Signals(stop[0]).name
            message = f"{name} at t = {step.t:g}; pairsim run --resume goes on from here"
            return Outcome("interrupted", "interrupted", message)
        if limits.wall_time is not None and stop[1] > limits.wall_time:
            message = f"{stop[1]:.0f} s have passed"
            raise WallTime(message, t=step.t, step=count, advice="a larger limits.wall_time, with --resume")
        if count >= limits.max_steps:
            message = f"{limits.max_steps} steps were taken"
            raise TooManySteps(message, t=step.t, step=count, advice="a larger limits.max_steps, with --resume")
    return Outcome("finished", "end", f"finished at t = {transient.history.t[0]:g}")
