"""Carry out the computation of a command: all that it yields (`computing/events.py`) is written, shown and kept here.

A session has a locked folder, run.json, tables, fields, a checkpoint, progress and signals. A failure of any
of these is an outcome.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pairsim.cases.case import SceneCase
from pairsim.cases.identity import identity_of, key_of, sources_of
from pairsim.computing import Question, events, own_files
from pairsim.computing.events import Outcome
from pairsim.computing.progress import Reporter
from pairsim.computing.record import Record
from pairsim.fem.compilation import jit
from pairsim.results.checkpoint import Checkpoint, check_same, load
from pairsim.results.folder import CHECKPOINT, RunFolder, files_of, kind_of, plain, read_record
from pairsim.results.table_files import TableWriter, read_table
from pairsim.results.xdmf import FieldsWriter
from pairsim.runtime.errors import EnvironmentFailure, InputError, RunFailure, WriteFailure
from pairsim.runtime.locks import sole_writer
from pairsim.runtime.monitor import Monitor
from pairsim.runtime.signals import Signals, Stopped
from pairsim.runtime.text import duration

SOON = 0.1  # part of the largest wall time after which it is shown where a computation has no result yet; chosen
CHEAP = 50.0  # least time between checkpoints at convenient moments, over the wall time of writing one; chosen


@dataclass(frozen=True)
class Options:
    """How a case is computed, whatever the command.

    Attributes:
        overwrite: Whether existing results may be replaced.
        reporter: Shows progress.
        command: The command line, for run.json and for the lock.
        signals: The signals that end the computation in order, caught by the caller.
        budget: Largest wall time of the computation [s]; None for no limit.
        patience: Largest wall time up to the first row [s], if there is no budget; None for no limit.
        title: What progress is headed with; the name or the parameters of the case by default.
    """

    overwrite: bool
    reporter: Reporter
    command: str
    signals: Signals | None = None
    budget: float | None = None
    patience: float | None = None
    title: str = ""


def carry_out[C: SceneCase](
    question: Question[C], case: C, directory: Path, options: Options, *, resume: bool = False, **more: Any
) -> Outcome:
    """Compute a case and write the results to a folder, which is locked against other commands meanwhile.

    Args:
        question: What is computed of it.
        case: The validated case.
        directory: Folder for the results.
        options: Overwriting, progress, signals and budget.
        resume: Continue from the checkpoint in the folder. Without a checkpoint, and with at most one row in the
            table, the computation starts anew.
        more: Keywords of the computation.

    Returns:
        How the computation ended. Results computed before a failure are in the folder, too.

    Raises:
        InputError: The folder exists and may not be overwritten, cannot be resumed, belongs to another command, or
            another command is writing to it.
        WriteFailure: case.yaml or run.json cannot be written.
    """
    notes = [*case.notes, *question.estimate(case).notes]
    files = own_files() if options.overwrite else files_of(question.tables, question.captions)
    with sole_writer(directory, options.command):
        earlier = _earlier(case, directory, f"{question.tables[0]}.csv") if resume else None
        if earlier is not None:
            folder = RunFolder(directory, files)
            more["earlier"] = earlier
        else:
            folder = RunFolder.create(directory, options.overwrite or resume, files)
            notes += ["no checkpoint: starting at t = 0"] if resume else []
        session = Session(case, folder, options, notes, earlier, question.resumable)
        with closing(question.solve(case, monitor=session.monitor, **more)) as computation:
            return session.carry_out(computation)


def _earlier(case: SceneCase, directory: Path, table: str) -> events.Earlier | None:
    """What a folder holds of a computation to be resumed; None if it must start anew.

    Raises:
        InputError: There are rows without a checkpoint, or the checkpoint is damaged or belongs to another problem.
    """
    found, path = load(directory), directory / table
    if found is not None:
        check_same(found.case, plain(case.resolved() | sources_of(case)), str(directory / CHECKPOINT))
        return events.Earlier(found, read_record(directory).get("status") == "finished")
    files = [file.name for file in directory.iterdir() if not file.name.startswith(".") and file.name != "case.yaml"]
    if files and kind_of(directory) != case.kind:
        allowed = f"must be the folder of a {case.kind}, but holds results of another command"
        raise InputError(str(directory), "--resume", None, allowed)
    if path.exists() and len(next(iter(read_table(path).values()))) > 1:
        allowed = f"must have a {CHECKPOINT}, since {table} has rows; run the case again with --overwrite"
        raise InputError(str(directory), "--resume", None, allowed)
    return None


class Session:
    """Carries out the events of a computation in an open folder.

    Args:
        case: The case.
        folder: The folder for the results.
        options: Overwriting, progress, signals and budget.
        notes: What the user is told at the beginning.
        earlier: What is resumed, None to start at the beginning.
        resumable: Whether the computation can be resumed once it has ended.

    Attributes:
        monitor: Ends the computation, and hears where it is.
    """

    def __init__(
        self,
        case: SceneCase,
        folder: RunFolder,
        options: Options,
        notes: Sequence[str],
        earlier: events.Earlier | None,
        resumable: bool,
    ) -> None:
        self.case, self.folder, self.reporter = case, folder, options.reporter
        self.old = earlier.checkpoint if earlier is not None else None
        before = self.old.wall if self.old else 0.0
        about = {"key": key_of(case.kind, identity_of(case)), **sources_of(case)}
        self.record = Record(folder, case.kind, options.command, before, case.scales, about)
        self.resumable, self._complete = resumable, earlier is not None and earlier.finished
        self._begun, self._start, self._options = False, time.monotonic(), options
        self.monitor = Monitor(
            options.signals,
            budget=options.budget,
            patience=options.patience if options.budget is None else None,
            listener=self.on_the_way,
        )
        self._notes = notes
        self._t = self.old.state.history.t[0] if self.old else 0.0
        self._tables: dict[str, TableWriter] = {}
        self._at_end: Callable[[], Iterable[events.Event]] = tuple
        self._summary = events.Summary({})
        self._stopped_at_once = False
        self._latest: Checkpoint | None = None  # not written yet
        self._saved, self._cost = -float("inf"), 0.0

    def on_the_way(self, place: str) -> None:
        """Show where a computation is that has no result yet, for how long, and how long that may go on."""
        passed, most = time.monotonic() - self._start, self._options.budget or self._options.patience
        limit = f", ends at {duration(most)}" if most and passed > SOON * most else ""
        self.reporter.on_the_way(f"{place} ({duration(passed)}{limit})")

    def carry_out(self, computation: events.Events) -> Outcome:
        """Carry out a computation to its end; see the function."""
        if self.old is None:
            with self._writing():
                self._begin_files()
                self._fields = FieldsWriter(self.folder.path)
        jit.LOG.addHandler(compiling := _FirstMessage(self.reporter.note))
        try:
            outcome = self._follow(computation)
        finally:
            jit.LOG.removeHandler(compiling)
        nothing = self.old is not None and not self._tables and outcome.status == "finished"
        try:
            outcome = self._finish(outcome, recorded=nothing and self._complete)
        finally:
            if self._begun:
                self.reporter.finish(f"nothing to do: {outcome.message}" if nothing else outcome.message)
        return outcome

    def _follow(self, computation: events.Events) -> Outcome:
        """Carry out all events; failures and interrupts are outcomes, too."""
        try:
            while True:
                self.take(next(computation))
        except StopIteration as end:
            return end.value
        except RunFailure as failure:
            if not self._begun:
                raise
            if isinstance(failure, EnvironmentFailure):
                try:  # Ctrl-C ends the compiler, too
                    self.monitor.check_signals()
                except Stopped as stopped:
                    return self._interrupted(stopped)
            return Outcome("failed", failure.reason, str(failure))
        except KeyboardInterrupt as interrupt:
            return self._interrupted(interrupt)

    def _interrupted(self, interrupt: KeyboardInterrupt) -> Outcome:
        kept = "; the results written so far are kept"
        if self.resumable:
            kept = f" at t = {self._t:g}; continue with pairsim {self.case.kind} --resume"
        self._stopped_at_once = not isinstance(interrupt, Stopped)
        return Outcome("interrupted", "interrupted", f"{str(interrupt) or 'stopped at once'}{kept}")

    def take(self, event: events.Event) -> None:
        """Carry out an event.

        Raises:
            InputError: The file of an appended table does not fit the checkpoint.
            WriteFailure: A file cannot be written.
        """
        match event:
            case events.Begin():
                self._begun = True
                self.reporter.start(self.case.name or self._options.title or self.case.slug, event.goal, event.total)
                for note in self._notes:
                    self.reporter.note(note)
            case events.Note(text):
                self.reporter.note(text)
            case events.Progress(done, text, count):
                if self.resumable:
                    self._t = done
                self.reporter.update(done, text, count)
            case events.Summary():
                self._summary = event
            case events.AtEnd(left):
                self._at_end = left
            case _:
                with self._writing():
                    self._write(event)

    def _write(self, event: events.Event) -> None:
        match event:
            case events.Table():
                self._open(event)
            case events.Row(table, values):
                self.monitor.has_result()
                self._tables[table].row(values)
            case events.Frame(fields):
                if not callable(fields):
                    self._fields.write(fields)
                elif not self._stopped_at_once:  # in the middle of a step
                    self._fields.write(fields())
            case events.Resumable():
                self._keep(event)

    def _open(self, table: events.Table) -> None:
        path = self.folder.file(f"{table.name}.csv")
        old = self.old if table.appended else None
        rows = _first_rows(path, table.columns, old.rows) if old is not None else table.rows
        flags = {"appended": table.appended, "ascending": table.ascending}
        self._tables[table.name] = TableWriter(path, table.columns, rows, **flags)
        if old is not None:
            self._fields = FieldsWriter(self.folder.path, old.frames)
            self._begin_files()

    def _begin_files(self) -> None:
        self.folder.write_yaml("case.yaml", self.case.resolved())
        self.record.write(None, {}, {})

    def _keep(self, event: events.Resumable) -> None:
        """Keep a state in memory, and write it if a checkpoint is due."""
        (table,) = (table for table in self._tables.values() if table.appended)
        self._latest = event.checkpoint(table.count, self._fields.frames, self.record.passed)
        passed = time.monotonic() - self._saved
        if passed >= event.every or (event.convenient and passed > CHEAP * self._cost):
            self._save()

    def _save(self) -> None:
        if self._latest is not None:
            begin = time.monotonic()
            self._latest.save(self.folder)
            self._latest, self._saved = None, time.monotonic()
            self._cost = self._saved - begin

    def _finish(self, outcome: Outcome, recorded: bool) -> Outcome:
        """Carry out the events of the end, write the last checkpoint, and run.json unless it is there.

        Returns:
            The outcome; a failure if a file cannot be written.

        Raises:
            WriteFailure: run.json cannot be written.
        """
        try:
            for event in self._at_end():
                self.take(event)
            with self._writing():
                self._save()
                for table in self._tables.values():
                    table.close()
        except WriteFailure as failure:
            outcome = Outcome("failed", failure.reason, str(failure))
        finally:
            if not recorded:
                with self._writing():
                    entries = {**self._summary.entries, "warnings": [*self._summary.warnings]}
                    self.record.write(outcome, entries, dict(self._summary.phases))
        return outcome

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Context that writes files.

        Raises:
            WriteFailure: An OSError was raised in it.
        """
        try:
            yield
        except OSError as error:
            message = f"{error.filename or self.folder.path} cannot be written ({error.strerror or error})"
            again = "--resume" if self.resumable else "the same command with --overwrite"
            raise WriteFailure(message, advice=f"{again} once it can be") from error


class _FirstMessage(logging.Handler):
    """Shows the first message of a log."""

    def __init__(self, show: Callable[[str], None]) -> None:
        super().__init__()
        self._show: Callable[[str], None] | None = show

    def emit(self, record: logging.LogRecord) -> None:
        show, self._show = self._show, None
        if show is not None:
            show(record.getMessage())


def _first_rows(path: Path, columns: Sequence[str], count: int) -> list[dict[str, float]]:
    """The rows of a table up to a checkpoint.

    Raises:
        InputError: It has fewer rows or other columns.
    """
    table = read_table(path)
    rows = [dict(zip(table, map(float, row), strict=True)) for row in zip(*table.values(), strict=True)]
    if len(rows) < count or list(table) != list(columns):
        allowed = f"must have at least {count} rows with the columns {','.join(columns)}, to fit the checkpoint"
        raise InputError(str(path), "", None, allowed)
    return rows[:count]
