"""A worker of a sweep: computes the cases that it is given, one after another, each in a child.

Neighbouring curves go to one child, which starts each from the one before; if it dies, another goes on with the rest.
The folder of a case stays locked until nobody writes there any more.
"""

from __future__ import annotations

import contextlib
import shutil
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from pairsim.results.folders import read_record
from pairsim.results.output import CHECKPOINT, plain, write_text
from pairsim.runtime.child_process import DISK, GRACE, Child, module_command
from pairsim.runtime.errors import InputError
from pairsim.runtime.locks import FolderLock, command_line
from pairsim.sweeps.commands import Checked, SweepCommand, Value
from pairsim.sweeps.grid import finished_in
from pairsim.sweeps.verdict import judge

TOLD = "stderr.txt"


def find_mpirun() -> str | None:
    """The mpirun of this Python's environment, or else the one on the path."""
    beside = Path(sys.executable).parent / "mpirun"
    return str(beside) if beside.exists() else shutil.which("mpirun")


@dataclass(frozen=True)
class Task:
    """A case to be computed.

    Attributes:
        folder: Its name.
        key: Hash of what it computes.
        directory: Its folder.
        case_file: Where its case file goes.
        checked: The validated case.
        resume: Whether a checkpoint may be used.
    """

    folder: str
    key: str
    directory: Path
    case_file: Path
    checked: Checked
    resume: bool = True


@dataclass(frozen=True)
class Result:
    """How a case ended.

    Attributes:
        folder: Its name.
        status: "finished", "failed", "timeout", or "pending" when it was interrupted and can go on.
        reason: Typed reason.
        message: For people.
        seconds: Wall time as the sweep saw it.
        values: What it gives to results.csv.
        warnings: What its run.json warns of.
    """

    folder: str
    status: str
    reason: str
    message: str
    seconds: float
    values: dict[str, Value] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()


class CaseWorker:
    """Computes one case after another.

    Args:
        command: The command of the sweep.
        ranks: MPI processes of each case.
        timeout: Allowed wall time of a case in seconds.
    """

    def __init__(self, command: SweepCommand[Any], ranks: int = 1, timeout: float | None = None) -> None:
        self.command, self.ranks, self.timeout = command, ranks, timeout
        self._unit: list[Task] = []
        self._child: Child | None = None
        self._left = 0  # cases of the unit, the present one included, that the child will compute
        self._locks: dict[str, FolderLock] = {}
        self._stopped, self._resumed = "", False
        self._begun = 0.0

    def take(self, unit: list[Task]) -> None:
        """Accept cases that are to be computed one after another."""
        self._unit += unit

    def stop(self) -> None:
        """Interrupt the running case; the ones behind it are handed back as pending."""
        self._stopped = "interrupted"
        if self._child is not None:
            self._child.ask_to_stop()

    def close(self) -> None:
        """End what is still running, for a sweep that an exception ends."""
        if self._child is not None:
            self._child.kill()
        for lock in self._locks.values():
            lock.release()

    def poll(self) -> Result | None:
        """Go on; the result of a case that has ended, None as long as none has."""
        if not self._unit:
            return None
        task = self._unit[0]
        try:
            return self._begin(task) if self._child is None else self._watch(task, self._child)
        except OSError as error:
            return self._end(task, "failed", "disk_full" if error.errno in DISK else "error", str(error))

    def _begin(self, task: Task) -> Result | None:
        if self._stopped:
            return self._end(task, "pending", "interrupted", "not started")
        if not self._locked(task):
            return None
        if finished_in(task.directory, self.command, task.key):  # by a sweep that shares the folder
            told = read_record(task.directory)
            return self._end(task, "finished", told["reason"], told["message"])
        self._start(task, resume=task.resume)
        return None

    def _watch(self, task: Task, child: Child) -> Result | None:
        code, told = child.poll(), read_record(task.directory) if self._left > 1 else {}
        if told.get("status") in ("finished", "failed"):  # the child has gone on to the next case
            self._left -= 1
            return self._end(task, *judge(0 if told["status"] == "finished" else 3, told, "", "", 0.0))
        if code is None:
            if self.timeout is not None and self._seconds > self.timeout and not self._stopped:
                self._stopped = "timeout"
                child.ask_to_stop(min(GRACE, self.timeout))
            return None
        self._child = None
        told = read_record(task.directory)
        if finished_in(task.directory, self.command, task.key):  # whatever befell it after that
            code = 0
        elif code == 2 and self._resumed and not self._stopped:  # a checkpoint that cannot be used
            self._start(task, resume=False)
            return None
        elif self._stopped == "timeout" and self.timeout is not None and self._seconds < self.timeout:
            self._stopped = ""  # it was meant for the case before, which finished all the same
            self._start(task, resume=task.resume)
            return None
        status, reason, message = judge(code, told, child.stderr, self._stopped, self._seconds)
        if status != "finished" and child.stderr.strip():
            with contextlib.suppress(OSError):
                write_text(task.directory / TOLD, child.stderr)
        if self._stopped == "timeout":
            self._stopped = ""
        return self._end(task, status, reason, message)

    @property
    def _seconds(self) -> float:
        """How long the present case has been running."""
        return time.monotonic() - self._begun if self._begun else 0.0

    def _locked(self, task: Task) -> bool:
        """Hold a case's folder; False while another process still does."""
        if task.folder not in self._locks:
            try:
                self._locks[task.folder] = FolderLock(task.directory, command_line(), patience=0.0)
            except InputError:
                return False
        return True

    def _start(self, task: Task, resume: bool) -> None:
        """Start a child for the case, and for those behind it that can follow at once."""
        self._resumed = resume and self.command.resumable and (task.directory / CHECKPOINT).is_file()
        together = [task]
        for other in self._unit[1:]:
            if not self._locked(other) or finished_in(other.directory, self.command, other.key):
                break
            together.append(other)
        for each in together:
            stale = [TOLD] if self._resumed else [TOLD, CHECKPOINT, "run.json"]
            for name in stale:
                (each.directory / name).unlink(missing_ok=True)
            each.case_file.parent.mkdir(exist_ok=True)
            write_text(each.case_file, yaml.safe_dump(plain(each.checked.resolved), sort_keys=False))
        name = self.command.name
        if len(together) > 1:
            words = [
                "pairsim.sweeps.curve_worker",
                *(str(path) for each in together for path in (each.case_file, each.directory)),
            ]
        elif self._resumed:
            words = ["pairsim", name, "--resume", str(task.directory), "-q"]
        else:
            words = ["pairsim", name, str(task.case_file), "-o", str(task.directory), "--overwrite", "-q"]
        mpirun = [find_mpirun() or "mpirun", "-n", str(self.ranks)] if self.ranks > 1 else []
        locks = [self._locks[each.folder] for each in together]
        self._child = Child([*mpirun, *module_command(*words)], locks, ranks=bool(mpirun))
        self._left, self._begun = len(together), time.monotonic()

    def _end(self, task: Task, status: str, reason: str, message: str) -> Result:
        seconds = self._seconds
        values = self.command.values(task.directory) if status != "pending" else {}
        if status in ("failed", "timeout"):
            values["wall_time"] = seconds  # its own account stops where it did
        if task.folder in self._locks:
            self._locks.pop(task.folder).release()
        self._begun = time.monotonic() if self._child is not None else 0.0
        self._unit.pop(0)
        warnings = read_record(task.directory).get("warnings", ()) if status != "pending" else ()
        return Result(task.folder, status, reason, message, seconds, values, tuple(warnings))
