"""Folders of results that version 0.3.0 wrote mean what they meant then: `support/folders-0.3.0.zip`, on few cells.

Their case files left out `ends` and `length`, which were periodic and 50 times the diameter; trains still are periodic.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest
import yaml
from support.commands import Pairsim
from support.inputs import ROOT

import pairsim as api
from pairsim.cases.identity import with_later_keys
from pairsim.computing.question import Question
from pairsim.questions.compute import Computation
from pairsim.questions.registry import QUESTIONS
from pairsim.record.column import Column, Columns
from pairsim.record.table_files import read_table

KINDS = "run", "curve", "critical", "train"
LENGTH = 20.0


@pytest.fixture
def old(tmp_path: Path) -> Path:
    with ZipFile(ROOT / "tests" / "support" / "folders-0.3.0.zip") as archive:
        archive.extractall(tmp_path)
    return tmp_path


@pytest.mark.parametrize("kind", KINDS)
def test_case_of_an_old_folder_is_that_which_was_computed(kind: str, old: Path) -> None:
    written = yaml.safe_load((old / kind / "case.yaml").read_text())
    case = api.load(old / kind / "case.yaml", kind=kind)
    assert (case.ends, written["ends"]) == ("periodic", "periodic")
    assert case.tube_length == (0.7 if kind == "train" else LENGTH)
    later = with_later_keys(written, type(case))
    assert {key: case.resolved()[key] for key in written} == {key: later[key] for key in written}


@pytest.mark.parametrize("kind", [*KINDS, "sweep"])
def test_old_folders_are_read(kind: str, old: Path, pairsim: Pairsim) -> None:
    for command in ("status", "table", "plot"):
        done = pairsim(command, kind)
        assert done.returncode == 0, done.stderr
    assert api.open(old / kind).status == "finished"


def test_an_old_run_goes_on_in_its_periodic_tube(old: Path, pairsim: Pairsim) -> None:
    before = read_table(old / "run" / "series.csv")
    done = pairsim("run", "--resume", "run", "--set", "time.end=0.004")
    assert done.returncode == 0, done.stderr
    case, after = yaml.safe_load((old / "run" / "case.yaml").read_text()), read_table(old / "run" / "series.csv")
    assert (case["ends"], case["length"]) == ("periodic", LENGTH)
    assert after["t"][-1] == 0.004
    assert after["dp"][-1] == pytest.approx(before["dp"][-1], rel=1e-3)  # of 20 D_c
    assert json.loads((old / "run" / "run.json").read_text())["status"] == "finished"


def test_an_old_run_goes_on_without_columns_that_runs_have_since(old: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    known: Question[Any] = QUESTIONS["run"]
    later = Column("later", "l", "a column of a later version", value=lambda _: 1.0)
    question = replace(known, tables={**known.tables, "series": Columns(known.tables["series"], later)})
    for place in ("pairsim.questions.run.QUESTION", "pairsim.questions.run.computation.QUESTION"):
        monkeypatch.setattr(place, question)
    before = read_table(old / "run" / "series.csv")
    result = Computation[Any](question)(old / "run" / "case.yaml", time={"end": 0.004}, folder=old / "run", resume=True)
    assert list(result.check().table) == list(before)
    new = Computation[Any](question)(old / "run" / "case.yaml", folder=old / "new").check()
    assert list(new.table) == [*before, "later"]


def test_a_case_that_leaves_out_the_ends_now_is_not_taken_for_an_old_one(old: Path, pairsim: Pairsim) -> None:
    (old / "pair.yaml").write_text("beta: 0.4\nCa_e: 0\nd0: 0.1\ntime: {end: 0.004}\noutput: {fields: false}\n")
    mesh = "mesh={Np: 6, max_size: 0.5, growth: 1, gap_cells: 1, wall_cells: 1}"
    done = pairsim("run", "pair.yaml", "--resume", "run", "--set", mesh)
    assert done.returncode == 2
    assert "length: got 'auto'; must be 20.0" in done.stderr
    assert "ends: got 'developed'; must be 'periodic'" in done.stderr
    again = pairsim("run", "pair.yaml", "--resume", "run", "--set", mesh, "--set", "ends=periodic")
    assert again.returncode == 0, again.stderr


def test_an_old_sweep_goes_on_where_its_ends_are_named(
    old: Path, pairsim: Pairsim, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pairsim.sweeps.folder.__version__", "0.4.0")
    grid = (old / "sweep" / "grid.yaml").read_text()
    (old / "grid.yaml").write_text(grid)
    done = pairsim("sweep", "grid.yaml", "-o", "sweep")
    assert done.returncode == 2
    assert "by pairsim 0.3.0, whose keys or defaults differ: CHANGELOG.md says what to write" in done.stderr
    (old / "grid.yaml").write_text(grid.replace("base:", "base:\n  ends: periodic"))
    again = pairsim("sweep", "grid.yaml", "-o", "sweep")
    assert again.returncode == 0, again.stderr
    assert "2 cases, 0 to do" in again.stderr
