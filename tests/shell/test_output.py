"""The files of a folder of results, and what `pairsim status` says of the folders of all commands."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
import yaml
from support.result_folders import make_sweep
from typer.testing import CliRunner

from pairsim.app.command_line import app
from pairsim.computing.question import own_files
from pairsim.questions.registry import QUESTIONS
from pairsim.record.folder import kind_of, prepare_folder, write_json, write_text, write_yaml
from pairsim.runtime.errors import InputError


def names(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir())


def test_create_makes_parents_and_accepts_an_empty_folder(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b"
    for _ in range(2):
        prepare_folder(path)
        assert names(path) == []


def test_overwrite_removes_own_files_and_no_others(tmp_path: Path) -> None:
    for name in (*own_files(QUESTIONS.values()), "notes.txt", "my.csv", ".series.csv.part"):
        (tmp_path / name).write_text("x")
    for name in ("fields", "sub"):
        (tmp_path / name).mkdir()
    for name in ("0000.h5", "000012.h5", ".0013.h5.part", "mine.h5"):
        (tmp_path / "fields" / name).write_text("x")
    (tmp_path / "sub" / "series.csv").write_text("x")
    prepare_folder(tmp_path, True, own_files(QUESTIONS.values()))
    assert names(tmp_path) == ["fields", "my.csv", "notes.txt", "sub"]
    assert names(tmp_path / "fields") == ["mine.h5"]
    assert names(tmp_path / "sub") == ["series.csv"]


def test_overwrite_removes_a_link_and_not_what_it_points_to(tmp_path: Path) -> None:
    (tmp_path / "kept.csv").write_text("x")
    run = tmp_path / "run"
    run.mkdir()
    (run / "series.csv").symlink_to(tmp_path / "kept.csv")
    prepare_folder(run, True, own_files(QUESTIONS.values()))
    assert names(run) == []
    assert (tmp_path / "kept.csv").read_text() == "x"


@pytest.mark.parametrize("overwrite", [False, True])
def test_create_refuses_a_file(tmp_path: Path, overwrite: bool) -> None:
    file = tmp_path / "run"
    file.write_text("mine")
    for path in (file, file / "below"):
        with pytest.raises(InputError):
            prepare_folder(path, overwrite)
    assert file.read_text() == "mine"


def test_yaml_and_json_take_numpy_and_keep_the_order(tmp_path: Path) -> None:
    content = {"z": np.float64(0.1), "a": np.arange(3), "flag": np.bool_(True), "in": {"p": Path("x"), "t": (1, None)}}
    expected = {"z": 0.1, "a": [0, 1, 2], "flag": True, "in": {"p": "x", "t": [1, None]}}
    write_yaml(tmp_path / "case.yaml", content)
    assert yaml.safe_load((tmp_path / "case.yaml").read_text()) == expected
    write_json(tmp_path / "run.json", content)
    written = json.loads((tmp_path / "run.json").read_text())
    assert written == expected
    assert list(written) == list(content)
    assert names(tmp_path) == ["case.yaml", "run.json"]


@pytest.mark.parametrize("value", [float("nan"), np.float64("nan"), np.array([1, np.nan])])
def test_nan_is_refused_by_key_and_the_old_file_stays(tmp_path: Path, value: object) -> None:
    write_json(tmp_path / "run.json", {"ok": 1})
    with pytest.raises(ValueError, match=r"wall\.jit"):
        write_json(tmp_path / "run.json", {"wall": {"jit": value}})
    with pytest.raises(ValueError, match="nan"):
        write_yaml(tmp_path / "case.yaml", {"x": value})
    assert json.loads((tmp_path / "run.json").read_text()) == {"ok": 1}
    assert names(tmp_path) == ["run.json"]


def test_failed_write_leaves_the_old_file_and_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "run.json"
    write_text(file, "old")

    def fail(*_: object) -> None:
        raise OSError(28, "disk full")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(OSError, match="disk full") as failure:
        write_text(file, "new")
    assert failure.value.filename == str(file)
    assert file.read_text() == "old"
    assert names(tmp_path) == ["run.json"]


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
    folder = make(tmp_path / "out", "series.csv", status="running", reason="", message="")
    killed = ["out: interrupted", "the command was killed", "5.25 s of wall time, by:"]
    assert status(folder) == [
        *killed,
        "Next: the same command with --overwrite computes it again; what was written is kept until then.",
    ]
    (folder / "checkpoint.npz").touch()
    assert status(folder) == [*killed, "Next: pairsim run --resume out continues from the last checkpoint."]


def test_case_that_failed_before_its_table_is_found_by_its_record(tmp_path: Path) -> None:
    folder = make(tmp_path / "out", "series.csv", status="failed", reason="mesh_failed", message="no mesh")
    (folder / "series.csv").unlink()
    assert status(folder)[:2] == ["out: failed (mesh_failed)", "no mesh"]


def test_status_of_sweep_and_study(tmp_path: Path) -> None:
    """One case has failed, and one has not begun."""
    study = tmp_path / "study"
    for folder, name in (tmp_path / "sweep", "many"), (study, "meshes"):
        folder.mkdir()
        make(folder / "a-1", "series.csv", status="failed", reason="mesh_failed", message="no mesh")
        make_sweep(folder, "run", {"a-1": {}, "b-2": {}}, [], name=name)
    (study / "study.csv").touch()
    assert (kind_of(tmp_path / "sweep"), kind_of(study)) == ("sweep", "study")
    first, *rest = status(tmp_path / "sweep")
    assert first == "many: 2 cases of pairsim run"
    assert rest == [
        "1 pending, 1 failed",
        "no sweep is at work here; the same command continues it",
        "case  reason       what happened",
        "a-1   mesh_failed  no mesh",
    ]
    assert status(study) == ["meshes: 2 cases of pairsim run", *rest]
