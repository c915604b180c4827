"""Study files, and what study.csv has of the folders of the cases."""

from __future__ import annotations

import json
from math import isnan, nan
from pathlib import Path

import pandas as pd
import pytest
from support.commands import Pairsim
from support.inputs import ROOT, STUDY, examples

from pairsim.cases.yaml_file import read_yaml
from pairsim.record.table_files import read_table
from pairsim.runtime.errors import InputError
from pairsim.sweeps.grid import Grid
from pairsim.sweeps.study import FAMILIES, families, read_study, study_table
from pairsim.sweeps.study_file import StudyFile
from pairsim.sweeps.study_plots import plot_study


def checked(tmp_path: Path, text: str) -> tuple[StudyFile, Grid]:
    path = tmp_path / "study.yaml"
    path.write_text(text)
    return read_study(path)


def test_cases_have_the_places_of_the_comparison(tmp_path: Path) -> None:
    _, grid = checked(tmp_path, STUDY)
    assert [case.case.resolved()["output"]["times"] for case in grid.cases] == [[0.01, 0.02]] * 4
    text = "command: curve\nbase: {beta: 0.4, De: 0, Ca_e: 0}\nat: [0.2, 0.1]\n"
    _, grid = checked(tmp_path, text + "discretisations: [{mesh.Np: 8}, {mesh.Np: 10}]\n")
    assert [case.case.resolved()["d"] for case in grid.cases] == [[0.2, 0.1]] * 2


def test_quantity_is_a_column_of_the_results(tmp_path: Path) -> None:
    text = "command: curve\nbase: {particles: 1, beta: 0.4, De: 0.5, Ca_e: 0.1}\n"
    text += "discretisations: [{mesh.Np: 8}, {mesh.Np: 10}]\n"
    assert checked(tmp_path, text + "quantity: U_1\n")[0].places == []
    with pytest.raises(InputError, match="quantity: got 'dU'; must be one of U_1"):
        checked(tmp_path, text)


THREE = STUDY.replace(", {mesh.Np: 8, time.fixed_step: 0.005}", "")
FOUR = STUDY.replace("{mesh.Np: 8, time.fixed_step: 0.005}", "{mesh.Np: 40}")


def leave(folder: Path, unknowns: int, wall: float, dU: float) -> None:
    """Write the files of a finished run that a study reads."""
    folder.mkdir(parents=True)
    record = {"status": "finished", "reason": "end", "unknowns": unknowns, "steps": 10, "wall_time": wall}
    (folder / "run.json").write_text(json.dumps(record))
    (folder / "series.csv").write_text(f"t,d,dU\n0.0,0.1,0.5\n0.01,0.1,{dU - 1}\n0.02,0.1,{dU}\n")


def test_orders_times_and_errors_are_those_of_the_folders(tmp_path: Path) -> None:
    file, grid = checked(tmp_path, FOUR)
    for i, (case, n) in enumerate(zip(grid.cases, (100, 400, 1600, 10**12), strict=True)):
        leave(tmp_path / case.folder, n, 4.0**i, 2 + 30 / n)  # second order in 1/sqrt(n)
    table = study_table(file, grid, tmp_path)
    assert table["error"].tolist() == pytest.approx([0.3, 0.075, 0.01875, nan], nan_ok=True)
    assert table["relative_error"].tolist() == pytest.approx([0.15, 0.0375, 0.009375, nan], nan_ok=True)
    assert table["order_space"].tolist() == pytest.approx([nan, 2, 2, nan], nan_ok=True)
    assert table["wall_time"].tolist() == [1, 4, 16, 64]
    assert table["reference"].tolist() == [False, False, False, True]


def test_the_finest_is_the_reference(tmp_path: Path) -> None:
    file, grid = checked(tmp_path, THREE)
    for case, n in zip(grid.cases, (100, 1600, 400), strict=True):
        leave(tmp_path / case.folder, n, 1.0, 2 + 30 / n)
    table = study_table(file, grid, tmp_path)
    assert table["reference"].tolist() == [False, True, False]
    assert table["error"].tolist() == pytest.approx([30 / 100 - 30 / 1600, nan, 30 / 400 - 30 / 1600], nan_ok=True)
    assert table["dU@0.01"].tolist() == pytest.approx([1.3, 1 + 30 / 1600, 1.075])


