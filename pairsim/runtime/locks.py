"""Locks of folders of results: only one command at a time writes into a folder.

The lock is filelock's: an `flock` on the file `.pairsim.lock`, which the system releases when its owner ends for any
reason, or on file systems without `flock` the existence of that file, which is removed if its owner has ended on the
same machine. The owner is named in a file beside it.
"""

from __future__ import annotations

import os
import platform
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pairsim.runtime.errors import Argument, InputError
from pairsim.runtime.text import printable

LOCK = ".pairsim.lock"
OWNER = ".pairsim.owner"
LOCK_FILES = (LOCK, OWNER)
PATIENCE = 1.0  # seconds to wait for the system to release the lock of an owner that has just been killed


def command_line() -> str:
    """The command line of this process: `pairsim ...`, or `python ...` for a program that uses the Python interface."""
    program = Path(sys.argv[0])
    if program.name == "pairsim" or Path(__file__).parents[1] in program.resolve().parents:  # the script, or a module
        return printable(shlex.join(["pairsim", *sys.argv[1:]]))
    return printable(shlex.join(["python", *sys.argv]))


@contextmanager
def sole_writer(directory: Path, command: str) -> Iterator[None]:
    """Context in which no other command may write into a folder.

    The error of another command that tries to names `command`, the command line of the owner. The folder is made if
    needed, and removed at the end if it was made here and nothing was written into it.

    Raises:
        InputError: Another command is at work in the folder, or no folder can be created there.
    """
    from filelock import FileLock, Timeout

    lock, owner, new = FileLock(directory / LOCK, timeout=PATIENCE), directory / OWNER, not directory.exists()
    try:
        directory.mkdir(parents=True, exist_ok=True)
        lock.acquire()
        owner.write_text(f"process {os.getpid()} on {platform.node()}: {command}", encoding="utf-8")
    except Timeout as error:
        who = owner.read_text(encoding="utf-8") if owner.is_file() else "owner unknown"
        refusal = f"another command is at work in this folder ({who}); wait for its end"
        raise InputError(str(directory), "", None, refusal) from error
    except OSError as error:
        file = directory.exists() and not directory.is_dir()
        why = "is a file; give the name of a folder" if file else f"cannot be used as a folder ({error.strerror})"
        raise InputError(
            str(directory), Argument("folder"), None, why if file else f"{why}; give another one"
        ) from error
    try:
        yield
    finally:
        with suppress(OSError):
            for name in LOCK_FILES:  # before the release, so that no file of the next owner is removed
                (directory / name).unlink(missing_ok=True)
        lock.release()
        if new:
            with suppress(OSError):  # it has files
                directory.rmdir()


def is_locked(directory: Path) -> bool:
    """Whether a running command has locked a folder; False if this cannot be determined, as without write access."""
    from filelock import FileLock, Timeout

    if not (directory / LOCK).exists():
        return False
    try:
        with FileLock(directory / LOCK, timeout=0):
            return False
    except Timeout:
        return True
    except OSError:
        return False
