"""A case in a process of its own: started apart from MPI, watched, ended, and judged by what it leaves.

A process can end itself, be killed for its memory, or hang inside a library; one that is a child takes nobody along.
It is not a rank of the sweep's job (its environment has nothing of the launcher), leads its own process group, and dies
with its parent.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterable
from pathlib import Path

from pairsim.runtime.locks import FolderLock, handed_over

GRACE = 20.0  # seconds from a polite signal to SIGKILL: a step and a checkpoint must fit in
KEPT = 32_768  # bytes of a child's complaints that are kept
LAUNCHER = ("PMI_", "PMI2_", "PMIX_", "HYDRA_", "HYDI_", "MPI_", "PALS_", "PRTE_", "OMPI_", "SLURM_")
FULL = re.compile(r"No space left on device|Disk quota exceeded|\b[Ee]rrno (= )?(28|122)\b")
TOO_LARGE = re.compile(r"File too large|\b[Ee]rrno (= )?27\b")
DISK = (errno.EFBIG, errno.ENOSPC, errno.EDQUOT)
_LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None
_PR_SET_PDEATHSIG = 1


def module_command(module: str, *words: str) -> list[str]:
    """Command line that runs a module of this Python, from any folder.

    `python -m` alone searches the current folder first: a yaml.py there would be executed in place of the library, and
    a clone's folder named pairsim would hide an editable installation. PYTHONPATH holds as ever.
    """
    return [sys.executable, "-P", "-m", module, *words]


def clean_environment() -> dict[str, str]:
    """The environment without what makes a process believe that it is a rank of the surrounding job."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(LAUNCHER) or name.startswith("OMPI_ALLOW")
    }
    return kept | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def _die_with(parent: int) -> None:
    """In the child, before it becomes another program: die with the parent, and first when memory runs out."""
    if _LIBC is not None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != parent:  # it died before the line above
            os._exit(1)
    with contextlib.suppress(OSError), open("/proc/self/oom_score_adj", "w") as file:
        file.write("500")


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
        locks: Locks of the folders that it writes into; it holds them, too.
        ranks: Whether it is an mpirun, whose processes must be signalled one by one: mpirun itself would kill them.
    """

    def __init__(self, argv: list[str], locks: Iterable[FolderLock] = (), ranks: bool = False) -> None:
        parent, held = os.getpid(), list(locks)
        self.ranks, self.began = ranks, time.monotonic()
        self._process = subprocess.Popen(
            argv,
            env=clean_environment() | handed_over(held),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            pass_fds=[lock.file for lock in held if lock.file >= 0],
            process_group=0,
            preexec_fn=lambda: _die_with(parent),
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
        if self._process.returncode is not None:
            return self._process.returncode
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
