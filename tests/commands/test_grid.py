"""`pairsim sweep` before it computes: input errors, the list of cases."""

from __future__ import annotations

from pathlib import Path

from support.commands import Pairsim
from support.inputs import TINY
from typer.testing import CliRunner

from pairsim.cli.app import app
from pairsim.sweeps.grid import read_grid


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
