"""Carry out the computation of a question: its events (`computing/events.py`) are written, shown and kept here."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from pairsim.cases.case import SceneCase
from pairsim.cases.identity import identity_of, key_of, sources_of, with_later_keys
from pairsim.cases.inputs import inputs_of, units_of
from pairsim.computing import events
from pairsim.computing.events import Outcome
from pairsim.computing.progress import Reporter
from pairsim.computing.provenance import about, peak_memory
from pairsim.computing.question import Question
from pairsim.computing.workers import ALONE, Workers
from pairsim.fem.compilation import jit
from pairsim.quantities.kinds import TIME
from pairsim.record.checkpoint import Checkpoint, check_same, load
from pairsim.record.folder import CHECKPOINT, kind_of, plain, prepare_folder, write_yaml
from pairsim.record.record import Record
from pairsim.record.run_entries import KEY, KIND, MESSAGE, PEAK_MEMORY, PHASES, REASON, SECONDS, STATUS, WARNINGS, Entry
from pairsim.record.table_files import TableWriter, read_table
from pairsim.record.xdmf import FieldsWriter
from pairsim.runtime.errors import Argument, BranchEnd, EnvironmentFailure, InputError, RunFailure, WriteFailure
from pairsim.runtime.locks import sole_writer
from pairsim.runtime.message import Message, Text, entries_in_units, in_units
from pairsim.runtime.monitor import Monitor
from pairsim.runtime.signals import Signals
from pairsim.runtime.text import duration

SOON = 0.1  # fraction of the largest time after which progress without a new result names this limit; chosen
KEPT = "; the results written so far are kept"
CHEAP = 50.0  # least time between checkpoints at convenient moments, over the wall time of writing one; chosen


@dataclass(frozen=True)
class Options:
    """How a case is computed, whatever the command."""

    overwrite: bool  # whether existing results may be replaced
    reporter: Reporter
    command: str  # command line, for run.json and for the lock
    own_files: Iterable[str]  # names of files that may be replaced in a folder; read only if it has files
    signals: Signals | None = None  # signals that end the computation in an orderly way, caught by the caller
    budget: float | None = None  # largest wall time of the computation [s]; None for no limit
    patience: float | None = None  # largest processor time up to the first row [s] without a budget; None for no limit
    title: str = ""  # heading of the progress; the name or the parameters of the case by default
    workers: Workers = ALONE  # the processes that help, if the question shares its work; entered by the caller


def carry_out[C: SceneCase](
    question: Question[C], case: C, directory: Path, options: Options, *, resume: bool = False, **more: Any
) -> Outcome:
    """Compute a case and write the results to a folder, which is locked against other commands meanwhile.

    With `resume` it continues from the checkpoint in the folder, or starts anew if there is none and the table has at
    most one row. Further keywords are those of the computation. Results from before a failure stay in the folder.

    Raises:
        InputError: The folder exists and may not be overwritten, cannot be resumed, belongs to another command, or
            another command is writing to it.
        WriteFailure: case.yaml or run.json cannot be written.
    """
    notes = [*case.remarks, *case.notes, *question.estimate(case).notes]
    uncertain = [each.key for each in inputs_of(case) if each.half_width and not question.has_flag("sensitivities")]
    if uncertain:
        notes.append(
            f"half-widths of {', '.join(uncertain)} are not included in this answer; pairsim curve includes them"
        )
    with sole_writer(directory, options.command):
        earlier = _earlier(case, directory, f"{question.table}.csv") if resume else None
        if earlier is not None:
            more["earlier"] = earlier
        elif resume:
            notes.append("no checkpoint: starting at t = 0")
        old = earlier.checkpoint if earlier is not None else None
        session = _Session(question, case, directory, options, notes, old)
        if question.shared:
            more["workers"] = options.workers
        computation = question.solve(case, monitor=session.monitor, **more)  # which may refuse a keyword
        if earlier is None:
            prepare_folder(directory, options.overwrite or resume, options.own_files)
        with options.workers.at_work_in(directory):
            return session.carry_out(computation)


def _earlier(case: SceneCase, directory: Path, table: str) -> events.Earlier | None:
    """The state of a computation in a folder that is to be resumed; None if it must start anew.

    Raises:
        InputError: The checkpoint is damaged or belongs to another problem, or the table has fewer rows than it counts,
            or has some without a checkpoint.
    """
    found, path = load(directory), directory / table
    rows = read_table(path).rows if path.exists() else 0
    if found is not None:
        old, new = with_later_keys(found.case, type(case)), plain(case.resolved() | sources_of(case))
        check_same(old, new, str(directory / CHECKPOINT))
        if rows < found.rows:
            raise InputError(str(path), "", None, f"must have at least {found.rows} rows, to match the checkpoint")
        return events.Earlier(found, Record.read(directory).status == "finished")
    files = [file.name for file in directory.iterdir() if not file.name.startswith(".") and file.name != "case.yaml"]
    if files and kind_of(directory) != case.kind:
        allowed = f"must be the folder of a {case.kind}, but holds results of another command"
        raise InputError(str(directory), Argument("resume"), None, allowed)
    if rows > 1:
        allowed = f"must have a {CHECKPOINT}, because {table} has rows; run the case again with `overwrite`"
        raise InputError(str(directory), Argument("resume"), None, allowed)
    return None


class _Session:
    """Carries out the events of a computation in a locked folder, after the checkpoint `old` if it is resumed."""

    def __init__(
        self,
        question: Question[Any],
        case: SceneCase,
        folder: Path,
        options: Options,
        notes: Sequence[str],
        old: Checkpoint | None,
    ) -> None:
        self.case, self.folder, self.reporter = case, folder, options.reporter
        self.old, self.resumable, self._declared = old, question.resumable, question.tables
        self._options, self._notes, self._about = options, notes, about(options.command)
        self.monitor = Monitor(
            options.signals,
            budget=options.budget,
            patience=options.patience if options.budget is None else None,
            listener=self.on_the_way,
            before=old.wall if old is not None else 0.0,
        )
        self._begun = self._compiled = False
        self._t = old.state.history.t[0] if old else 0.0
        self._tables: dict[str, TableWriter] = {}
        self._resumed: TableWriter | None = None
        self._summary = events.Summary({})
        self._latest: Checkpoint | None = None  # not written yet
        self._saved, self._cost = -float("inf"), 0.0

    def on_the_way(self, place: Text) -> None:
        """Show where a computation without a new result is: the place, the time so far, and the limit on it."""
        passed = self.monitor.passed
        most, clock = self._options.budget, ""
        if not most and self.monitor.awaits_result:
            most, clock = self._options.patience, " of processor time"
        limit = f", ends after {duration(most)}{clock}" if most and passed > SOON * most else ""
        text = f"{self._in_units(place)} ({duration(passed)}{limit})"
        self.reporter.on_the_way(text, known=self.monitor.knows_result)

    def _in_units(self, text: Text) -> str:
        return in_units(text, self.case.scales)

    def carry_out(self, computation: events.Events) -> Outcome:
        """Carry out a computation to its end; a failure or an interrupt is an outcome, too."""
        jit.LOG.addFilter(self._compiling)
        try:
            outcome = self._follow(computation)
        except RunFailure as failure:
            if not self._begun:
                raise
            outcome = Outcome("failed", failure.reason, failure.sentence)
        except KeyboardInterrupt as interrupt:
            by = f"stopped by {interrupt}" if str(interrupt) else "stopped at once"
            how = Message(" at t = {}", TIME(self._t, ".6g")) if self.resumable else KEPT
            outcome = Outcome("interrupted", "interrupted", by + how)
        finally:
            jit.LOG.removeFilter(self._compiling)
        text = self._in_units(outcome.message)
        outcome = replace(outcome, message=text)
        if not self._begun:
            self.reporter.note(f"nothing to do: {text}" if outcome.status == "finished" else text)
            return outcome
        outcome = self._finish(outcome)
        if outcome.status == "finished" and outcome.reason != BranchEnd.reason:  # else the answer says it
            self.reporter.finish(text)
        return outcome

    def _compiling(self, record: logging.LogRecord) -> bool:
        """Show the first message of the compiler."""
        if not self._compiled:
            self.reporter.note(record.getMessage())
        self._compiled = True
        return True

    def _follow(self, computation: events.Events) -> Outcome:
        """Carry out all events of a computation.

        An exception meanwhile is raised inside the computation, which may then yield last events such as its `Summary`.
        """
        go_on = partial(next, computation)
        try:
            while True:
                event = go_on()
                try:
                    self.take(event)
                    go_on = partial(next, computation)
                except BaseException as error:
                    go_on = partial(computation.throw, error)
        except StopIteration as end:
            return end.value
        except EnvironmentFailure:
            self.monitor.check_signals()  # Ctrl-C ends the compiler, too
            raise

    def take(self, event: events.Event) -> None:
        """Carry out an event; WriteFailure where a file cannot be written."""
        match event:
            case events.Begin():
                self._begin(event)
            case events.Note(text):
                self.reporter.note(self._in_units(text))
            case events.Progress(done, text, count, state):
                if state is not None:
                    self._t = done
                    self._keep(state)
                self.reporter.update(done, self._in_units(text), count)
            case events.Summary():
                self._summary = event
            case events.Table():
                self._open(event)
            case events.Row(table, values):
                self.monitor.has_result()
                with self._writing():
                    self._tables[table].row(values)
            case events.Frame(fields):
                with self._writing():
                    self._fields.write(fields)

    def _begin(self, event: events.Begin) -> None:
        with self._writing():
            write_yaml(self.folder / "case.yaml", self.case.resolved())
            self._write_record(None)
            if self.old is None:
                self._fields = FieldsWriter(self.folder)
        self._begun = True
        title = self.case.name or self._options.title or self.case.slug
        self.reporter.start(title, self._in_units(event.goal), event.total)
        for note in self._notes:
            self.reporter.note(note)

    def _open(self, table: events.Table) -> None:
        path, rows, columns = self.folder / f"{table.name}.csv", table.rows, table.columns
        declared = self._declared[table.name]
        with self._writing():
            if table.resumed and self.old is not None:
                rows = (old := read_table(path)).records()[: self.old.rows]
                # If a folder of an older version is resumed, the question's own columns that it lacks are left out.
                columns = [name for name in columns if name in old or declared.own.get(name) is None]
                self._fields = FieldsWriter(self.folder, self.old.frames)
            writer = TableWriter(path, columns, rows, declared=declared, ascending=table.ascending)
            self._tables[table.name] = writer
            self._resumed = writer if table.resumed else self._resumed

    def _keep(self, state: events.Resumable) -> None:
        """Keep a state in memory, and write it if a checkpoint is due."""
        rows = self._resumed.count if self._resumed is not None else 0
        self._latest = state.checkpoint(rows, self._fields.frames, self.monitor.wall_time)
        passed = time.monotonic() - self._saved
        if passed >= state.every or (state.convenient and passed > CHEAP * self._cost):
            self._save()

    def _save(self) -> None:
        if self._latest is not None:
            begin = time.monotonic()
            with self._writing():
                self._latest.save(self.folder)
            self._latest, self._saved = None, time.monotonic()
            self._cost = self._saved - begin

    def _finish(self, outcome: Outcome) -> Outcome:
        """Write the last checkpoint and run.json; returns the outcome, a failure if a file cannot be written."""
        try:
            self._save()
        except WriteFailure as failure:
            outcome = Outcome("failed", failure.reason, str(failure))
        with self._writing():
            self._write_record(outcome)
        return outcome

    def _write_record(self, outcome: Outcome | None) -> None:
        """Write run.json; of a computation that goes on, `outcome` is None."""
        case, summary, wall = self.case, self._summary, self.monitor.wall_time
        ended = outcome or Outcome("running", "", "")
        entries: dict[Entry[Any], Any] = {KIND: case.kind, STATUS: ended.status, REASON: ended.reason}
        entries |= {MESSAGE: ended.message, **self._about, SECONDS: wall, PEAK_MEMORY: peak_memory()}
        entries |= {KEY: key_of(case.kind, identity_of(case))}
        record = Record.of(entries) | sources_of(case)
        if outcome is not None:
            said = Record.of({**summary.entries, WARNINGS: summary.warnings})
            record |= entries_in_units({**said}, case.scales)
        record |= units_of(case)
        if summary.phases:
            phases = {**summary.phases, "other": wall - sum(summary.phases.values())}
            record = record.with_entries({PHASES: phases})
        record.write(self.folder)

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Context that writes files, in which an OSError becomes a WriteFailure."""
        try:
            yield
        except OSError as error:
            message = f"{error.filename or self.folder} cannot be written ({error.strerror or error})"
            resumes = self.resumable and (self.folder / CHECKPOINT).is_file()
            again = "--resume" if resumes else "the same command with --overwrite"
            raise WriteFailure(message, advice=f"{again} once it can be") from error
