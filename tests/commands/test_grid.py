"""`pairsim sweep` before it computes: input errors, the list of cases, the script for Slurm."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from support.commands import Pairsim
from support.inputs import TINY
from typer.testing import CliRunner

from pairsim.cli.app import app
from pairsim.sweeps.grid import read_grid
from pairsim.sweeps.slurm import array_of


def test_bad_grid_ends_with_2_and_writes_nothing(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: [0.1, -0.2]}\n")
    done = pairsim("sweep", "grid.yaml", ranks=2)
    assert done.returncode == 2
    assert done.stderr.count("entry d0 = -0.2: d0: got -0.2") == 1
    assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["grid.yaml"]


def test_dry_run_lists_all_cases_and_computes_none(tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: [0.1, 0.2, 0.2]}\n")
    result = CliRunner().invoke(app, ["sweep", str(tmp_path / "grid.yaml"), "-o", str(tmp_path / "out"), "--dry-run"])
    assert result.exit_code == 0
    assert "2 cases of pairsim run" in result.output
    assert "1 duplicates left out" in result.output
    assert all(case.folder in result.output for case in read_grid(tmp_path / "grid.yaml").cases)
    assert not (tmp_path / "out").exists()


def script(tmp_path: Path, grid: str, *options: str) -> tuple[str, str]:
    """Standard output and standard error of `pairsim sweep --emit slurm`."""
    (tmp_path / "grid.yaml").write_text(TINY + grid)
    result = CliRunner().invoke(app, ["sweep", str(tmp_path / "grid.yaml"), "--emit", "slurm", *options])
    assert result.exit_code == 0, result.output
    return result.stdout, result.stderr


def test_slurm_script_does_all_shards(tmp_path: Path) -> None:
    options = ["--set", "mesh.Np=12", "--walltime", "2:30:00", "--shard", "1/32"]
    text, warnings = script(tmp_path, "grid: {d0: {start: 0.1, stop: 1, num: 40}}\n", *options)
    assert "#SBATCH --array=1-32\n" in text
    assert "#SBATCH --time=02:30:00\n" in text
    assert f"exec {sys.executable} -P -m pairsim sweep {tmp_path / 'grid.yaml'} -o " in text
    assert "--set mesh.Np=12" in text
    assert '--shard "$SLURM_ARRAY_TASK_ID/32"' in text
    assert not warnings


def test_slurm_tasks_are_bundles_with_time_and_memory_of_the_estimate(tmp_path: Path) -> None:
    """Cases of a second share a task of ten minutes; hours of work are spread."""
    text, warnings = script(tmp_path, "grid: {d0: {start: 0.1, stop: 1, num: 24}}\n")
    assert "#SBATCH --array=1-1\n" in text
    assert "#SBATCH --time=00:10:00\n" in text
    assert "#SBATCH --mem=1000M\n" in text
    assert not warnings
    grid = read_grid(tmp_path / "grid.yaml")
    estimate = replace(grid.cases[0].estimate, seconds=3600.0, memory=2e9)
    cases = tuple(replace(case, estimate=estimate) for case in grid.cases)
    hours = replace(grid, cases=cases)
    array = array_of(hours, tasks=None, walltime=None)
    assert (array.tasks, array.work, array.memory) == (24, 3600.0, 3.1e9)
    assert 3 * 3600 + 300 <= array.time < 3 * 3600 + 300 + 600
    assert array_of(hours, tasks=3, walltime=None).time == 24 * 3600


def test_slurm_script_warns_of_times_that_are_too_short(tmp_path: Path) -> None:
    _, warnings = script(tmp_path, "grid: {d0: [0.1, 0.2]}\n", "--walltime", "0:02:30")
    assert "warning: Slurm stops a task 60 to 120 s before its time limit" in warnings
    _, warnings = script(tmp_path, "grid: {d0: [0.1, 0.2]}\n", "--walltime", "0:03:00")
    assert not warnings
    _, warnings = script(tmp_path, "grid: {d0: [0.1, 0.2]}\n", "--walltime", "0:05:00", "--set", "time.fixed_step=1e-7")
    assert "warning: the longest task may not end within its time limit of 5 min 00 s" in warnings
