"""A case in a process of its own: started apart from MPI, watched, ended, and judged by what it leaves.

A process can end itself, be killed for its memory, or hang inside a library; one that is a child takes nobody along.
It is not a rank of the sweep's job (its environment has nothing of the launcher), leads its own process group, and dies
with its parent. Its folder stays locked until it is gone, so that nobody else writes there meanwhile.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import fcntl
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from pairsim.grid import finished_in
from pairsim.output import plain, write_text
from pairsim.sweep_commands import Checked, SweepCommand, Value, read_told

CHECKPOINT = "checkpoint.npz"
TOLD = "stderr.txt"
GRACE = 20.0  # seconds from a polite signal to SIGKILL: a step and a checkpoint must fit in
KEPT = 32_768  # bytes of a child's complaints that are kept
LAUNCHER = ("PMI_", "PMI2_", "PMIX_", "HYDRA_", "HYDI_", "MPI_", "PALS_", "PRTE_", "OMPI_", "SLURM_")
FULL = re.compile(r"No space left on device|Disk quota exceeded|\b[Ee]rrno (= )?(28|122)\b")
TOO_LARGE = re.compile(r"File too large|\b[Ee]rrno (= )?27\b")
DISK = (errno.EFBIG, errno.ENOSPC, errno.EDQUOT)
MEMORY = re.compile(r"MemoryError|std::bad_alloc|Cannot allocate memory|Out of memory")
_LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None
_PR_SET_PDEATHSIG = 1


def clean_environment() -> dict[str, str]:
    """The environment without what makes a process believe that it is a rank of the surrounding job."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(LAUNCHER) or name.startswith("OMPI_ALLOW")
    }
    return kept | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def _tie_to(parent: int) -> None:
    """In the child, before it becomes another program: die with the parent, and first when memory runs out."""
    if _LIBC is not None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != parent:  # it died before the line above
            os._exit(1)
    with contextlib.suppress(OSError), open("/proc/self/oom_score_adj", "w") as file:
        file.write("500")


def find_mpirun() -> str | None:
    """The mpirun of this Python's environment, or else the one on the path."""
    beside = Path(sys.executable).parent / "mpirun"
    return str(beside) if beside.exists() else shutil.which("mpirun")


def descendants(pid: int) -> list[int]:
    """Processes below a process, itself included, parents first."""
    children: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError, ValueError, IndexError):
            parent = int(stat.read_text().rpartition(")")[2].split()[1])
            children.setdefault(parent, []).append(int(stat.parent.name))
    found = [pid]
    for process in found:
        found += children.get(process, [])
    return found


