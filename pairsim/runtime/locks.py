"""One writer a folder: a command that writes into a folder of results holds its lock from before its first change.

The lock is `flock` on `.pairsim.lock`, which the system takes from a process that ends, however it does. On a file
system that knows no locks the file itself is the lock, and whoever it names holds it: a process of this machine that is
dead does not, of one on another machine nothing can be known.
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
"""The lock file; the names of those for parts of a folder's work begin so."""

HELD = "PAIRSIM_LOCKED"
"""Environment variable: the folders, a list in JSON, that a process works in under a lock of its parent's."""

PATIENCE = 1.0  # seconds in which an owner that was killed just now has gone


def command_line() -> str:
    """The command line of this process: `pairsim ...`, or that of another program which uses the Python interface."""
    program = Path(sys.argv[0])
    if program.name == "pairsim" or Path(__file__).parents[1] in program.resolve().parents:  # the script, or a module
        return shlex.join(["pairsim", *sys.argv[1:]])
    return shlex.join(["python", *sys.argv])


@dataclass(frozen=True)
class Owner:
    """Who holds a lock, as its file tells.

    Attributes:
        process, host: Process id and machine; 0 and "" where the file tells nothing.
        command: Command line.
    """

    process: int = 0
    host: str = ""
    command: str = ""

    @staticmethod
    def of(file: int) -> Owner:
        """That of an open lock file."""
        with contextlib.suppress(OSError, ValueError, TypeError, KeyError):
            content = json.loads(os.pread(file, 65536, 0))
            return Owner(int(content["process"]), str(content["host"]), str(content["command"]))
        return Owner()

    @property
    def dead(self) -> bool:
        """Whether it is known to have ended."""
        if self.host != platform.node() or self.process <= 0:
            return False
        try:
            os.kill(self.process, 0)
        except ProcessLookupError:
            return True
        except OSError:  # somebody else's
            pass
        return False

    def __str__(self) -> str:
        return f"process {self.process} on {self.host}: {self.command}" if self.host else "owner unknown"


class FolderLock:
    """Keeps all other commands from writing into a folder, which is made if there is none.

    A process whose parent holds the folder on its behalf (`handed_over`) takes no lock of its own. Parts of a folder's
    work may go on at once: each keeps out the like of itself and the whole.

    Args:
        folder: The folder.
        command: Command line of the owner, for those who are refused.
        part: Which part of the folder's work, beginning with "-"; all of it by default.
        patience: Seconds to wait for an owner that is about to go.

    Attributes:
        file: Descriptor of the lock file, -1 without a lock of its own. A child that inherits it holds the lock, too.

    Raises:
        InputError: Another command is at work in the folder; says which.
        OSError: The lock file cannot be made.
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
        """Let others in; no lock file is left."""
        if self.file < 0:
            return
        with contextlib.suppress(OSError):
            if _is_at(self.file, self._path):
                self._path.unlink()  # while it is held: who has opened it meanwhile finds out (`_is_at`)
        os.close(self.file)
        self.file = -1

    def _refused(self) -> str:
        """Take the lock; why it cannot be had, or "" when it is."""
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
        if not _is_at(file, self._path):  # its last owner removed it after it was opened here
            os.close(file)
            return self._refused()
        self.file = file
        content = json.dumps(asdict(self._owner)).encode()
        try:
            os.ftruncate(file, 0)
            os.pwrite(file, content, 0)
        except OSError:
            if held is None:  # without its content it is no lock
                self.release()
                raise
        others = self.folder.glob(f"{LOCK}-*") if self._path.name == LOCK else [self.folder / LOCK]
        refusal = next(filter(None, map(_kept_out, others)), "")
        if refusal:
            self.release()
        return refusal


@contextlib.contextmanager
def sole_writer(comm: MPI.Comm | None, directory: Path, command: str) -> Iterator[None]:
    """Keep all other commands from writing into a folder; the lock is the first process's (of `comm`, None: of one).

    Raises:
        InputError: On every process: another command is at work there, or it cannot be a folder.
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
    """The environment of a child that works in locked folders on behalf of this process."""
    return {HELD: json.dumps([str(lock.folder.resolve()) for lock in locks])}


def is_locked(folder: Path) -> bool:
    """Whether a command is at work in a folder, or in a part of it."""
    return any(map(_kept_out, folder.glob(f"{LOCK}*")))


def _opened(path: Path) -> tuple[int, bool]:
    """The lock file, and whether it was made."""
    while True:
        try:
            return os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666), True
        except FileExistsError:
            with contextlib.suppress(FileNotFoundError):  # its owner is just going
                return os.open(path, os.O_RDWR), False


def _flock(file: int, kind: int = fcntl.LOCK_EX) -> bool | None:
    """Lock an open file: whether it could be, None on a file system without locks."""
    try:
        fcntl.flock(file, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def _is_at(file: int, path: Path) -> bool:
    """Whether an open file is what has a name."""
    try:
        return os.path.samestat(os.fstat(file), path.stat())
    except FileNotFoundError:
        return False


def _remove(path: Path, dead: Owner) -> None:
    """Remove the lock file of a dead owner, and never that of one who has removed it before us and taken its place."""
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
    """Why the owner of a lock file keeps others out; "" if nobody holds it."""
    try:
        file = os.open(path, os.O_RDONLY)
    except OSError:  # gone, or nobody who may write here has made it
        return ""
    held = _flock(file, fcntl.LOCK_SH)
    free = held or (held is None and Owner.of(file).dead)
    refusal = "" if free else _refusal(file, path, held is None)
    os.close(file)
    return refusal


def _refusal(file: int, path: Path, by_name: bool) -> str:
    """Who holds an open lock file, and what to do."""
    advice = f", or delete {path} if that process has ended" if by_name else ""
    return f"another command is at work in this folder ({Owner.of(file)}); wait for its end{advice}"
