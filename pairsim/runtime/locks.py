"""Locks of folders of results: only one command at a time writes into a folder.

The lock is filelock's: an `flock` on the file `.pairsim.lock`, which the system releases when its owner ends for any
reason, or on file systems without `flock` the existence of a file, which is removed if its owner has ended on the same
machine. The owner is named in a file beside it.
"""

from __future__ import annotations

import errno
import os
import platform
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from filelock import BaseFileLock

LOCK = ".pairsim.lock"
OWNER = ".pairsim.owner"
MARKER = ".pairsim.marker"
"""The lock where the file system refuses `flock`."""
LOCK_FILES = (LOCK, OWNER, MARKER)
PATIENCE = 1.0
"""Seconds to wait for the system to remove an owner that has just been killed."""


def command_line() -> str:
    """The command line of this process: `pairsim ...`, or `python ...` for a program that uses the Python interface."""
    program = Path(sys.argv[0])
    if program.name == "pairsim" or Path(__file__).parents[1] in program.resolve().parents:  # the script, or a module
        return shlex.join(["pairsim", *sys.argv[1:]])
    return shlex.join(["python", *sys.argv])


@contextmanager
def sole_writer(directory: Path, command: str) -> Iterator[None]:
    """Context in which no other command may write into a folder, which is made if it does not exist.

    Args:
        directory: The folder.
        command: Command line of the owner, shown to other commands.

    Raises:
        InputError: Another command is at work in the folder, or no folder can be created there.
    """
    from filelock import Timeout

    try:
        directory.mkdir(parents=True, exist_ok=True)
        lock = _locked(directory, PATIENCE)
        (directory / OWNER).write_text(f"process {os.getpid()} on {platform.node()}: {command}", encoding="utf-8")
    except Timeout as error:
        raise InputError(str(directory), "", None, _refusal(directory)) from error
    except OSError as error:
        file = directory.exists() and not directory.is_dir()
        why = "is a file; give the name of a folder" if file else f"cannot be used as a folder ({error.strerror})"
        raise InputError(str(directory), "-o", None, why if file else f"{why}; give another one") from error
    try:
        yield
    finally:
        with suppress(OSError):
            for name in LOCK_FILES:  # before the release, so that none of the next owner is removed
                (directory / name).unlink(missing_ok=True)
        lock.release()


def is_locked(directory: Path) -> bool:
    """Whether a running command has locked a folder; False where this cannot be found out, as without write access."""
    from filelock import Timeout

    if not (directory / LOCK).exists():
        return False
    try:
        _locked(directory, 0.0).release()
    except Timeout:
        return True
    except OSError:
        pass
    return False


def _locked(directory: Path, patience: float) -> BaseFileLock:
    """Lock a folder.

    Raises:
        Timeout: Another process has locked it, also after this time [s].
        OSError: The file of the lock cannot be made.
    """
    from filelock import FileLock, SoftFileLock, Timeout

    lock: BaseFileLock = FileLock(directory / LOCK)
    try:
        lock.acquire(timeout=patience)
    except Timeout:
        raise
    except OSError as error:  # filelock itself does so for ENOSYS only
        if error.errno not in (errno.ENOLCK, errno.EOPNOTSUPP):
            raise
        lock = SoftFileLock(directory / MARKER)
        lock.acquire(timeout=patience)
    return lock


def _refusal(directory: Path) -> str:
    try:
        owner = (directory / OWNER).read_text(encoding="utf-8")
    except OSError:
        owner = "owner unknown"
    return f"another command is at work in this folder ({owner}); wait for its end"
