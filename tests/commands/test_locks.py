"""One writer for each folder: a second command is refused at once, and the lock of a dead process is released."""

from __future__ import annotations

import json
import platform
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from support.commands import Done, Pairsim
from support.inputs import TINY

from pairsim.results.output import read_series
from pairsim.results.xdmf import read_frame
from pairsim.runtime.locks import LOCK, is_locked

BASE = TINY.partition("{")[2].rpartition("time")[0]  # the tiny case without its times
ENDLESS = f"{{d0: 0.1, {BASE}time: {{end: 100, fixed_step: 0.002}}, output: {{every: 0.01, checkpoint: 1}}}}\n"
CURVE = f"{{d: {{start: 0.05, stop: 1, num: 300}}, {BASE.rstrip(', ')}}}\n"


@contextmanager
def at_work(folder: Path, *words: str, table: Path) -> Iterator[subprocess.Popen[str]]:
    """A running command that has written some rows of a table."""
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


def refused(done: Done, owner: subprocess.Popen[str]) -> None:
    assert done.returncode == 2, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    assert f"process {owner.pid} on {platform.node()}: pairsim {owner.args[3]}" in done.stderr  # type: ignore[index]


@pytest.mark.slow
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
    record, series = json.loads((out / "run.json").read_text()), read_series(out / "series.csv")
    assert len(series["t"]) == record["steps"]
    assert read_frame(out, -1).t == pytest.approx(series["t"][-1])
    assert not list(out.glob(f"{LOCK}*"))


@pytest.mark.slow
def test_second_curve_is_refused(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "curve.yaml").write_text(CURVE)
    with at_work(tmp_path, "curve", "curve.yaml", "-o", "out", table=tmp_path / "out" / "curve.csv") as first:
        refused(pairsim("curve", "curve.yaml", "-o", "out", "--overwrite", "-q"), first)


@pytest.mark.slow
def test_lock_of_a_killed_run_is_released(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text(ENDLESS)
    out = tmp_path / "out"
    with at_work(tmp_path, "run", "case.yaml", "-o", "out", table=out / "series.csv") as first:
        first.kill()
    assert (out / LOCK).exists()
    done = pairsim("run", "case.yaml", "--resume", "out", "-q", "--set", "time.end=0.1")
    assert done.returncode == 0, done.stderr
    assert read_series(out / "series.csv")["t"][-1] == pytest.approx(0.1)


@pytest.mark.slow
def test_case_of_a_sweep_belongs_to_it(tmp_path: Path, pairsim: Pairsim) -> None:
    """The lock of a case, held by the sweep, admits the process of the case and no other."""
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
    record = json.loads((out / case / "run.json").read_text())
    assert len(read_series(out / case / "series.csv")["t"]) == record["steps"]


@pytest.mark.parametrize(
    ("name", "command"),
    [("PMI_SIZE", "run"), ("OMPI_COMM_WORLD_SIZE", "curve"), ("SLURM_STEP_NUM_TASKS", "critical")],
)
def test_processes_that_do_not_see_each_other_are_refused(
    name: str, command: str, tmp_path: Path, pairsim: Pairsim, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a launcher of another MPI, each process would run the same case in the same folder."""
    monkeypatch.setenv(name, "2")
    place = {"run": "d0: 0.1", "curve": "d: [0.1]", "critical": "d: [0.1, 1]"}[command]
    (tmp_path / "case.yaml").write_text(f"{{{place}, {BASE.rstrip(', ')}}}\n")
    done = pairsim(command, "case.yaml", "-o", "out", timeout=60)
    assert done.returncode == 2
    assert "2 processes that do not see each other" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()
