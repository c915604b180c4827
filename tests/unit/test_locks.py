"""One writer for each folder: locks on file systems with and without `flock`."""

from __future__ import annotations

import errno
import json
import os
import platform
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from pairsim.results.output import RunFolder
from pairsim.runtime.errors import InputError
from pairsim.runtime.locks import LOCK, FolderLock, Owner, is_locked


def test_parts_share_a_folder_and_the_whole_does_not(tmp_path: Path) -> None:
    parts = [FolderLock(tmp_path, "", part, patience=0) for part in ("-1-of-2", "-2-of-2")]
    for part in ("", "-1-of-2"):
        with pytest.raises(InputError, match=f"process {os.getpid()} on"):
            FolderLock(tmp_path, "", part, patience=0)
    for lock in parts:
        lock.release()
    whole = FolderLock(tmp_path, "", patience=0)
    with pytest.raises(InputError, match="another command"):
        FolderLock(tmp_path, "", "-1-of-2", patience=0)
    whole.release()
    assert not is_locked(tmp_path)
    assert not list(tmp_path.iterdir())


def test_lock_file_does_not_make_a_folder_a_used_one(tmp_path: Path) -> None:
    (tmp_path / LOCK).touch()
    assert RunFolder.create(tmp_path).path == tmp_path


def test_lock_of_a_killed_parent_stays_with_its_child(tmp_path: Path) -> None:
    """Where the system does not end a child with its parent (macOS), the case is still being computed."""
    program = (
        "import os, pathlib, sys; from pairsim.runtime import child_process, locks; child_process._LIBC = None; "
        "lock = locks.FolderLock(pathlib.Path(sys.argv[1]), 'pairsim sweep'); "
        "print(child_process.Child(['sleep', '60'], [lock]).pid, flush=True); os.kill(os.getpid(), 9)"
    )
    parent = subprocess.run([sys.executable, "-c", program, tmp_path], stdout=subprocess.PIPE, text=True, check=False)
    with pytest.raises(InputError, match="pairsim sweep"):
        FolderLock(tmp_path, "", patience=0)
    os.kill(int(parent.stdout), signal.SIGKILL)
    FolderLock(tmp_path, "").release()


@pytest.fixture(params=[errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP], ids=errno.errorcode.get)
def no_flock(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file system without locks: Lustre without `-o flock`, NFS without a lock service, or another."""

    def flock(file: int, kind: int) -> None:
        raise OSError(request.param, os.strerror(request.param))

    monkeypatch.setattr("fcntl.flock", flock)


@pytest.mark.usefixtures("no_flock")
def test_without_locks_the_file_is_the_lock(tmp_path: Path) -> None:
    first = FolderLock(tmp_path, "pairsim run", patience=0)
    with pytest.raises(InputError, match=f"process {os.getpid()} on {platform.node()}: pairsim run"):
        FolderLock(tmp_path, "", patience=0)
    assert is_locked(tmp_path)
    first.release()
    FolderLock(tmp_path, "", patience=0).release()
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("no_flock")
def test_without_locks_a_dead_owner_of_this_machine_is_none(tmp_path: Path) -> None:
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    (tmp_path / LOCK).write_text(json.dumps(vars(Owner(dead.pid, platform.node(), "pairsim run"))))
    lock = FolderLock(tmp_path, "", patience=0)
    assert Owner.of(lock.file).process == os.getpid()
    lock.release()


@pytest.mark.usefixtures("no_flock")
@pytest.mark.parametrize("content", [json.dumps({"process": 1, "host": "elsewhere", "command": "pairsim run"}), ""])
def test_without_locks_the_file_of_another_machine_is_left_to_the_user(content: str, tmp_path: Path) -> None:
    path = tmp_path / LOCK
    path.write_text(content)
    with pytest.raises(InputError, match=f"delete {path}") as refusal:
        FolderLock(tmp_path, "", patience=0)
    assert ("process 1 on elsewhere" if content else "owner unknown") in str(refusal.value)
    assert path.read_text() == content
