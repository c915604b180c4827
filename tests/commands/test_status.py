"""`pairsim status` for the folders of all commands."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from syrupy.assertion import SnapshotAssertion
from typer.testing import CliRunner

from pairsim.cli.app import app
from pairsim.results.folders import kind_of

TABLES = {"run": "series.csv", "curve": "curve.csv", "critical": "critical.csv"}


def make(folder: Path, table: str, **record: object) -> Path:
    folder.mkdir()
    (folder / table).write_text("t\n0.1\n")
    content = {"status": "finished", "reason": "end", "message": "finished at t = 2", "wall_time": 5.25} | record
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


def ledger(folder: Path, name: str) -> None:
    folder.mkdir(parents=True)
    counts = {"pending": 1, "running": 0, "finished": 0, "failed": 1, "timeout": 0}
    cases = [
        {"folder": "a-1", "status": "failed", "reason": "mesh_failed", "message": "no mesh", "attempts": 1},
        {"folder": "b-2", "status": "pending", "reason": "", "message": "", "attempts": 0},
    ]
    content = {"name": name, "command": "run", "updated": 1.0, "counts": counts, "cases": cases}
    (folder / "sweep.json").write_text(json.dumps(content))


def test_status_of_sweep_and_study(tmp_path: Path, snapshot: SnapshotAssertion) -> None:
    ledger(tmp_path / "sweep", "many")
    for i in (1, 2):
        ledger(tmp_path / "study" / f"sweep-{i}", f"repetition {i}")
    assert (kind_of(tmp_path / "sweep"), kind_of(tmp_path / "study")) == ("sweep", "study")
    assert status(tmp_path / "sweep") == snapshot
    assert status(tmp_path / "study") == snapshot
