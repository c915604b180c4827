"""`pairsim status` for the folders of all commands."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from support.result_folders import make_sweep
from syrupy.assertion import SnapshotAssertion
from typer.testing import CliRunner

from pairsim.cli.app import app
from pairsim.results.folder import kind_of

TABLES = {"run": "series.csv", "curve": "curve.csv", "critical": "critical.csv"}


def make(folder: Path, table: str, **record: object) -> Path:
    folder.mkdir()
    (folder / table).write_text("t\n0.1\n")
    kind = next(name for name, file in TABLES.items() if file == table)
    content = {"kind": kind, "status": "finished", "reason": "end", "message": "finished at t = 2", "wall_time": 5.25}
    content |= record
    (folder / "run.json").write_text(json.dumps(content))
    return folder


def status(folder: Path) -> str:
    result = CliRunner().invoke(app, ["status", str(folder)])
    assert result.exit_code == 0, result.exception
    return result.output.replace(str(folder), folder.name)


@pytest.mark.parametrize("kind", TABLES)
def test_status_of_a_case_has_outcome_and_warnings(kind: str, tmp_path: Path, snapshot: SnapshotAssertion) -> None:
    folder = make(tmp_path / "out", TABLES[kind], warnings=["the mesh is coarse"], command=f"pairsim {kind} case.yaml")
    assert kind_of(folder) == kind
    assert status(folder) == snapshot


def test_status_of_a_killed_run(tmp_path: Path, snapshot: SnapshotAssertion) -> None:
    assert status(make(tmp_path / "out", "series.csv", status="running", reason="", message="")) == snapshot


def test_case_that_failed_before_its_table_is_found_by_its_record(tmp_path: Path, snapshot: SnapshotAssertion) -> None:
    folder = make(tmp_path / "out", "series.csv", status="failed", reason="mesh_failed", message="no mesh")
    (folder / "series.csv").unlink()
    assert status(folder) == snapshot


def a_sweep(folder: Path, name: str) -> None:
    """One case that has failed, and one that has not begun."""
    folder.mkdir(parents=True)
    make(folder / "a-1", "series.csv", status="failed", reason="mesh_failed", message="no mesh")
    make_sweep(folder, "run", {"a-1": {}, "b-2": {}}, [], name=name)


def test_status_of_sweep_and_study(tmp_path: Path, snapshot: SnapshotAssertion) -> None:
    a_sweep(tmp_path / "sweep", "many")
    for i in (1, 2):
        a_sweep(tmp_path / "study" / f"sweep-{i}", f"repetition {i}")
    (tmp_path / "study" / "study.csv").touch()
    assert (kind_of(tmp_path / "sweep"), kind_of(tmp_path / "study")) == ("sweep", "study")
    assert status(tmp_path / "sweep") == snapshot
    assert status(tmp_path / "study") == snapshot
