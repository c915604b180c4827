"""The files of a folder of results."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
import yaml

from pairsim.computing import own_files
from pairsim.results.folder import prepare_folder, write_json, write_text, write_yaml
from pairsim.runtime.errors import InputError


def names(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir())


def test_create_makes_parents_and_accepts_an_empty_folder(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b"
    for _ in range(2):
        prepare_folder(path)
        assert names(path) == []


def test_overwrite_removes_own_files_and_no_others(tmp_path: Path) -> None:
    for name in (*own_files(), "notes.txt", "my.csv", ".series.csv.part"):
        (tmp_path / name).write_text("x")
    for name in ("fields", "sub"):
        (tmp_path / name).mkdir()
    for name in ("0000.h5", "000012.h5", ".0013.h5.part", "mine.h5"):
        (tmp_path / "fields" / name).write_text("x")
    (tmp_path / "sub" / "series.csv").write_text("x")
    prepare_folder(tmp_path, True, own_files())
    assert names(tmp_path) == ["fields", "my.csv", "notes.txt", "sub"]
    assert names(tmp_path / "fields") == ["mine.h5"]
    assert names(tmp_path / "sub") == ["series.csv"]


def test_overwrite_removes_a_link_and_not_what_it_points_to(tmp_path: Path) -> None:
    (tmp_path / "kept.csv").write_text("x")
    run = tmp_path / "run"
    run.mkdir()
    (run / "series.csv").symlink_to(tmp_path / "kept.csv")
    prepare_folder(run, True, own_files())
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
