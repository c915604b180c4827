"""A worker of a sweep: computes cases in child processes.

Short cases, and neighbouring curves, are computed one after another by one child process (`case_worker`); if it dies or
has become large, a new one computes the rest, which locks the folder of the case meanwhile.
"""

from __future__ import annotations

import contextlib
import time
from dataclasses import dataclass, field
from importlib import import_module
from itertools import chain
from pathlib import Path
from typing import Any

from pairsim.commands import Command
from pairsim.commands.command import Value
from pairsim.config.yaml_file import yaml_text
from pairsim.results.folders import read_record
from pairsim.results.output import CHECKPOINT, plain, write_text
from pairsim.runtime.child_process import DISK, GRACE, Child, module_command
from pairsim.runtime.locks import is_locked
from pairsim.sweeps.case import SweepCase
from pairsim.sweeps.verdict import judge

STDERR = "stderr.txt"
CASES = "cases"  # folder of the case files


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
    warnings: list[str] = field(default_factory=list)


class CaseWorker:
    """Computes one case after another.

    Args:
        command: The command of the sweep.
        directory: Folder of the sweep.
        timeout: Largest wall time of a case [s].
    """

    def __init__(self, command: Command[Any], directory: Path, timeout: float | None = None) -> None:
        self.command, self.directory, self.timeout = command, directory, timeout
        self._unit: list[SweepCase] = []
        self._child: Child | None = None
        self._first = ""  # folder of the child's first case
        self._left = 0  # number of cases that the child has yet to finish, including the current one
        self._stopped, self._resumed = "", False
        self._begun = 0.0

    def take(self, unit: list[SweepCase]) -> None:
        """Add cases, to be computed one after another."""
        self._unit += unit

    def stop(self) -> None:
        """Interrupt the running case; the remaining cases are returned as pending."""
        self._stopped = "interrupted"
        if self._child is not None:
            self._child.ask_to_stop()

    def close(self) -> None:
        """Kill the running case, if an exception ends the sweep."""
        if self._child is not None:
            self._child.kill()

    def poll(self) -> Result | None:
        """Poll the child process, start the next case if it is due, and return the result of an ended case or None."""
        if not self._unit:
            return None
        case = self._unit[0]
        try:
            return self._begin(case) if self._child is None else self._watch(case, self._child)
        except OSError as error:
            return self._end(case, "failed", "disk_full" if error.errno in DISK else "error", str(error))

    def _begin(self, case: SweepCase) -> Result | None:
        if self._stopped:
            return self._end(case, "pending", "interrupted", "not started")
        if is_locked(self._folder(case)):
            return None
        if self._finished(case):  # by another sweep in the same folder
            record = self._record(case)
            return self._end(case, "finished", record["reason"], record["message"])
        self._start(case, resume=case.resume)
        return None

    def _watch(self, case: SweepCase, child: Child) -> Result | None:
        code, record = child.poll(), self._record(case) if self._left > 1 else {}
        if record.get("status") in ("finished", "failed"):  # the child is computing the next case
            self._left -= 1
            return self._end(case, *judge(0 if record["status"] == "finished" else 3, record, "", "", 0.0))
        if code is None:
            if self.timeout is not None and self._seconds > self.timeout and not self._stopped:
                self._stopped = "timeout"
                child.ask_to_stop(min(GRACE, self.timeout))
            return None
        self._child = None
        record = self._record(case)
        if self._finished(case):  # even if the child failed afterwards
            code = 0
        elif not record and case.folder != self._first and not self._stopped and code == 0:  # the child has grown large
            self._start(case, resume=case.resume)
            return None
        elif code == 2 and self._resumed and not self._stopped:  # a checkpoint that cannot be used
            self._start(case, resume=False)
            return None
        elif self._stopped == "timeout" and self.timeout is not None and self._seconds < self.timeout:
            self._stopped = ""  # the previous case timed out, but finished nevertheless
            self._start(case, resume=case.resume)
            return None
        status, reason, message = judge(code, record, child.stderr, self._stopped, self._seconds)
        if status != "finished" and child.stderr.strip():
            with contextlib.suppress(OSError):
                write_text(self._folder(case) / STDERR, child.stderr)
        if self._stopped == "timeout":
            self._stopped = ""
        return self._end(case, status, reason, message)

    @property
    def _seconds(self) -> float:
        """Wall time of the current case [s]."""
        return time.monotonic() - self._begun if self._begun else 0.0

    def _folder(self, case: SweepCase) -> Path:
        return self.directory / case.folder

    def _case_file(self, case: SweepCase) -> Path:
        return self.directory / CASES / f"{case.folder}.yaml"

    def _record(self, case: SweepCase) -> dict[str, Any]:
        return read_record(self._folder(case))

    def _finished(self, case: SweepCase) -> bool:
        return case.finished_in(self._folder(case), self.command)

    def _start(self, case: SweepCase, resume: bool) -> None:
        """Start a child process for a case and the following cases of the unit that are neither locked nor finished."""
        self._resumed = resume and self._has_checkpoint(case)
        together = [case]
        for other in () if self._resumed else self._unit[1:]:
            if is_locked(self._folder(other)) or self._finished(other):
                break
            if other.resume and self._has_checkpoint(other):
                break
            together.append(other)
        (self.directory / CASES).mkdir(exist_ok=True)
        for each in together:
            self._folder(each).mkdir(exist_ok=True)
            for name in [STDERR] if self._resumed else [STDERR, CHECKPOINT, "run.json"]:
                (self._folder(each) / name).unlink(missing_ok=True)
            write_text(self._case_file(each), yaml_text(plain(each.resolved)))
        name, paths = self.command.name, [(str(self._case_file(each)), str(self._folder(each))) for each in together]
        (case_file, folder), *further = paths
        if further:
            arguments = ["pairsim.sweeps.case_worker", name, *chain(*paths)]
        elif self._resumed:
            arguments = ["pairsim", name, "--resume", folder, "-q"]
        else:
            arguments = ["pairsim", name, case_file, "-o", folder, "--overwrite", "-q"]
        self._child = Child(module_command(*arguments))
        self._first, self._left, self._begun = case.folder, len(together), time.monotonic()
        import_module("pairsim.results.tables")  # pandas, which takes half a second: while the child computes

    def _has_checkpoint(self, case: SweepCase) -> bool:
        return self.command.resumable and (self._folder(case) / CHECKPOINT).is_file()

    def _end(self, case: SweepCase, status: str, reason: str, message: str) -> Result:
        seconds, values, warnings = self._seconds, {}, ()
        if status != "pending":
            values, warnings = self.command.values(self._folder(case)), self._record(case).get("warnings", ())
        if status in ("failed", "timeout"):
            values["wall_time"] = seconds  # run.json stops before the failure
        self._begun = time.monotonic() if self._child is not None else 0.0
        self._unit.pop(0)
        return Result(case.folder, status, reason, message, seconds, values, list(warnings))
