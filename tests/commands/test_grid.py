"""`pairsim sweep` before it computes: input errors, the list of cases, the script for Slurm."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from support.commands import Pairsim
from support.inputs import TINY
from typer.testing import CliRunner

from pairsim.cli.app import app
from pairsim.runtime.errors import InputError
from pairsim.sweeps.grid import read_grid


def test_bad_grid_ends_with_2_and_writes_nothing(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: [0.1, -0.2]}\n")
    done = pairsim("sweep", "grid.yaml", ranks=2)
    assert done.returncode == 2
    assert done.stderr.count("entry d0 = -0.2: d0: got -0.2") == 1
    assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["grid.yaml"]


@pytest.mark.parametrize("option", [["--shard", "3/2"], ["--shard", "x"], ["--walltime", "soon"], ["--emit", "pbs"]])
def test_bad_options_are_named(option: list[str], tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: [0.1]}\n")
    result = CliRunner().invoke(app, ["sweep", str(tmp_path / "grid.yaml"), *option])
    assert isinstance(result.exception, InputError)
    assert option[0] in str(result.exception)


def test_dry_run_lists_all_cases_and_computes_none(tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: [0.1, 0.2, 0.2]}\n")
    result = CliRunner().invoke(app, ["sweep", str(tmp_path / "grid.yaml"), "-o", str(tmp_path / "out"), "--dry-run"])
    assert result.exit_code == 0
    assert "2 cases of pairsim run" in result.output
    assert "1 duplicates left out" in result.output
    assert all(case.folder in result.output for case in read_grid(tmp_path / "grid.yaml").cases)
    assert not (tmp_path / "out").exists()


def test_slurm_script_does_all_shards(tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: {start: 0.1, stop: 1, num: 40}}\n")
    arguments = [
        "sweep",
        str(tmp_path / "grid.yaml"),
        "--emit",
        "slurm",
        "--set",
        "mesh.Np=12",
        "--walltime",
        "2:30:00",
    ]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0
    assert "#SBATCH --array=1-32" in result.output
    assert "#SBATCH --time=02:30:00" in result.output
    assert f"exec {sys.executable} -P -m pairsim sweep {tmp_path / 'grid.yaml'} -o " in result.output
    assert "--set mesh.Np=12" in result.output
    assert '--shard "$SLURM_ARRAY_TASK_ID/32"' in result.output
