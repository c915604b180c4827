"""`pairsim status` for the folders of all commands."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from support.result_folders import make_sweep
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


def status(folder: Path) -> list[str]:
    """The lines that `pairsim status` prints."""
    result = CliRunner().invoke(app, ["status", str(folder)])
    assert result.exit_code == 0, result.exception
    lines = result.output.replace(str(folder), folder.name).strip().splitlines()
    return [line.rstrip() for line in lines]


@pytest.mark.parametrize("kind", TABLES)
def test_status_of_a_case_has_outcome_and_warnings(kind: str, tmp_path: Path) -> None:
    folder = make(tmp_path / "out", TABLES[kind], warnings=["the mesh is coarse"], command=f"pairsim {kind} case.yaml")
    assert kind_of(folder) == kind
    assert status(folder) == [
        "out: finished (end)",
        "finished at t = 2",
        f"5.25 s of wall time, by: pairsim {kind} case.yaml",
        "warning: the mesh is coarse",
    ]


def test_status_of_a_killed_run(tmp_path: Path) -> None:
    said = status(make(tmp_path / "out", "series.csv", status="running", reason="", message=""))
    assert said[:2] == [
        "out: interrupted",
        "the command was killed; a run can be continued with pairsim run --resume",
    ]


def test_case_that_failed_before_its_table_is_found_by_its_record(tmp_path: Path) -> None:
    folder = make(tmp_path / "out", "series.csv", status="failed", reason="mesh_failed", message="no mesh")
    (folder / "series.csv").unlink()
    assert status(folder)[:2] == ["out: failed (mesh_failed)", "no mesh"]


def test_status_of_sweep_and_study(tmp_path: Path) -> None:
    """Of a study it is that of each repetition. One case has failed, and one has not begun."""
    study = tmp_path / "study"
    for folder, name in (tmp_path / "sweep", "many"), (study / "sweep-1", "first"), (study / "sweep-2", "second"):
        folder.mkdir(parents=True)
        make(folder / "a-1", "series.csv", status="failed", reason="mesh_failed", message="no mesh")
        make_sweep(folder, "run", {"a-1": {}, "b-2": {}}, [], name=name)
    (study / "study.csv").touch()
    assert (kind_of(tmp_path / "sweep"), kind_of(study)) == ("sweep", "study")
    first, *rest = status(tmp_path / "sweep")
    assert first == "many: 2 cases of pairsim run"
    assert rest == [
        "1 pending, 1 failed",
        "no sweep is at work here; the same command goes on with the rest",
        "case  reason       what happened",
        "a-1   mesh_failed  no mesh",
    ]
    of_each = [f"{name}: 2 cases of pairsim run" for name in ("first", "second")]
    assert status(study) == [of_each[0], *rest, of_each[1], *rest]
