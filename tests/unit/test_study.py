"""Study files, observed orders, and extrapolated values."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from support.inputs import ROOT, STUDY, examples

from pairsim.config.yaml_file import read_yaml
from pairsim.runtime.errors import InputError
from pairsim.solvers.curves.convergence import extrapolated, observed_order, pareto
from pairsim.sweeps.grid import grid_from, read_grid
from pairsim.sweeps.study import sampled, study_rows
from pairsim.sweeps.study_file import Study, read_study


def checked(tmp_path: Path, text: str) -> Study:
    path = tmp_path / "study.yaml"
    path.write_text(text)
    return read_study(path, read_yaml(path))


def test_order_is_the_slope_between_two_errors() -> None:
    assert observed_order((0.2, 0.1), (8e-3, 1e-3)) == pytest.approx(3)
    assert observed_order((0.2, 0.05), (-1.6e-2, 1e-3)) == pytest.approx(2)
    assert observed_order((0.2, 0.2), (1.0, 2.0)) is None
    assert observed_order((0.2, 0.1), (1.0, 0.0)) is None


def test_extrapolation_finds_limit_and_order_for_any_ratios() -> None:
    h = [0.3, 0.21, 0.1]
    found = extrapolated(h, [5 - 2 * size**2.5 for size in h])
    assert found == pytest.approx((5, 2.5))
    assert extrapolated(h, [1.0, 2.0, 1.5]) is None, "they go up and down"
    assert extrapolated(h, [1.0, 2.0, 4.0]) is None, "they do not converge"


def test_front_holds_what_no_other_beats() -> None:
    assert pareto([1, 2, 3, 4], [0.5, 0.6, 0.1, 0.1]) == [0, 2]
    assert pareto([2, 1, 1], [0.1, 0.3, 0.2]) == [2, 0]
    assert pareto([], []) == []


@pytest.mark.parametrize(
    ("entry", "settings"),
    [
        ("{mesh.Np: 9, output: {times: [0.005]}}", ()),
        ("{mesh.Np: 9, output.times: [0.005]}", ()),
        ("", ("output.times=[0.005]",)),
    ],
)
def test_times_can_only_be_given_by_at(entry: str, settings: tuple[str, ...], tmp_path: Path) -> None:
    path = tmp_path / "study.yaml"
    path.write_text(STUDY.replace("{mesh.Np: 8}", f"{{mesh.Np: 8}}, {entry}" if entry else "{mesh.Np: 8}", 1))
    with pytest.raises(InputError, match=r"output\.times: .*must be left out: it follows from at"):
        read_study(path, read_yaml(path), settings)


def test_discretisation_may_be_repeated_less_often_than_the_others(tmp_path: Path) -> None:
    study = checked(tmp_path, STUDY.replace("{mesh.Np: 16}", "{mesh.Np: 16, repeat: 1}") + "repeat: 3")
    assert study.repeat == (3, 3, 1, 3)
    assert study.varying == ("mesh.Np", "time.fixed_step"), "it is no key of a case"
    first, last = study.repetition(0)["run"], study.repetition(2)["run"]
    assert first.key == study.grids["run"].key, "a study without it goes on in the folders that it had"
    assert [case.parameters["mesh.Np"] for case in last.cases] == [8, 11, 8]
    path = tmp_path / "again.yaml"
    assert grid_from(path, last.content).key == last.key, "its folder's grid.yaml is that sweep's"
    assert not study.repetition(3)


def test_curve_is_compared_at_its_distances(tmp_path: Path) -> None:
    text = "command: curve\nbase: {beta: 0.4, De: 0, Ca_e: 0}\nat: [0.2, 0.1]\n"
    study = checked(tmp_path, text + "discretisations: [{mesh.Np: 8}, {mesh.Np: 10}]\n")
    assert [case.resolved["d"] for _, case in study.cases] == [[0.2, 0.1]] * 2


def test_critical_distances_of_curves_are_compared(tmp_path: Path) -> None:
    text = "command: curve\nquantity: d_cr\nbase: {beta: 0.4, De: 0.5, Ca_e: 0}\nat: [0.2, 0.3]\nexact: 0.25\n"
    study = checked(tmp_path, text + "discretisations: [{mesh.Np: 8}, {mesh.Np: 10}, {mesh.Np: 12}]\n")
    for (_, case), n, zeros in zip(study.cases, (100, 400, 1600), ("0.03,.1\n0.27,.9\n", "0.255,1\n", ""), strict=True):
        leave(tmp_path / "a", case.folder, n, 1.0, 0.0)
        header = "d,U_L,U_T,dU,D_L,D_T,dp,dp_plus"
        (tmp_path / "a" / case.folder / "curve.csv").write_text(f"{header}\n0.2,0,0,-1,0,0,0,0\n0.3,0,0,1,0,0,0,0\n")
        (tmp_path / "a" / case.folder / "equilibria.csv").write_text("d,peak\n" + zeros)
    rows = study_rows(study, [tmp_path / "a"])
    assert [row.get("d_cr") for row in rows] == [0.27, 0.255, None]
    assert [row.get("error") for row in rows] == [pytest.approx(0.02), pytest.approx(0.005), None]
    assert rows[1]["order_space"] == pytest.approx(2)
    assert rows[0]["dU@0.3"] == 1


def test_only_a_pair_has_one_critical_distance(tmp_path: Path) -> None:
    text = "command: curve\nquantity: d_cr\nbase: {particles: 3, beta: 0.4, De: 0.5, Ca_e: 0}\nat: [0.2, 0.3]\n"
    with pytest.raises(InputError, match="quantity: got 'd_cr'; must be one of D_1"):
        checked(tmp_path, text + "discretisations: [{mesh.Np: 8}, {mesh.Np: 10}]\n")


def test_one_particle_has_no_distances_to_be_compared_at(tmp_path: Path) -> None:
    text = "command: curve\nbase: {particles: 1, beta: 0.4, De: 0.5, Ca_e: 0.1}\n"
    text += "discretisations: [{mesh.Np: 8}, {mesh.Np: 10}]\n"
    assert checked(tmp_path, text + "quantity: U_1\n").at == ()
    with pytest.raises(InputError, match="there is only one particle"):
        checked(tmp_path, text + "at: 0.1\n")


def test_run_is_read_where_it_passes_a_distance_last() -> None:
    t = np.linspace(0, 1, 21)
    series = {"t": t, "d": 0.1 + (t - 0.4) ** 2, "dU": 2 * (t - 0.4)}
    found = sampled(series, "d", (0.11, 0.25))
    assert found is not None
    assert found["dU"] == pytest.approx([0.2, 2 * 0.15**0.5], rel=1e-6)
    assert sampled(series, "d", (0.11, 0.5)) is None, "it does not come to .5"
    assert sampled(series, "t", (0.512,)) is None, "a run lands on times that are compared"


def leave(folder: Path, name: str, unknowns: int, wall: float, dU: float) -> None:
    """Write the files of a finished run that a study reads."""
    (folder / name).mkdir(parents=True)
    record = {"status": "finished", "reason": "end", "unknowns": unknowns, "steps": 10, "wall_time": wall}
    record |= {"wall_time_by_phase": {"solve": wall / 2, "other": wall / 2}, "peak_memory": 1000 * unknowns}
    (folder / name / "run.json").write_text(json.dumps(record))
    header = "t,d,U_L,U_T,dU,D_L,D_T,dp,dp_plus"
    (folder / name / "series.csv").write_text(f"{header}\n0.01,.1,0,0,1.0,0,0,0,0\n0.02,.1,0,0,{dU!r},0,0,0,0\n")


def test_orders_times_and_errors_are_those_of_the_folders(tmp_path: Path) -> None:
    text = STUDY.replace(", {mesh.Np: 8, time.fixed_step: 0.005}", "") + "exact: [1, 2]\nrepeat: 2\n"
    study = checked(tmp_path, text)
    folders = [tmp_path / "a", tmp_path / "b"]
    for i, ((_, case), n) in enumerate(zip(study.cases, (100, 400, 1600), strict=True)):
        for folder, wall in zip(folders, (1.0, 2.0), strict=True):
            leave(folder, case.folder, n, wall * 4**i, 2 + 30 / n)  # second order in 1/sqrt(n)
    rows = study_rows(study, folders)
    assert [row["error"] for row in rows] == pytest.approx([0.3, 0.075, 0.01875])
    assert [row["relative_error"] for row in rows] == pytest.approx([0.15, 0.0375, 0.009375])
    assert [row.get("order_space") for row in rows] == [None, pytest.approx(2), pytest.approx(2)]
    assert (rows[2]["richardson_space"], rows[2]["richardson_order_space"]) == pytest.approx((2, 2))
    assert [row["wall_time"] for row in rows] == [1.5, 6, 24]
    assert [row["wall_time_spread"] for row in rows] == [1, 4, 16]
    assert rows[1]["wall_solve"] == 3
    assert all(row["pareto"] and not row["reference"] for row in rows)


@pytest.mark.parametrize("ending", ["failed", "timeout"])
def test_discretisation_that_failed_once_has_no_figures(ending: str, tmp_path: Path) -> None:
    study = checked(tmp_path, STUDY.replace(", {mesh.Np: 8, time.fixed_step: 0.005}", "") + "repeat: 2\n")
    folders = [tmp_path / "a", tmp_path / "b"]
    for (_, case), n in zip(study.cases, (100, 400, 1600), strict=True):
        for folder in folders:
            leave(folder, case.folder, n, 1.0, 2 + 30 / n)
    ill = study.cases[1][1].folder
    record = {"status": "failed", "reason": "mesh_failed", "steps": 3}
    if ending == "timeout":
        record = {"status": "running", "reason": ""}
        noted = {"folder": ill, "status": "timeout", "reason": "case_timeout"}
        (folders[0] / "sweep.json").write_text(json.dumps({"updated": 0, "cases": [noted]}))
    (folders[0] / ill / "run.json").write_text(json.dumps(record))
    rows = study_rows(study, folders)
    reason = {"failed": "mesh_failed", "timeout": "case_timeout"}[ending]
    assert [(row["status"], row["reason"]) for row in rows] == [
        ("finished", "end"),
        (ending, reason),
        ("finished", "end"),
    ]
    assert [row.get("error") is None for row in rows] == [False, True, True]
    assert "wall_time" not in rows[1]


def test_shipped_study_is_valid() -> None:
    path = ROOT / "configs" / "study.yaml"
    assert len(read_study(path, read_yaml(path)).cases) == 9


@pytest.mark.slow
def test_hard_cases_are_valid_and_all_different() -> None:
    files = {path.stem: path for path in (ROOT / "configs" / "hard").glob("*.yaml")}
    counts = {name: len(read_grid(path).cases) for name, path in files.items()}
    assert counts == {name: len(read_yaml(path)["cases"]) for name, path in files.items()}
    assert counts.keys() == {"run", "curve", "random"}
    assert sum(counts.values()) == 120


@pytest.mark.parametrize(("kind", "count"), [pytest.param("scenes", 286, marks=pytest.mark.slow), ("runs", 32)])
def test_scenes_of_error_bars_are_valid(kind: str, count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    import error_bars

    path = ROOT / "configs" / "error_bars" / f"{kind}.yaml"
    content = yaml.safe_load(path.read_text())
    scenes, meshes = content.pop("scenes"), content.pop("meshes")
    cases = [case for name, scene in scenes.items() for case in error_bars.cases(name, scene, meshes)]
    assert len(grid_from(path, content | {"cases": cases}).cases) == count


@pytest.mark.parametrize("path", sorted((ROOT / "configs" / "accuracy").glob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_studies_are_valid(path: Path) -> None:
    record = read_yaml(path)
    assert len(read_study(path, record).cases) == len(record["discretisations"])


@pytest.mark.parametrize("text", examples("how-to/study.md"))
def test_examples_of_the_docs_are_studies(text: str, tmp_path: Path) -> None:
    assert len(checked(tmp_path, text).cases) == 4
