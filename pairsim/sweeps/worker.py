"""A worker of a sweep: computes cases in child processes.

Short cases, and neighbouring curves, are computed one after another by one child process (`case_worker`); if it dies or
has become large, a new one computes the rest. The folder of a case is locked until it has ended.
"""

from __future__ import annotations

import contextlib
import time
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

from pairsim.commands import Command
from pairsim.commands.command import Value
from pairsim.config.yaml_file import yaml_text
from pairsim.results.folders import read_record
from pairsim.results.output import CHECKPOINT, plain, write_text
from pairsim.runtime.child_process import DISK, GRACE, Child, module_command
from pairsim.runtime.errors import InputError
from pairsim.runtime.locks import FolderLock, command_line
from pairsim.sweeps.checked import Checked
from pairsim.sweeps.grid import finished_in
from pairsim.sweeps.verdict import judge

STDERR = "stderr.txt"


@dataclass(frozen=True)
class Task:
    """A case to be computed.

    Attributes:
        folder: Name of its folder.
        key: Hash that identifies the case.
        directory: Path of its folder.
        case_file: Path of the case file to be written.
        checked: The validated case.
        resume: Whether to resume from a checkpoint if there is one.
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
        timeout: Largest wall time of a case [s].
    """

    def __init__(self, command: Command[Any], timeout: float | None = None) -> None:
        self.command, self.timeout = command, timeout
        self._unit: list[Task] = []
        self._child: Child | None = None
        self._first = ""  # folder of the child's first case
        self._left = 0  # number of cases that the child has yet to finish, including the current one
        self._locks: dict[str, FolderLock] = {}
        self._stopped, self._resumed = "", False
        self._begun = 0.0

    def take(self, unit: list[Task]) -> None:
        """Add cases, to be computed one after another."""
        self._unit += unit

    def stop(self) -> None:
        """Interrupt the running case; the remaining cases are returned as pending."""
        self._stopped = "interrupted"
        if self._child is not None:
            self._child.ask_to_stop()

    def close(self) -> None:
        """Kill the running case and release all locks, if an exception ends the sweep."""
        if self._child is not None:
            self._child.kill()
        for lock in self._locks.values():
            lock.release()

    def poll(self) -> Result | None:
        """Poll the child process, start the next case if it is due, and return the result of an ended case or None."""
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
        if finished_in(task.directory, self.command, task.key):  # by another sweep in the same folder
            record = read_record(task.directory)
            return self._end(task, "finished", record["reason"], record["message"])
        self._start(task, resume=task.resume)
        return None

    def _watch(self, task: Task, child: Child) -> Result | None:
        code, record = child.poll(), read_record(task.directory) if self._left > 1 else {}
        if record.get("status") in ("finished", "failed"):  # the child is computing the next case
            self._left -= 1
            return self._end(task, *judge(0 if record["status"] == "finished" else 3, record, "", "", 0.0))
        if code is None:
            if self.timeout is not None and self._seconds > self.timeout and not self._stopped:
                self._stopped = "timeout"
                child.ask_to_stop(min(GRACE, self.timeout))
            return None
        self._child = None
        record = read_record(task.directory)
        if finished_in(task.directory, self.command, task.key):  # even if the child failed afterwards
            code = 0
        elif not record and task.folder != self._first and not self._stopped and code == 0:  # the child has grown large
            self._start(task, resume=task.resume)
            return None
        elif code == 2 and self._resumed and not self._stopped:  # a checkpoint that cannot be used
            self._start(task, resume=False)
            return None
        elif self._stopped == "timeout" and self.timeout is not None and self._seconds < self.timeout:
            self._stopped = ""  # the previous case timed out, but finished nevertheless
            self._start(task, resume=task.resume)
            return None
        status, reason, message = judge(code, record, child.stderr, self._stopped, self._seconds)
        if status != "finished" and child.stderr.strip():
            with contextlib.suppress(OSError):
                write_text(task.directory / STDERR, child.stderr)
        if self._stopped == "timeout":
            self._stopped = ""
        return self._end(task, status, reason, message)

    @property
    def _seconds(self) -> float:
        """Wall time of the current case [s]."""
        return time.monotonic() - self._begun if self._begun else 0.0

    def _locked(self, task: Task) -> bool:
        """Lock the folder of a case; returns False while another process holds the lock."""
        if task.folder not in self._locks:
            try:
                self._locks[task.folder] = FolderLock(task.directory, command_line(), patience=0.0)
            except InputError:
                return False
        return True

    def _start(self, task: Task, resume: bool) -> None:
        """Start a child process for a case and the following cases of the unit that are neither locked nor finished."""
        self._resumed = resume and self._has_checkpoint(task)
        together = [task]
        for other in () if self._resumed else self._unit[1:]:
            if not self._locked(other) or finished_in(other.directory, self.command, other.key):
                break
            if other.resume and self._has_checkpoint(other):
                break
            together.append(other)
        for each in together:
            stale = [STDERR] if self._resumed else [STDERR, CHECKPOINT, "run.json"]
            for name in stale:
                (each.directory / name).unlink(missing_ok=True)
            each.case_file.parent.mkdir(exist_ok=True)
            write_text(each.case_file, yaml_text(plain(each.checked.resolved)))
        name = self.command.name
        if len(together) > 1:
            arguments = [
                *("pairsim.sweeps.case_worker", name),
                *(str(path) for each in together for path in (each.case_file, each.directory)),
            ]
        elif self._resumed:
            arguments = ["pairsim", name, "--resume", str(task.directory), "-q"]
        else:
            arguments = ["pairsim", name, str(task.case_file), "-o", str(task.directory), "--overwrite", "-q"]
        locks = [self._locks[each.folder] for each in together]
        self._child = Child(module_command(*arguments), locks)
        self._first, self._left, self._begun = task.folder, len(together), time.monotonic()
        import_module("pairsim.results.tables")  # pandas, which takes half a second: while the child computes

    def _has_checkpoint(self, task: Task) -> bool:
        return self.command.resumable and (task.directory / CHECKPOINT).is_file()

    def _end(self, task: Task, status: str, reason: str, message: str) -> Result:
        seconds = self._seconds
        values = self.command.values(task.directory) if status != "pending" else {}
        if status in ("failed", "timeout"):
            values["wall_time"] = seconds  # run.json stops before the failure
        if task.folder in self._locks:
            self._locks.pop(task.folder).release()
        self._begun = time.monotonic() if self._child is not None else 0.0
        self._unit.pop(0)
        warnings = read_record(task.directory).get("warnings", ()) if status != "pending" else ()
        return Result(task.folder, status, reason, message, seconds, values, tuple(warnings))
