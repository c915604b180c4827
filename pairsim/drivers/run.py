"""`pairsim run`: integrate a case in time and write the results to a folder."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from pairsim.config.case import FREE_ENDS, Case
from pairsim.config.form_kinds import forms_of
from pairsim.drivers.outcome import Outcome
from pairsim.drivers.problems import problem_of
from pairsim.drivers.run_adaptation import RunAdaptation, outcome_of
from pairsim.drivers.run_output import RunOutput, RunWarnings, milestones
from pairsim.drivers.run_verdict import settled_entry
from pairsim.drivers.session import Options, Session, open_session
from pairsim.fem.form_cache import ensure_compiled
from pairsim.results.checkpoint import Checkpoint, check_same, load
from pairsim.results.fields_writer import gather_frames
from pairsim.results.folders import read_record
from pairsim.results.output import CHECKPOINT, SERIES, plain, read_series
from pairsim.runtime.errors import InputError, TooManySteps, WallTime, WriteFailure
from pairsim.runtime.signals import heed
from pairsim.solvers.stepping.history import Counts
from pairsim.solvers.stepping.step import Step
from pairsim.solvers.stepping.step_size import reached
from pairsim.solvers.transient.transient import Transient

OTHERS = ("curve.csv", "critical.csv", "study.csv", "sweep.json", "grid.yaml")  # files of other commands
RETRY = "--resume"


def _end(case: Case, t: float, gaps: Sequence[float]) -> Outcome | None:
    """The outcome if a run has reached its end, else None."""
    limits = case.limits
    if gaps and min(gaps) < limits.min_gap:
        return Outcome("finished", "contact", f"contact: the gap fell below {limits.min_gap:g} at t = {t:g}")
    if limits.max_gap is not None and gaps and max(gaps) > limits.max_gap:
        return Outcome("finished", "max_gap", f"the gap exceeded {limits.max_gap:g} at t = {t:g}")
    if case.n and (room := (case.tube_length - sum(case.betas) - sum(gaps)) / 2) < FREE_ENDS:
        message = (
            f"the particles are only {room:.3g} D_c from the ends of the tube at t = {t:g}; try a larger length, or "
            "limits.max_gap"
        )
        return Outcome("failed", "tube_too_short", message)
    return Outcome("finished", "end", f"finished at t = {t:g}") if reached(t, case.time.end) else None


def _find_checkpoint(case: Case, directory: Path) -> Checkpoint | None:
    """The checkpoint to resume from; None if the run must start at t = 0.

    Raises:
        InputError: There are rows without a checkpoint, or the checkpoint is damaged or belongs to another problem.
    """
    found = load(directory)
    series = directory / SERIES
    if found is not None:
        check_same(found.case, plain(case.resolved()), str(directory / CHECKPOINT))
    elif any((directory / name).exists() for name in OTHERS):
        raise InputError(
            str(directory), "--resume", None, "must be the folder of a run, but holds results of another command"
        )
    elif series.exists() and len(read_series(series)["t"]) > 1:
        allowed = f"must have a {CHECKPOINT}, since {SERIES} has rows; run the case again with --overwrite"
        raise InputError(str(directory), "--resume", None, allowed)
    return found


def run_case(case: Case, directory: Path, options: Options, *, resume: bool = False) -> Outcome:
    """Integrate one case in time and write the results to a folder.

    Args:
        case: The validated case.
        directory: Folder for the results.
        options: Overwriting, progress and signals.
        resume: Continue from the checkpoint in the folder. Without a checkpoint, and with at most one row in
            series.csv, the run starts at t = 0.

    Returns:
        How the command ended. Results computed before a failure are in the folder, too.

    Raises:
        InputError: The folder exists and may not be overwritten, cannot be resumed, or belongs to another command.
        WriteFailure: The first or last files cannot be written.
    """
    if not resume:
        with open_session(case, directory, options) as session:
            return _run(case, session, [])
    replacing = replace(options, overwrite=True)
    with open_session(case, directory, replacing, lambda: _find_checkpoint(case, directory)) as session:
        old = session.checkpoint
        if old is None:
            return _run(case, session, ["no checkpoint: starting at t = 0"])
        if (ended := _end(case, old.state.history.t[0], old.gaps)) is not None:
            _confirm(case, session, old, ended)
            session.announce(*_goal(case))
            session.reporter.finish(f"nothing to do: {ended.message}")
            return ended
        return _run(case, session, [f"resuming from t = {old.state.history.t[0]:g} (step {old.state.counts.steps})"])


def _goal(case: Case) -> tuple[str, float]:
    """The end time, as text for the progress display and as a number."""
    return f"to t = {case.time.end:g}", case.time.end


def _run(case: Case, session: Session, notes: list[str]) -> Outcome:
    """Integrate from the checkpoint of the session, or from t = 0, to the end."""
    old = session.checkpoint

    def begin() -> RunOutput:
        output = RunOutput(case, session.folder, old)
        session.folder.write_yaml("case.yaml", case.resolved())
        session.record.write(None, {}, {})
        return output

    output = session.write(begin, retry=RETRY)
    session.announce(*_goal(case), [*notes, *output.damage])
    transient: Transient | None = None
    adaptation: RunAdaptation | None = None
    found: dict[str, Any] = {}

    def work() -> Outcome:
        nonlocal transient, adaptation
        ensure_compiled(forms_of(case), session.reporter.note)
        problem = problem_of(case)
        if case.adapts:
            session.reporter.note(f"a coarse run first: it tells which cells accuracy: {case.accuracy} needs")
            adaptation = RunAdaptation.begin(case, problem, lambda *at: _end(case, *at) is not None)
            problem = adaptation.adapted(problem) if adaptation is not None else problem
        transient = Transient(problem, old.state if old is not None else None)
        ended, gaps = _march(case, transient, output, session)
        transient.close()  # its memory serves the quasi-steady solution
        with transient.clock("quasi-steady"):
            found.update(settled_entry(case, problem, gaps, ended))
        return ended

    def kept() -> str:
        t = transient.history.t[0] if transient is not None else old.state.history.t[0] if old is not None else 0.0
        return f" at t = {t:g}; continue with pairsim run --resume"

    outcome = session.carry_out(work, kept)
    counts, t = Counts(), 0.0
    summary: dict[str, Any] = {}
    seconds: dict[str, float] = {}
    if transient is not None:
        counts, t, seconds = transient.counts, transient.history.t[0], transient.clock.seconds
        summary = _summary(counts, t, transient.constraints.size) | found

    def finish() -> None:
        nonlocal outcome
        if adaptation is not None:
            entry, words = outcome_of(output.worst)
            summary["adaptation"] = adaptation.entry | entry
            if outcome.status == "finished":
                outcome = replace(outcome, message=outcome.message + words)
        ended = outcome
        try:
            output.finish(not session.stopped_at_once, outcome.status != "interrupted")
        except OSError as error:
            ended = Outcome("failed", WriteFailure.reason, str(error))
            raise
        finally:
            session.record.write(ended, summary | {"warnings": output.warnings}, dict(seconds))

    try:
        session.write(finish, retry=RETRY, t=t, step=counts.steps)
    finally:
        if transient is not None:
            transient.close()
        session.reporter.finish(outcome.message)
    return outcome


def _confirm(case: Case, session: Session, old: Checkpoint, ended: Outcome) -> None:
    """Write to run.json that a run is finished, if it was killed after its last checkpoint and before doing so."""
    counts, history = old.state.counts, old.state.history
    confirmed = read_record(session.folder.path).get("status") == "finished"
    found: dict[str, Any] = {}
    if not confirmed:
        ensure_compiled(forms_of(case), session.reporter.note)
        found = settled_entry(case, problem_of(case), old.gaps, ended)

    def confirm() -> None:
        if not confirmed:
            series = read_series(session.folder.file(SERIES))
            summary = _summary(counts, history.t[0], history.y[0].size) | found
            summary["warnings"] = RunWarnings.of(case, series, old.narrowest, old.state.start_error).warnings
            session.record.write(ended, summary, old.state.seconds)
        with suppress(OSError):  # the frames are complete as they are
            gather_frames(session.folder.path)

    session.write(confirm, retry=RETRY, t=history.t[0], step=counts.steps)


def _shown(step: Step, count: int) -> str:
    """A line of progress for a step."""
    o = step.observation
    gap = f"d = {o.d[0]:.5f}  dU = {o.dU[0]:+.4e}  " if o.d.size == 1 else ""
    return f"t = {step.t:.4g}  {gap}dt = {step.dt:.2g}  Newton {step.report.iterations}  step {count}"


def _summary(counts: Counts, t: float, unknowns: int) -> dict[str, Any]:
    """Entries of run.json: time, unknowns and counts."""
    return {
        "t": t,
        "unknowns": unknowns,
        "steps": counts.steps,
        "rejected_steps": counts.rejected,
        "newton_iterations": counts.newton,
        "factorisations": counts.factorisations,
        "remeshings": counts.remeshings,
    }


def _march(case: Case, transient: Transient, output: RunOutput, session: Session) -> tuple[Outcome, tuple[float, ...]]:
    """Take all time steps and write them; returns how the run ended, and the last distances.

    Raises:
        Stopped: The process has received a signal; all steps taken are written.
    """
    record, limits, gaps = session.record, case.limits, case.gaps
    output.attach(transient)
    for step in transient.steps(iter(milestones(case))):
        o, count = step.observation, transient.counts.steps
        gaps = tuple(map(float, o.d))

        def write(step: Step = step) -> None:
            output.take(step, record.passed)

        with transient.clock("output"):
            session.write(write, retry=RETRY, t=step.t, step=count)
        session.reporter.update(step.t, _shown(step, count), count)
        if (outcome := _end(case, step.t, gaps)) is not None:
            return outcome, gaps
        heed()
        if limits.wall_time is not None and record.passed > limits.wall_time:
            message = f"{record.passed:.0f} s have passed"
            raise WallTime(message, t=step.t, step=count, advice="a larger limits.wall_time, with --resume")
        if count >= limits.max_steps:
            message = f"{limits.max_steps} steps were taken"
            raise TooManySteps(message, t=step.t, step=count, advice="a larger limits.max_steps, with --resume")
    return Outcome("finished", "end", f"finished at t = {transient.history.t[0]:g}"), gaps