def test_discretisation_that_failed_has_no_figures(tmp_path: Path) -> None:
    file, grid = checked(tmp_path, THREE)
    for case, n in zip(grid.cases, (100, 400, 1600), strict=True):
        leave(tmp_path / case.folder, n, 1.0, 2 + 30 / n)
    record = {"status": "failed", "reason": "mesh_failed", "steps": 3}
    (tmp_path / grid.cases[1].folder / "run.json").write_text(json.dumps(record))
    table = study_table(file, grid, tmp_path)
    assert table["status"].tolist() == ["finished", "failed", "finished"]
    assert table["reason"].tolist() == ["end", "mesh_failed", "end"]
    assert table["error"].isna().tolist() == [False, True, True]
    assert isnan(table["wall_time"][1])


def test_a_study_of_curves_is_drawn_and_one_of_version_0_2_refused(tmp_path: Path) -> None:
    rows = "8,finished,2086,1.7,0.0043,5e-5\n10,finished,2494,1.9,0.0042,1e-5\n"
    (tmp_path / "study.csv").write_text(f"mesh.Np,status,unknowns,wall_time,dU@0.2,error\n{rows}")
    with pytest.raises(InputError, match="must be the folder of a study of this version"):
        plot_study(tmp_path)
    (tmp_path / "sweep.json").write_text('{"name": "study", "command": "curve", "cases": []}')
    assert plot_study(tmp_path) == [tmp_path / "study.png"]


def test_families_differ_in_the_mesh_or_in_the_steps_only() -> None:
    rows = [(8, 1e-3, None, 100, 10), (16, 1e-3, None, 400, 10), (16, 1e-4, None, 400, 20), (16, 1e-4, 0.1, 400, 40)]
    table = pd.DataFrame(rows, columns=["mesh.Np", "time.tol", "time.fixed_step", "unknowns", "steps"])
    table.insert(3, "status", "finished")
    table["error"] = [0.8, 0.1, 0.1, 0.2]
    space, time = ({tuple(each.index): each["order"].iloc[-1] for each in families(table, name)} for name in FAMILIES)
    assert space == {
        (0, 1): pytest.approx(3),
        (2,): pytest.approx(nan, nan_ok=True),
        (3,): pytest.approx(nan, nan_ok=True),
    }
    assert time.keys() == {(0,), (1, 2), (3,)}, "fixed steps are apart"


ACCURACY = ROOT / "scripts" / "studies" / "accuracy" / "cases"
STUDIES = [ROOT / "configs" / "study.yaml", *sorted(ACCURACY.glob("*.yaml")), *sorted(ACCURACY.glob("quick/*.yaml"))]


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_shipped_studies_are_valid(path: Path) -> None:
    _, grid = read_study(path)
    assert len(grid.cases) == len(read_yaml(path)["discretisations"])


@pytest.mark.parametrize("text", examples("how-to/study.md"))
def test_examples_of_the_docs_are_studies(text: str, tmp_path: Path) -> None:
    assert len(checked(tmp_path, text)[1].cases) == 4


@pytest.mark.slow
def test_a_study_reports_speed_against_error(tmp_path: Path, pairsim: Pairsim) -> None:
    """It draws them; the same command computes no case again."""
    (tmp_path / "study.yaml").write_text(STUDY)
    assert pairsim("study", "study.yaml", "-o", "out", "-q").returncode == 0
    table = read_table(tmp_path / "out" / "study.csv")
    assert table["mesh.Np"].tolist() == [8, 11, 16, 8]
    assert table["reference"].tolist() == [False, False, True, False]
    assert table["steps"][3] == 4
    assert table["error"][1] < table["error"][0]
    assert (table["wall_time"] > 0).all()
    assert {*table["dU@0.02"]} == {read_table(path)["dU"][-1] for path in tmp_path.glob("out/*/series.csv")}
    assert (tmp_path / "out" / "study.png").stat().st_size > 10_000
    records = {path: path.read_text() for path in tmp_path.glob("out/*/run.json")}
    assert len(records) == 4
    (tmp_path / "out" / "study.csv").unlink()
    assert pairsim("study", "study.yaml", "-o", "out", "-q").returncode == 0
    assert all(path.read_text() == text for path, text in records.items())
    assert (tmp_path / "out" / "study.csv").is_file()
