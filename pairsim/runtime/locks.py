"""Locks of result folders: only one command at a time writes into a folder.

The lock is an `flock` on the file `.pairsim.lock`, which the system releases when its owner ends for any reason. On a
file system without locks the existence of the file is the lock, and its content names the owner. The lock of an owner
that no longer runs on this machine is removed; nothing can be found out about an owner on another machine.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import platform
import shlex
import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pairsim.runtime.collective import collectively
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from mpi4py import MPI

LOCK = ".pairsim.lock"
"""Name of the lock file. Locks for a part of the work in a folder have this name with a suffix."""

HELD = "PAIRSIM_LOCKED"
"""Environment variable with a JSON list of folders that are locked by the parent process on behalf of this one."""

PATIENCE = 1.0  # seconds to wait for the system to remove an owner that has just been killed; chosen


def command_line() -> str:
    """The command line of this process: `pairsim ...`, or `python ...` for a program that uses the Python interface."""
    program = Path(sys.argv[0])
    if program.name == "pairsim" or Path(__file__).parents[1] in program.resolve().parents:  # the script, or a module
        return shlex.join(["pairsim", *sys.argv[1:]])
    return shlex.join(["python", *sys.argv])


@dataclass(frozen=True)
class Owner:
    """Owner of a lock, as recorded in the lock file.

    Attributes:
        process: Process id; 0 if the file has no valid content.
        host: Name of the machine; empty if the file has no valid content.
        command: Command line.
    """

    process: int = 0
    host: str = ""
    command: str = ""

    @staticmethod
    def of(file: int) -> Owner:
        """Read the owner from an open lock file, given by its descriptor."""
        with contextlib.suppress(OSError, ValueError, TypeError, KeyError):
            content = json.loads(os.pread(file, 65536, 0))
            return Owner(int(content["process"]), str(content["host"]), str(content["command"]))
        return Owner()

    @property
    def dead(self) -> bool:
        """Whether the owner is known to have ended; False for owners on other machines."""
        if self.host != platform.node() or self.process <= 0:
            return False
        try:
            os.kill(self.process, 0)
        except ProcessLookupError:
            return True
        except OSError:  # the process exists and belongs to another user
            pass
        return False

    def __str__(self) -> str:
        return f"process {self.process} on {self.host}: {self.command}" if self.host else "owner unknown"


class FolderLock:
    """Lock of a folder against writing by other commands; the folder is created if it does not exist.

    A process whose parent holds the lock on its behalf (`handed_over`) takes no lock. A lock may be restricted to a
    part of the work: different parts can be locked at the same time, but not a part and the whole folder.

    Args:
        folder: The folder.
        command: Command line of the owner, shown in the message of other commands that find the folder locked.
        part: Suffix that names a part of the work, beginning with "-"; empty for the whole folder.
        patience: Seconds to wait for the lock.

    Attributes:
        file: Descriptor of the lock file, -1 without a lock. A child process that inherits it shares the lock.

    Raises:
        InputError: The folder is locked by another command, which the message names.
        OSError: The lock file cannot be created.
    """

    def __init__(self, folder: Path, command: str, part: str = "", patience: float = PATIENCE) -> None:
        self.folder, self.file = folder, -1
        self._path = folder / f"{LOCK}{part}"
        self._owner = Owner(os.getpid(), platform.node(), command)
        if str(folder.resolve()) in json.loads(os.environ.get(HELD, "[]")):
            return
        folder.mkdir(parents=True, exist_ok=True)
        begin = time.monotonic()
        while refusal := self._refused():
            if time.monotonic() - begin >= patience:
                raise InputError(str(folder), "", None, refusal)
            time.sleep(0.05)

    def release(self) -> None:
        """Release the lock and delete its file."""
        if self.file < 0:
            return
        with contextlib.suppress(OSError):
            if _is_at(self.file, self._path):
                self._path.unlink()  # before the release: a process that has opened it meanwhile checks with `_is_at`
        os.close(self.file)
        self.file = -1

    def _refused(self) -> str:
        """Try to take the lock; returns the reason for a refusal, or an empty string on success."""
        file, new = _opened(self._path)
        held = _flock(file)
        if held is None and not new and (owner := Owner.of(file)).dead:
            _remove(self._path, owner)
            os.close(file)
            return self._refused()
        if held is False or (held is None and not new):
            refusal = _refusal(file, self._path, held is None)
            os.close(file)
            return refusal
        if not _is_at(file, self._path):  # the previous owner deleted the file after it was opened here
            os.close(file)
            return self._refused()
        self.file = file
        content = json.dumps(asdict(self._owner)).encode()
        try:
            os.ftruncate(file, 0)
            os.pwrite(file, content, 0)
        except OSError:
            if held is None:  # on a file system without locks the content is the lock
                self.release()
                raise
        others = self.folder.glob(f"{LOCK}-*") if self._path.name == LOCK else [self.folder / LOCK]
        refusal = next(filter(None, map(_kept_out, others)), "")
        if refusal:
            self.release()
        return refusal


@contextlib.contextmanager
def sole_writer(directory: Path, command: str, comm: MPI.Comm | None = None) -> Iterator[None]:
    """Context in which only this command may write into a folder; rank 0 holds the lock.

    Args:
        directory: The folder.
        command: Command line of the owner, shown to other commands.
        comm: Communicator of all processes, or None in a single process without MPI.

    Raises:
        InputError: Another command is at work in the folder, or no folder can be created there; raised on every
            process.
    """
    try:
        lock = collectively(comm, lambda: FolderLock(directory, command))
    except OSError as error:
        file = directory.exists() and not directory.is_dir()
        why = "is a file; give the name of a folder" if file else f"cannot be used as a folder ({error.strerror})"
        raise InputError(str(directory), "-o", None, why if file else f"{why}; give another one") from error
    try:
        yield
    finally:
        if lock is not None:
            lock.release()


def handed_over(locks: Iterable[FolderLock]) -> dict[str, str]:
    """Environment variables for a child process that works in folders locked by this process."""
    return {HELD: json.dumps([str(lock.folder.resolve()) for lock in locks])}


def is_locked(folder: Path) -> bool:
    """Whether a folder, or a part of the work in it, is locked by a running command."""
    return any(map(_kept_out, folder.glob(f"{LOCK}*")))


def _opened(path: Path) -> tuple[int, bool]:
    """Open or create a lock file: its descriptor, and whether it was created."""
    while True:
        try:
            return os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666), True
        except FileExistsError:
            with contextlib.suppress(FileNotFoundError):  # its owner deleted it in between
                return os.open(path, os.O_RDWR), False


def _flock(file: int, kind: int = fcntl.LOCK_EX) -> bool | None:
    """Try to lock an open file: True on success, False if it is locked, None on a file system without locks."""
    try:
        fcntl.flock(file, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def _is_at(file: int, path: Path) -> bool:
    """Whether a path still refers to an open file."""
    try:
        return os.path.samestat(os.fstat(file), path.stat())
    except FileNotFoundError:
        return False


def _remove(path: Path, dead: Owner) -> None:
    """Delete the lock file of an owner that has ended.

    The file is renamed first and its content checked: if another process has meanwhile replaced it by its own lock,
    that lock is put back.
    """
    aside = path.with_name(f"{LOCK}.{os.getpid()}")
    with contextlib.suppress(FileNotFoundError):
        path.rename(aside)
        file = os.open(aside, os.O_RDONLY)
        if Owner.of(file) != dead:
            with contextlib.suppress(FileExistsError):
                os.link(aside, path)
        os.close(file)
        aside.unlink()


def _kept_out(path: Path) -> str:
    """Reason for a refusal if a lock file is held, an empty string otherwise."""
    try:
        file = os.open(path, os.O_RDONLY)
    except OSError:  # deleted in between, or created by a user without write access here
        return ""
    held = _flock(file, fcntl.LOCK_SH)
    free = held or (held is None and Owner.of(file).dead)
    refusal = "" if free else _refusal(file, path, held is None)
    os.close(file)
    return refusal


def _refusal(file: int, path: Path, by_name: bool) -> str:
    """Message that names the owner of an open lock file and says what to do."""
    advice = f", or delete {path} if that process has ended" if by_name else ""
    return f"another command is at work in this folder ({Owner.of(file)}); wait for its end{advice}"