class Child:
    """A running command.

    Args:
        argv: The command.
        keep: File descriptor that it inherits, if any.
        ranks: Whether it is an mpirun, whose processes must be signalled one by one: mpirun itself would kill them.
    """

    def __init__(self, argv: list[str], keep: int | None = None, ranks: bool = False) -> None:
        parent = os.getpid()
        self.ranks, self.began = ranks, time.monotonic()
        self._process = subprocess.Popen(
            argv,
            env=clean_environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            pass_fds=() if keep is None else (keep,),
            process_group=0,
            preexec_fn=lambda: _tie_to(parent),
        )
        assert self._process.stderr is not None
        os.set_blocking(self._process.stderr.fileno(), False)
        self._stderr = b""
        self._deadline: float | None = None

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def seconds(self) -> float:
        """Time since it was started."""
        return time.monotonic() - self.began

    @property
    def stderr(self) -> str:
        """The last of what it has written to stderr."""
        return self._stderr.decode(errors="replace")

    def poll(self) -> int | None:
        """Exit code, or None while it runs; SIGKILLs it when it has not followed a polite signal in time."""
        code = self._process.poll()
        assert self._process.stderr is not None
        with contextlib.suppress(BlockingIOError):
            while block := os.read(self._process.stderr.fileno(), 65536):
                self._stderr = (self._stderr + block)[-KEPT:]
        if code is None and self._deadline is not None and time.monotonic() > self._deadline:
            self.kill()
        if code is not None:
            self._process.stderr.close()
        return code

    def ask_to_stop(self, grace: float = GRACE) -> None:
        """SIGTERM, once: a run ends after its step; SIGKILL follows when it has not done so in time."""
        if self._deadline is None:
            self._deadline = time.monotonic() + grace
            everyone = descendants(self.pid) if self.ranks else [self.pid]
            # Below an mpirun: only the programs at the ends.
            for pid in [p for p in everyone if not self.ranks or len(descendants(p)) == 1]:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGTERM)

    def kill(self) -> None:
        """SIGKILL to all of it."""
        for pid in descendants(self.pid):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)


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
    """

    folder: str
    status: str
    reason: str
    message: str
    seconds: float
    values: dict[str, Value] = field(default_factory=dict)


def judge(code: int, told: dict[str, Any], stderr: str, stopped: str, seconds: float) -> tuple[str, str, str]:
    """Status, reason and message of a child that has ended.

    Args:
        code: Exit code; negative: the signal that ended it.
        told: Its run.json.
        stderr: The last of what it said.
        stopped: Why the sweep had asked it to stop: "", "timeout" or "interrupted".
        seconds: How long it ran.
    """
    lines = [line for line in stderr.splitlines() if line.strip()]
    last = lines[-1].strip() if lines else ""
    number = -code if code < 0 else None
    if match := re.search(r"EXIT STRING:.*\(signal (\d+)\)", stderr):  # mpirun tells of a rank
        number = int(match[1])
    status = told.get("status")
    if code == 0 and status == "finished":
        return "finished", told.get("reason", ""), told.get("message", "")
    if stopped == "timeout":
        return "timeout", "case_timeout", f"stopped after {seconds:.0f} s"
    if stopped:
        return "pending", "interrupted", "stopped with the sweep"
    if code == 3 and status == "failed":
        reason = told.get("reason", "failed")
        return ("timeout" if reason == "wall_time" else "failed"), reason, told.get("message", "")
    if code in (130, -signal.SIGTERM, -signal.SIGINT):
        return "pending", "interrupted", "a signal from outside stopped it"
    for pattern, number_of in ((TOO_LARGE, errno.EFBIG), (FULL, errno.ENOSPC)):
        if pattern.search(stderr):
            return "failed", "disk_full", f"could not write: {os.strerror(number_of)}"
    if MEMORY.search(stderr):
        return "failed", "out_of_memory", last
    if number == signal.SIGKILL:
        return "failed", "out_of_memory", "killed from outside by SIGKILL, as the system does when memory runs out"
    if number is not None:
        name = signal.Signals(number).name if number in set(signal.Signals) else f"signal {number}"
        return "failed", "crashed", f"ended by {name}" + (f": {last}" if last else "")
    if code == 2:
        return "failed", "refused", last.removeprefix("pairsim: ")
    if not told:
        return "failed", "not_started", last or f"exit code {code} before anything was written"
    return "failed", "error", last or f"exit code {code} without a word"


class Runner:
    """Computes one case after another, each in a child.

    Args:
        command: The command of the sweep.
        ranks: MPI processes of each case.
        timeout: Allowed wall time of a case in seconds.
    """

    def __init__(self, command: SweepCommand[Any], ranks: int = 1, timeout: float | None = None) -> None:
        self.command, self.ranks, self.timeout = command, ranks, timeout
        self._unit: list[Task] = []
        self._child: Child | None = None
        self._lock: int | None = None
        self._stopped, self._resumed = "", False
        self._begun = 0.0

    @property
    def busy(self) -> bool:
        """Whether there is anything left to do."""
        return bool(self._unit)

    def take(self, unit: list[Task]) -> None:
        """Accept cases that are to be computed one after another."""
        self._unit += unit

    def stop(self) -> None:
        """Interrupt the running case; the ones behind it are handed back as pending."""
        self._stopped = self._stopped or "interrupted"
        if self._child is not None:
            self._child.ask_to_stop()

    def poll(self) -> Result | None:
        """Go on; the result of a case that has ended, None as long as none has."""
        if not self._unit:
            return None
        task = self._unit[0]
        try:
            if self._child is None:
                if self._stopped:
                    return self._end(task, "pending", "interrupted", "not started")
                if not self._begun:
                    self._begun = time.monotonic()
                if not self._locked(task):
                    return None
                if finished_in(task.directory, self.command, task.key):  # by a sweep that shares the folder
                    told = read_told(task.directory)
                    return self._end(task, "finished", told["reason"], told["message"])
                self._start(task, resume=task.resume)
                return None
            code = self._child.poll()
            if code is None:
                if self.timeout is not None and self._child.seconds > self.timeout and not self._stopped:
                    self._stopped = "timeout"
                    self._child.ask_to_stop(min(GRACE, self.timeout))
                return None
            if code == 2 and self._resumed and not self._stopped:  # a checkpoint that cannot be used
                self._start(task, resume=False)
                return None
            told, stderr = read_told(task.directory), self._child.stderr
            status, reason, message = judge(code, told, stderr, self._stopped, self._child.seconds)
            if status != "finished" and stderr.strip():
                with contextlib.suppress(OSError):
                    write_text(task.directory / TOLD, stderr)
            return self._end(task, status, reason, message)
        except OSError as error:
            return self._end(task, "failed", "disk_full" if error.errno in DISK else "error", str(error))

    def _locked(self, task: Task) -> bool:
        """Hold the case's folder; False while another process still does."""
        task.directory.mkdir(parents=True, exist_ok=True)
        if self._lock is None:
            self._lock = os.open(task.directory, os.O_RDONLY)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:
            pass  # a file system without locks
        return True

    def _start(self, task: Task, resume: bool) -> None:
        (task.directory / TOLD).unlink(missing_ok=True)
        name = self.command.name
        self._resumed = resume and self.command.resumable and (task.directory / CHECKPOINT).is_file()
        if self._resumed:
            arguments = [name, "--resume", str(task.directory), "-q"]
        else:
            (task.directory / CHECKPOINT).unlink(missing_ok=True)
            task.case_file.parent.mkdir(exist_ok=True)
            write_text(task.case_file, yaml.safe_dump(plain(task.checked.resolved), sort_keys=False))
            arguments = [name, str(task.case_file), "-o", str(task.directory), "--overwrite", "-q"]
        mpirun = [find_mpirun() or "mpirun", "-n", str(self.ranks)] if self.ranks > 1 else []
        argv = [*mpirun, sys.executable, "-m", "pairsim", *arguments]
        self._child = Child(argv, self._lock, ranks=bool(mpirun))

    def _end(self, task: Task, status: str, reason: str, message: str) -> Result:
        seconds = time.monotonic() - self._begun if self._begun else 0.0
        values = self.command.values(task.directory) if status != "pending" else {}
        if status in ("failed", "timeout"):
            values["wall_time"] = seconds  # its own account stops where it did
        if self._lock is not None:
            os.close(self._lock)
        self._child, self._lock, self._begun = None, None, 0.0
        if self._stopped == "timeout":
            self._stopped = ""
        self._unit.pop(0)
        return Result(task.folder, status, reason, message, seconds, values)
