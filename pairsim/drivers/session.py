"""What run, curve and critical share: a folder under a lock, its record, signals, and writing that all processes share.

A driver opens a session, announces what it does, carries its work out under it, and gets the outcome.
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
from pairsim.runtime.collective import collectively
from pairsim.runtime.errors import RunFailure, WriteFailure
from pairsim.runtime.fenicsx import MPI
from pairsim.runtime.locks import sole_writer
from pairsim.runtime.signals import Signals


@dataclass(frozen=True)
class Options:
    """How a command is carried out, whatever it computes.

    Attributes:
        comm: Communicator of the case; every process calls the driver.
        overwrite: Replace earlier results.
        reporter: Shows progress (quiet on all processes but the first).
        command: The command line, for the record and the lock.
        signals: Whether SIGINT and SIGTERM end the work in order. Without, they do what they did before.
    """

    comm: MPI.Comm
    overwrite: bool
    reporter: Reporter
    command: str
    signals: bool = False


class Session:
    """A command at work in its folder; made by `open_session`.

    Attributes:
        comm, reporter: Those of the options.
        folder: The folder, None on all processes but the first.
        checkpoint: What the command goes on from, the same on every process; None: from the beginning.
        record: run.json.
        stopped_at_once: Whether a signal has ended the work here and now. The other processes may be anywhere:
            nothing is done collectively any more.
    """

    def __init__(
        self, case: SceneCase, options: Options, folder: RunFolder | None, checkpoint: Checkpoint | None
    ) -> None:
        self.comm, self.reporter = options.comm, options.reporter
        self.folder, self.checkpoint = folder, checkpoint
        wall = checkpoint.wall if checkpoint else 0.0
        self.record = Record(folder, case.kind, options.command, self.comm.size, wall, case.scales)
        self.stopped_at_once = False
        self._signals = options.signals
        self._title = case.name or case.slug

    def announce(self, goal: str, total: float, notes: Iterable[str] = ()) -> None:
        """Show what is to be reached, in words and as a number, and what the user should know of it."""
        self.reporter.start(self._title, goal, total)
        for note in notes:
            self.reporter.note(note)

    def carry_out(self, work: Callable[[Signals], Outcome], interrupted: str) -> Outcome:
        """Do work under signals.

        Args:
            work: What to do; it may look at the signals.
            interrupted: Message of the outcome where a signal ends the work at once.

        Returns:
            The work's outcome, or that of a typed failure or a signal which ended it.
        """
        try:
            with Signals(impatient=True, installed=self._signals) as signals:
                return work(signals)
        except RunFailure as failure:
            return Outcome("failed", failure.reason, str(failure))
        except KeyboardInterrupt:
            self.stopped_at_once = True
            return Outcome("interrupted", "interrupted", interrupted)

    def write[T](
        self, write: Callable[[], T], *, retry: str = "the same command with --overwrite", t: float = 0.0, step: int = 0
    ) -> T | None:
        """Write on the first process; what it returns, None on the others.

        Args:
            write: What to do there.
            retry: What to call once there is room on the disk.
            t, step: How far the work is, for the message of a failure.

        Raises:
            WriteFailure: It could not, on every process.
        """
        try:
            return collectively(self.comm, write)
        except OSError as error:
            advice = f"more room on the disk, then {retry}"
            raise WriteFailure(str(error), t=t, step=step, advice=advice) from error

    def write_table(self, name: str, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> None:
        """Write a table anew.

        Raises:
            WriteFailure: It could not be written, on every process.
        """

        def write() -> None:
            assert self.folder is not None
            write_table(self.folder.file(name), columns, rows)

        self.write(write)


@contextmanager
def open_session(
    case: SceneCase, directory: Path, options: Options, find_checkpoint: Callable[[], Checkpoint | None] | None = None
) -> Iterator[Session]:
    """Work in a folder that is made, or reopened where there is a checkpoint; no other command may meanwhile.

    Args:
        case: The validated case.
        directory: Where the results go.
        options: How the command is carried out.
        find_checkpoint: Looks for what to go on from; called by the first process. None: begin afresh.

    Raises:
        InputError: The folder exists and may not be replaced, another command is at work there, or what
            `find_checkpoint` raises.
        WriteFailure: The folder's first files cannot be written.
    """
    comm = options.comm
    with sole_writer(comm, directory, options.command):
        checkpoint = comm.bcast(collectively(comm, find_checkpoint)) if find_checkpoint is not None else None

        def make() -> RunFolder:
            if checkpoint is not None:
                return RunFolder.reopen(directory)
            folder = RunFolder.create(directory, options.overwrite)
            folder.write_yaml("case.yaml", case.resolved())
            return folder

        try:
            folder = collectively(comm, make)
        except OSError as error:
            raise WriteFailure(str(error), advice="more room on the disk, then the same command") from error
        yield Session(case, options, folder, checkpoint)
