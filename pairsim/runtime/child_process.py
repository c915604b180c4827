"""Child processes in which the cases of a sweep run.

A case may abort, be killed by the system for lack of memory, or hang inside a library. In a child process this does
not affect the sweep. A child is not an MPI rank of the sweep (the launcher's variables are removed from its
environment), leads its own process group, and is killed when its parent ends.
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
from pathlib import Path

GRACE = 20.0  # seconds from SIGTERM to SIGKILL; chosen, long enough for one time step and its checkpoint
KEPT = 32_768  # last bytes of a child's stderr that are kept
LAUNCHER = ("PMI_", "PMI2_", "PMIX_", "HYDRA_", "HYDI_", "MPI_", "PALS_", "PRTE_", "OMPI_", "SLURM_")
FULL = re.compile(r"No space left on device|Disk quota exceeded|\b[Ee]rrno (= )?(28|122)\b")
TOO_LARGE = re.compile(r"File too large|\b[Ee]rrno (= )?27\b")
DISK = (errno.EFBIG, errno.ENOSPC, errno.EDQUOT)
_LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None
_PR_SET_PDEATHSIG = 1


def module_command(module: str, *words: str) -> list[str]:
    """Command line that runs a module with this Python interpreter, from any folder.

    The option `-P` keeps the current folder off the import path: otherwise a file yaml.py there would be imported
    instead of the library, and a folder named pairsim would hide an editable installation. PYTHONPATH is respected.

    Args:
        module: Name of the module.
        words: Arguments passed to it.
    """
    return [sys.executable, "-P", "-m", module, *words]


def clean_environment() -> dict[str, str]:
    """The environment without the launcher's variables, so that MPI in a child starts as a job of its own.

    BLAS and OpenMP are limited to one thread, as a sweep runs one process per core.
    """
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(LAUNCHER) or name.startswith("OMPI_ALLOW")
    }
    return kept | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def _die_with(parent: int) -> None:
    """Run in the child before exec: request SIGKILL when the parent ends, and mark the child to be killed first.

    The raised `oom_score_adj` makes the kernel kill the case, not the sweep, when memory runs out.
    """
    if _LIBC is not None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != parent:  # the parent ended before the request was made
            os._exit(1)
    with contextlib.suppress(OSError), open("/proc/self/oom_score_adj", "w") as file:
        file.write("500")


def descendants(pid: int) -> list[int]:
    """Ids of a process and all its descendants, parents before children."""
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
    """A command that runs in a child process.

    Args:
        argv: The command and its arguments.

    Raises:
        OSError: The command cannot be started.
    """

    def __init__(self, argv: list[str]) -> None:
        parent = os.getpid()
        self.began = time.monotonic()
        self._process = subprocess.Popen(
            argv,
            env=clean_environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            process_group=0,
            preexec_fn=lambda: _die_with(parent),
        )
        assert self._process.stderr is not None
        os.set_blocking(self._process.stderr.fileno(), False)
        self._stderr = b""
        self._deadline: float | None = None

    @property
    def pid(self) -> int:
        """Process id of the child."""
        return self._process.pid

    @property
    def seconds(self) -> float:
        """Wall time since the child was started [s]."""
        return time.monotonic() - self.began

    @property
    def stderr(self) -> str:
        """End of the child's stderr, at most `KEPT` bytes."""
        return self._stderr.decode(errors="replace")

    def poll(self) -> int | None:
        """Exit code of the child, or None while it runs.

        Reads its stderr, and sends SIGKILL if it still runs when the grace period of `ask_to_stop` is over.
        """
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
        """Send SIGTERM, once, on which a run ends after its present step.

        Args:
            grace: Seconds after which `poll` sends SIGKILL.
        """
        if self._deadline is None:
            self._deadline = time.monotonic() + grace
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGTERM)

    def kill(self) -> None:
        """Send SIGKILL to the child and all its descendants."""
        for pid in descendants(self.pid):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
