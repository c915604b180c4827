"""One writer a folder: a second command is refused at once and harms nothing, a dead owner keeps nobody out."""

from __future__ import annotations

import errno
import json
import os
import platform
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from subprocess import CompletedProcess

import pytest
from conftest import TINY

from pairsim.results.output import RunFolder, read_series
from pairsim.results.xdmf import read_frame
from pairsim.runtime.errors import InputError
from pairsim.runtime.locks import LOCK, FolderLock, Owner, is_locked

Pairsim = Callable[..., CompletedProcess[str]]

BASE = TINY.partition("{")[2].rpartition("time")[0]  # the tiny case without its times
ENDLESS = f"{{d0: 0.1, {BASE}time: {{end: 100, fixed_step: 0.002}}, output: {{every: 0.01, checkpoint: 1}}}}\n"
CURVE = f"{{d: {{start: 0.05, stop: 1, num: 300}}, mesh_error: false, {BASE.rstrip(', ')}}}\n"


@contextmanager
def at_work(folder: Path, *words: str, table: Path) -> Iterator[subprocess.Popen[str]]:
    """A command that has written some rows of a table and goes on."""
    command = [sys.executable, "-m", "pairsim", *words]
    process = subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    try:
        while not table.exists() or table.read_text().count("\n") < 4:
            assert process.poll() is None, process.stderr and process.stderr.read()
            time.sleep(0.02)
        yield process
    finally:
        process.kill()
        process.wait()


def refused(done: CompletedProcess[str], owner: subprocess.Popen[str]) -> None:
    assert done.returncode == 2, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    assert f"process {owner.pid} on {platform.node()}: pairsim {owner.args[3]}" in done.stderr  # type: ignore[index]


def test_second_run_is_refused_and_the_first_one_is_whole(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text(ENDLESS)
    out = tmp_path / "out"
    with at_work(tmp_path, "run", "case.yaml", "-o", "out", table=out / "series.csv") as first:
        refused(pairsim("run", "case.yaml", "--resume", "out", "-q"), first)
        refused(pairsim("run", "case.yaml", "-o", "out", "--overwrite", "-q"), first)
        together = pairsim("run", "case.yaml", "--resume", "out", "-q", ranks=2, timeout=60)
        refused(together, first)
        assert together.stderr.count("another command is at work") == 1
        first.send_signal(signal.SIGTERM)
        assert first.wait(timeout=100) == 130
    told, series = json.loads((out / "run.json").read_text()), read_series(out / "series.csv")
    assert len(series["t"]) == told["steps"]
    assert read_frame(out, -1).t == pytest.approx(series["t"][-1])
    assert not list(out.glob(f"{LOCK}*"))


def test_second_curve_is_refused(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "curve.yaml").write_text(CURVE)
    with at_work(tmp_path, "curve", "curve.yaml", "-o", "out", table=tmp_path / "out" / "curve.csv") as first:
        refused(pairsim("curve", "curve.yaml", "-o", "out", "--overwrite", "-q"), first)


def test_killed_run_keeps_nobody_out(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text(ENDLESS)
    out = tmp_path / "out"
    with at_work(tmp_path, "run", "case.yaml", "-o", "out", table=out / "series.csv") as first:
        first.kill()
    assert (out / LOCK).exists()
    done = pairsim("run", "case.yaml", "--resume", "out", "-q", "--set", "time.end=0.1")
    assert done.returncode == 0, done.stderr
    assert read_series(out / "series.csv")["t"][-1] == pytest.approx(0.1)


def test_case_of_a_sweep_belongs_to_it(tmp_path: Path, pairsim: Pairsim) -> None:
    """The case's process is not kept out by the lock that the sweep holds for it; all others are."""
    (tmp_path / "grid.yaml").write_text(f"base: {ENDLESS}grid: {{d0: [0.1]}}\n")
    (case,) = (
        line.split()[0] for line in pairsim("sweep", "grid.yaml", "--dry-run").stdout.splitlines() if "-" in line[:9]
    )
    out = tmp_path / "out"
    with at_work(tmp_path, "sweep", "grid.yaml", "-o", "out", "-q", table=out / case / "series.csv") as first:
        refused(pairsim("run", "--resume", f"out/{case}", "-q"), first)
        refused(pairsim("sweep", "grid.yaml", "-o", "out", "-q"), first)
        assert is_locked(out)
        first.send_signal(signal.SIGTERM)
        assert first.wait(timeout=100) == 130
    told = json.loads((out / case / "run.json").read_text())
    assert len(read_series(out / case / "series.csv")["t"]) == told["steps"]


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


@pytest.fixture
def no_flock(monkeypatch: pytest.MonkeyPatch) -> None:
    """A file system without locks."""

    def flock(file: int, kind: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

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


@pytest.mark.parametrize("name", ["PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "SLURM_STEP_NUM_TASKS"])
@pytest.mark.parametrize("command", ["run", "curve", "critical"])
def test_processes_that_do_not_see_each_other_are_refused(
    name: str, command: str, tmp_path: Path, pairsim: Pairsim, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A launcher whose MPI is not ours: each of its processes would run the same case in the same folder."""
    monkeypatch.setenv(name, "2")
    place = {"run": "d0: 0.1", "curve": "d: [0.1]", "critical": "d: [0.1, 1]"}[command]
    (tmp_path / "case.yaml").write_text(f"{{{place}, {BASE.rstrip(', ')}}}\n")
    done = pairsim(command, "case.yaml", "-o", "out", timeout=60)
    assert done.returncode == 2
    assert "2 processes that do not see each other" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()
