"""pairsim on a real Slurm of one node, which is started in a temporary folder: `scripts/slurm-test`."""

from __future__ import annotations

import filecmp
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from support.commands import Pairsim
from support.slurm import Slurm, missing, wait_for

from pairsim.results.checkpoint import load

pytestmark = [pytest.mark.long, pytest.mark.timeout(600)]

CASE = "{beta: 0.4, De: 0, Ca_e: 0.1, d0: 0.1, ends: developed, length: 3, mesh: {Np: 8}, output: {fields: false}}\n"
SHORT = "base: case.yaml\ngrid: {d0: [0.1, 0.15, 0.2, 0.25], time.end: [0.01]}\n"
# Steps of some milliseconds: 5,600, so that there is time to stop them, and more than anyone waits for.
LONG = "base: case.yaml\ngrid: {d0: [0.1, 0.2], time.end: [0.14], time.fixed_step: [5.0e-5]}\n"
ENDLESS = "base: case.yaml\ngrid: {d0: [0.1], time.end: [100], time.fixed_step: [5.0e-5]}\n"
PROGRESS = 200  # rows of a series after which a job has got on


@pytest.fixture
def slurm(tmp_path: Path) -> Iterator[Slurm]:
    """A running Slurm, and the files of cases in the folder that its commands run in."""
    if packages := missing():
        pytest.skip(f"NO SLURM, nothing of it is tried: apt install {' '.join(packages)}")
    for name, text in {"case": CASE, "short": SHORT, "long": LONG, "endless": ENDLESS}.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    with tempfile.TemporaryDirectory(prefix="slurm-", ignore_cleanup_errors=True) as folder:
        slurm = Slurm(Path(folder), tmp_path)
        try:
            slurm.start()
            yield slurm
        finally:
            slurm.stop()


def rows(sweep: Path) -> int:
    """Rows of all series of a sweep."""
    return sum(path.read_text().count("\n") - 1 for path in sweep.glob("*/series.csv"))


def wait_for_progress(sweep: Path) -> None:
    """Wait until a sweep has computed something since now; one that goes on may first drop rows."""

    def written() -> set[tuple[Path, int]]:
        return {(path, path.stat().st_mtime_ns) for path in sweep.glob("*/series.csv")}

    before = written()
    wait_for(f"{sweep.name} begins", lambda: written() != before, 90)
    already = rows(sweep)
    wait_for(f"{sweep.name} gets on", lambda: rows(sweep) > already + PROGRESS, 90)


def wait_for_restart(slurm: Slurm, job: str, restarts: int) -> None:
    """Wait until a job of the sweep `long` has been started again, and works."""

    def again() -> bool:
        known = slurm.job(job)
        return known.get("Restarts") == str(restarts) and known.get("JobState") == "RUNNING"

    wait_for(f"job {job} starts again", again, 120)
    wait_for_progress(slurm.work / "long")
    assert slurm.job(job)["JobState"] == "RUNNING"


def assert_checkpoints_are_whole(sweep: Path) -> None:
    """Cases that were stopped in order have all of their rows in the checkpoint."""
    stopped = list(sweep.glob("*/checkpoint.npz"))
    assert stopped
    for path in stopped:
        checkpoint = load(path.parent)
        assert checkpoint is not None
        assert checkpoint.rows == (path.parent / "series.csv").read_text().count("\n") - 1


def assert_same_tables(sweep: Path, reference: Path) -> None:
    """Results but for wall times, and all series, are those of another sweep to the last digit."""
    found, expected = (pd.read_csv(folder / "results.csv", dtype=str) for folder in (sweep, reference))
    pd.testing.assert_frame_equal(found.drop(columns="wall_time"), expected.drop(columns="wall_time"))
    series = [str(path.relative_to(reference)) for path in reference.glob("*/series.csv")]
    assert len(series) == len(expected)
    assert filecmp.cmpfiles(sweep, reference, series, shallow=False) == (series, [], [])


def test_array_and_several_processes(slurm: Slurm, pairsim: Pairsim) -> None:
    pairsim("sweep", "short.yaml", "-o", "local")
    slurm.run("pairsim sweep short.yaml -o array --shard 1/2 --emit slurm > short.sh")
    slurm.wait_for_end(slurm.submit("short.sh"))
    slurm.run("pairsim sweep short.yaml -o array")
    assert_same_tables(slurm.work / "array", slurm.work / "local")
    slurm.run("srun --mpi=pmi2 -n 2 pairsim sweep short.yaml -o srun")
    assert_same_tables(slurm.work / "srun", slurm.work / "local")
    pairsim("run", "case.yaml", "-o", "local-run", "--set", "time.end=0.01")
    slurm.run("srun --mpi=pmi2 -n 2 pairsim run case.yaml -o srun-run --set time.end=0.01 -q")
    two, one = (pd.read_csv(slurm.work / name / "series.csv") for name in ("srun-run", "local-run"))
    assert len(two) == len(one)
    np.testing.assert_allclose(two.iloc[-1, :9], one.iloc[-1, :9], rtol=0, atol=1e-10)


def test_time_limit(slurm: Slurm) -> None:
    """Sweeps stop in order by the signal of Slurm, and before the end that squeue tells."""
    slurm.run("pairsim sweep endless.yaml -o endless --walltime 0:02:00 --emit slurm > endless.sh")
    job = slurm.submit("endless.sh")
    said = slurm.run("srun --time=1 pairsim sweep endless.yaml -o endless-srun --progress lines", code=130)
    assert "the wall time of the sweep is over" in said
    slurm.wait_for_end(job)
    assert "SIGTERM" in next(slurm.work.glob(f"endless-{job}-1.log")).read_text()
    assert_checkpoints_are_whole(slurm.work / "endless")
    assert_checkpoints_are_whole(slurm.work / "endless-srun")
    already, job = rows(slurm.work / "endless"), slurm.submit("--time=10 endless.sh")
    wait_for_progress(slurm.work / "endless")
    assert rows(slurm.work / "endless") > already
    slurm.cancel(job)


def test_interruptions(slurm: Slurm, pairsim: Pairsim) -> None:
    """A job that is cancelled, requeued, or loses slurmd or its node goes on from its checkpoints."""
    sweep = slurm.work / "long"
    slurm.run("pairsim sweep long.yaml -o long --emit slurm > long.sh")
    job = slurm.submit("long.sh")
    wait_for_progress(sweep)
    slurm.cancel(job)
    assert_checkpoints_are_whole(sweep)

    job = slurm.submit("long.sh")
    wait_for_progress(sweep)
    slurm.run(f"scontrol requeue {job}")
    wait_for_restart(slurm, job, 1)

    slurm.kill_slurmd()
    wait_for_progress(sweep)
    slurm.start_node()
    assert slurm.job(job)["JobState"] == "RUNNING"

    slurm.crash_node()
    wait_for("Slurm gives the node up", lambda: slurm.node_state().startswith("down"), 120)
    slurm.start_node()
    wait_for_restart(slurm, job, 2)
    slurm.cancel(job)

    slurm.wait_for_end(slurm.submit("long.sh"))
    slurm.run("pairsim sweep long.yaml -o long")
    pairsim("sweep", "long.yaml", "-o", "local", "--workers", "2")
    assert_same_tables(sweep, slurm.work / "local")
