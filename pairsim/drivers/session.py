"""The session of run, curve and critical: a locked folder, run.json, signals, and failures of writing.

A driver opens a session, announces its goal, and carries out its work in it, which returns an outcome.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pairsim.config.case import SceneCase
from pairsim.drivers.outcome import Outcome, Record
from pairsim.drivers.progress import Reporter
from pairsim.results.checkpoint import Checkpoint
from pairsim.results.output import RunFolder, write_table
from pairsim.runtime.child_process import DISK
from pairsim.runtime.errors import RunFailure, WriteFailure
from pairsim.runtime.locks import sole_writer
from pairsim.runtime.signals import Signals, Stopped


@dataclass(frozen=True)
class Options:
    """Options that run, curve and critical share.

    Attributes:
        overwrite: Whether existing results may be replaced.
        reporter: Shows progress.
        command: The command line, for run.json and for the lock.
        notes: What the user should know of the case beforehand.
        files: Names of the files that commands write; --overwrite removes them.
        signals: Whether SIGINT and SIGTERM end the computation in order; if not, the handlers are left unchanged.
    """

    overwrite: bool
    reporter: Reporter
    command: str
    notes: Sequence[str]
    files: Sequence[str]
    signals: bool = False


class Session:
    """A command that writes to its locked folder; made by `open_session`.

    Attributes:
        reporter: That of the options.
        folder: The folder for the results.
        checkpoint: The checkpoint to resume from; None to start at the beginning.
        record: Writes run.json.
        stopped_at_once: Whether a second Ctrl-C, or a KeyboardInterrupt without handlers, has interrupted the
            computation at an arbitrary point, in the middle of a step.
    """

    def __init__(
        self,
        case: SceneCase,
        options: Options,
        folder: RunFolder,
        checkpoint: Checkpoint | None,
    ) -> None:
        self.reporter, self.folder, self.checkpoint = options.reporter, folder, checkpoint
        wall = checkpoint.wall if checkpoint else 0.0
        self.record = Record(folder, case.kind, options.command, wall, case.scales)
        self.stopped_at_once = False
        self._title, self._notes = case.name or case.slug, options.notes

    def announce(self, goal: str, total: float, notes: Iterable[str] = ()) -> None:
        """Show title and goal of the command, and notes for the user.

        Args:
            goal: The goal, such as "to t = 2".
            total: The same as a number, for the progress bar.
            notes: Further notes.
        """
        self.reporter.start(self._title, goal, total)
        for note in (*self._notes, *notes):
            self.reporter.note(note)

    def carry_out(self, work: Callable[[], Outcome], kept: Callable[[], str]) -> Outcome:
        """Call a function, and turn failures and interrupts into an outcome.

        Args:
            work: The computation.
            kept: Returns the end of the message of an interrupt, after the name of the signal: what was kept.

        Returns:
            The outcome of `work`, or one for the `RunFailure` or signal that ended it.
        """
        try:
            return work()
        except RunFailure as failure:
            return Outcome("failed", failure.reason, str(failure))
        except Stopped as stopped:
            return Outcome("interrupted", "interrupted", f"{stopped}{kept()}")
        except KeyboardInterrupt:
            self.stopped_at_once = True
            return Outcome("interrupted", "interrupted", f"stopped at once{kept()}")

    def write[T](
        self, write: Callable[[], T], *, retry: str = "the same command with --overwrite", t: float = 0.0, step: int = 0
    ) -> T:
        """Call a function that writes files.

        Args:
            write: The function.
            retry: The command to give once files can be written again, for the message of a failure.
            t: Time reached [D_c/U_av], for the message of a failure.
            step: Number of accepted steps, for the message of a failure.

        Returns:
            The return value of `write`.

        Raises:
            WriteFailure: `write` raised an OSError.
        """
        try:
            return write()
        except OSError as error:
            raise write_failure(error, self.folder.path, retry, t, step) from error

    def write_table(self, name: str, columns: Sequence[str], rows: Sequence[Mapping[str, Any] | str]) -> None:
        """Write a CSV table as a whole, replacing the file.

        Args:
            name: Name of the file in the folder.
            columns: Names of the columns.
            rows: Values by column, or the text of `table_line`.

        Raises:
            WriteFailure: It cannot be written.
        """
        self.write(lambda: write_table(self.folder.file(name), columns, rows))


def write_failure(error: OSError, directory: Path, retry: str, t: float = 0.0, step: int = 0) -> WriteFailure:
    """The failure for an error in writing to a folder, with advice for its cause.

    Args:
        error: The error.
        directory: The folder.
        retry: The command to give once files can be written again.
        t: Time reached [D_c/U_av].
        step: Number of accepted steps.
    """
    if not directory.is_dir():
        message = f"the folder {directory} was removed while the command was at work"
        return WriteFailure(message, t=t, step=step, advice="the case again, with a folder that stays")
    remedy = "freeing disk space" if error.errno in DISK else f"making {directory} writable"
    return WriteFailure(str(error), t=t, step=step, advice=f"{remedy}, then {retry}")


@contextmanager
def open_session(
    case: SceneCase, directory: Path, options: Options, find_checkpoint: Callable[[], Checkpoint | None] | None = None
) -> Iterator[Session]:
    """Open a session in a folder, which stays locked against other commands until the session ends.

    The folder is created, or reopened if there is a checkpoint to resume from.

    Args:
        case: The validated case.
        directory: Folder for the results.
        options: Overwriting, progress and signals.
        find_checkpoint: Returns the checkpoint to resume from. None: do not resume.

    Raises:
        InputError: The folder exists and may not be overwritten, or another command is writing to it; also errors
            of `find_checkpoint`.
        WriteFailure: The first files of the folder cannot be written.
    """
    # The handlers stay until the last file is written: a signal that comes later changes nothing.
    signals = Signals(impatient=True, installed=options.signals)
    with signals, sole_writer(directory, options.command):
        checkpoint = find_checkpoint() if find_checkpoint is not None else None
        try:
            if checkpoint is not None:
                folder = RunFolder.reopen(directory, options.files)
            else:
                folder = RunFolder.create(directory, options.overwrite, options.files)
                folder.write_yaml("case.yaml", case.resolved())
        except OSError as error:
            raise write_failure(error, directory, "the same command") from error
        yield Session(case, options, folder, checkpoint)
