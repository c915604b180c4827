"""pairsim on a real Slurm of one node, which is started in a temporary folder: `scripts/slurm-test`."""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest
from support.commands import Pairsim
from support.inputs import ROOT
from support.slurm import Slurm, missing, wait_for

from pairsim.record.checkpoint import load
from pairsim.sweeps.folder import read_sweep

pytestmark = [pytest.mark.long, pytest.mark.timeout(1200)]

CASE = "{beta: 0.4, De: 0, Ca_e: 0.1, d0: 0.1, ends: developed, length: 3, mesh: {Np: 8}, output: {fields: false}}\n"
SHORT = "base: case.yaml\ngrid: {d0: [0.1, 0.15, 0.2, 0.25], time.end: [0.01]}\n"
# Steps of some milliseconds: 14,000, so that the first job runs into its limit.
LONG = "base: case.yaml\ngrid: {d0: [0.1, 0.2], time.end: [0.14], time.fixed_step: [2.0e-5]}\n"
MOST = 8  # jobs after which the sweep must have finished, also on a crowded machine


@pytest.fixture
def slurm(tmp_path: Path) -> Iterator[Slurm]:
    """A running Slurm, and the files of cases in the folder that its commands run in."""
    if packages := missing():
        pytest.skip(f"NO SLURM, nothing of it is tried: apt install {' '.join(packages)}")
    for name, text in {"case": CASE, "short": SHORT, "grid": LONG}.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    page = (ROOT / "docs" / "how-to" / "cluster.md").read_text()
    script = re.search(r"```sh\n(#!/bin/bash\n.*?)```", page, re.DOTALL)
    assert script is not None
    (tmp_path / "job.sh").write_text(script[1])
    with tempfile.TemporaryDirectory(prefix="slurm-", ignore_cleanup_errors=True) as folder:
        slurm = Slurm(Path(folder), tmp_path)
        try:
            slurm.start()
            yield slurm
        finally:
            slurm.stop()


def rows_in(sweep: Path) -> int:
    """Rows of all series of a sweep."""
    return sum(path.read_text().count("\n") - 1 for path in sweep.glob("*/series.csv"))


def test_the_script_of_the_page_runs_into_its_limit_and_is_submitted_again(slurm: Slurm) -> None:
    """Cases end in order, all rows in the checkpoint; the next job goes on, and so does a requeued one."""
    sweep = slurm.work / "out"
    slurm.wait_for_end(slurm.submit("--time=3 job.sh"))
    records = [json.loads(path.read_text()) for path in sweep.glob("*/run.json")]
    assert [record["status"] for record in records] == ["interrupted"] * 2
    for path in sweep.glob("*/checkpoint.npz"):
        checkpoint = load(path.parent)
        assert checkpoint is not None
        assert checkpoint.rows == (path.parent / "series.csv").read_text().count("\n") - 1
    already, job = rows_in(sweep), slurm.submit("--time=3 job.sh")
    wait_for("the job goes on", lambda: rows_in(sweep) > already, 90)
    slurm.run(f"scontrol requeue {job}")
    wait_for("the job is requeued", lambda: slurm.job(job).get("Restarts") == "1", 120)
    slurm.wait_for_end(job)
    for _ in range(MOST):
        if read_sweep(sweep).counts["finished"] == 2:
            break
        slurm.wait_for_end(slurm.submit("--time=3 job.sh"))
    series = [pd.read_csv(path) for path in sweep.glob("*/series.csv")]
    assert [len(each) for each in series] == [7000, 7000]
    assert all((each["t"].diff().dropna() > 0).all() for each in series)
    assert len(pd.read_csv(sweep / "results.csv")) == 2


def test_srun_starts_several_processes(slurm: Slurm, pairsim: Pairsim) -> None:
    pairsim("sweep", "short.yaml", "-o", "local")
    slurm.run("srun --mpi=pmi2 -n 2 pairsim sweep short.yaml -o srun")
    found, expected = (pd.read_csv(slurm.work / name / "results.csv", dtype=str) for name in ("srun", "local"))
    pd.testing.assert_frame_equal(found.drop(columns="wall_time"), expected.drop(columns="wall_time"))
    said = slurm.run("! srun --mpi=pmi2 -n 2 pairsim run case.yaml -o srun-run")
    assert said.count("one process computes a case, but 2 were started") == 1
