"""`pairsim.curve` and `pairsim.critical`: files, starts from neighbours, typed ends, zeros; their shipped cases."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from studies.sphere_in_tube.references import K
from support.commands import Pairsim, interrupted
from support.inputs import ROOT

import pairsim
from pairsim.computing.case_files import read_case
from pairsim.computing.result import Result
from pairsim.plots.frames import outlines
from pairsim.questions.registry import QUESTIONS
from pairsim.record.table_files import read_table
from pairsim.record.xdmf import read_frame
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import NoSteadyState
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.curves.curve import Zero
from pairsim.solvers.curves.point import Point

CURVE = "beta: 0.4\nDe: 0\nCa_e: 0.1\nends: developed\nlength: auto\nmesh: {Np: 10}\nd: [0.3, 0.1]\n"
PAIR = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": "auto", "mesh": {"Np": 8}}
GIESEKUS = PAIR | {"De": 0.5, "Ca_e": 0.05, "length": 3.0, "mesh": {"Np": 8, "max_size": 0.15}}
GIESEKUS |= {"d": [0.3], "fields": [0.3]}
Fields = dict[str, Array]


@pytest.mark.slow
def test_curve_command(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text(CURVE + "fields: [0.1]\n")
    done = pairsim("curve", "case.yaml", "-o", "out", "--sensitivities")
    assert done.returncode == 0, done.stderr
    for words in ("Largest |dU|: (+", "Taylor parameters:", "Warning: mesh.Np = 10", "Took ", "Next: pairsim "):
        assert words in done.stderr, words
    header = (tmp_path / "out" / "curve.csv").read_text().splitlines()[0]
    assert header.startswith("d,U_L,U_T,dU,D_L,D_T,dp,dp_plus,newton,dU_held,")
    table = read_table(tmp_path / "out" / "curve.csv")
    assert set(table["d"][table["wanted"] == 1]) == {0.1, 0.3}
    assert np.array_equal(table["d"], np.sort(table["d"]))
    assert (table["wanted"] == 0).any()  # points are added where dU(d) is curved
    assert {"by_Ca_e", "by_beta"} < set(table)
    assert (tmp_path / "out" / "equilibria.csv").read_text().splitlines()[0].startswith("d,stable,slope,peak")
    assert {"fields.xdmf", "curve.png", "run.json"} < {p.name for p in (tmp_path / "out").iterdir()}
    assert pairsim("curve", "case.yaml", "-o", "out").returncode == 2  # results are not overwritten without --overwrite


def test_force_on_a_moved_sphere_is_written_answered_and_swept(tmp_path: Path, pairsim: Pairsim) -> None:
    keys = "beta: 0.5\nDe: 0\nCa_e: 0\nparticles: 1\nends: developed\nlength: 3\nmesh: {Np: 8}\nvelocity: 1\nflow: 0\n"
    (tmp_path / "case.yaml").write_text(keys)
    done = pairsim("curve", "case.yaml", "-o", "out")
    assert done.returncode == 0, done.stderr
    (force,) = read_table(tmp_path / "out" / "curve.csv")["F_1"]
    assert force == pytest.approx(K * 3 * np.pi * 0.5, rel=5e-3)
    assert f"F_1 = {int(force)}." in done.stderr
    assert QUESTIONS["curve"].values(tmp_path / "out")["F_1"] == force
    assert "F_1" in QUESTIONS["curve"].in_sweeps.columns(read_case(QUESTIONS["curve"], tmp_path / "case.yaml"))


def test_forces_on_a_moved_pair_are_swept(tmp_path: Path, pairsim: Pairsim) -> None:
    """Their velocities are given: a row of the results has no zeros and no peak of dU."""
    base = "beta: 0.5, De: 0, Ca_e: 0, ends: developed, length: 4, mesh: {Np: 8}, velocity: 1, flow: 0, d: [0.3, 0.5]"
    (tmp_path / "grid.yaml").write_text(f"command: curve\nbase: {{{base}}}\ngrid: {{velocity: [1, 2]}}\n")
    done = pairsim("sweep", "grid.yaml", "-o", "out")
    assert done.returncode == 0, done.stderr
    results = read_table(tmp_path / "out" / "results.csv")
    assert "dU_peak" not in results
    assert results["F_L"][1] == pytest.approx(2 * results["F_L"][0])
    curve = read_table(next(tmp_path.glob("out/*velocity1*/curve.csv")))
    assert results["F_L"][0] == curve["F_L"][0] != curve["F_L"][-1]


@pytest.mark.slow
def test_a_curve_whose_first_place_is_walked_to_has_the_stresses_of_that_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without a solution on larger cells, the continuation starts at small Ca_e and De on the cells of the curve."""

    def none(*_: object) -> None:
        raise NoSteadyState("there is no solution on larger cells")

    cold = fields_of(pairsim.curve(GIESEKUS))
    monkeypatch.setattr("pairsim.solvers.steady.first_solution.coarser", none)
    assert_same_fields(fields_of(pairsim.curve(GIESEKUS)), cold)


def fields_of(result: Result) -> Fields:
    """The fields at d .3 of a finished curve."""
    assert isinstance(result, pairsim.CurveResult)
    grid = result.check().fields(0.3)
    return {name: np.asarray(grid.point_data[name]) for name in grid.point_data.keys()}  # noqa: SIM118 - no mapping


def assert_same_fields(a: Fields, b: Fields) -> None:
    assert {"displacement", "tau_s_zz", "tau_p_zz", "tau_p_zz_extra", "pressure_extra"} < a.keys()
    for name, values in b.items():
        assert a[name] == pytest.approx(values, abs=1e-6 * np.nanmax(np.abs(values)), nan_ok=True), name


@pytest.mark.slow
def test_an_interrupted_curve_keeps_its_points(tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text(CURVE.replace("[0.3, 0.1]", "{start: 0.02, stop: 1, num: 400}"))
    curve = tmp_path / "out" / "curve.csv"
    record = interrupted(["curve", "case.yaml", "-o", "out"], curve, signal.SIGINT)
    assert record["points"] >= len(read_table(curve)["d"]) >= 4


SHORT = {
    "curve": ["d=[0.3, 0.1]", "max_points=2"],
    "critical": ["d=[0.15, 0.4]", "along={Ca_e: [0.05]}", "De=0.25"],
}


@pytest.mark.slow
@pytest.mark.parametrize("command", SHORT)
def test_shipped_case_runs(command: str, tmp_path: Path, pairsim: Pairsim) -> None:
    coarse = ["mesh.Np=8", "mesh.max_size=0.2", "ends=developed", "length=3"]
    settings = [word for setting in [*coarse, *SHORT[command]] for word in ("--set", setting)]
    done = pairsim(command, str(ROOT / "configs" / f"{command}.yaml"), "-o", "out", *settings)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / f"{command}.png").stat().st_size > 10_000
    assert len((tmp_path / "out" / f"{command}.csv").read_text().splitlines()) >= 2
    if command == "curve":
        assert pv.get_reader(tmp_path / "out" / "fields.xdmf").time_values == pytest.approx([0.1, 0.3])
    else:
        assert pairsim("plot", "out", "-o", "pictures").returncode == 0
        assert (tmp_path / "pictures" / "critical.png").is_file()


@pytest.mark.slow
def test_the_estimate_of_dU_is_the_difference_of_those_of_the_velocities() -> None:
    pair = pairsim.curve(GIESEKUS, De=0.3, Ca_e=[0, 0.1], fields=[]).check().table
    difference = pair["U_correction_L"] - pair["U_correction_T"]
    assert pair["dU_correction"].to_numpy() == pytest.approx(difference.to_numpy(), rel=1e-9)


@pytest.mark.slow
def test_the_end_of_steady_states_is_an_answer(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text(CURVE)
    settings = ["Ca_e=0.4", "d=[0.1]", "mesh.Np=8", "length=3"]
    done = pairsim("curve", "case.yaml", "-o", "out", *(word for each in settings for word in ("--set", each)))
    assert done.returncode == 5, done.stderr
    assert "There is no steady state: steady states end at Ca_e = 0.1" in done.stderr
    assert done.stderr.count("steady states end at") == 1
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    assert (record["status"], record["reason"]) == ("finished", "no_steady_state")
    Ca_e, error = record["end_of_branch"]["Ca_e"]
    way = read_table(tmp_path / "out" / "way.csv")
    assert way["Ca_e"][-1] < Ca_e + error
    assert (np.diff(way["Ca_e"]) > 0).all()
    last = read_frame(tmp_path / "out", 0)
    assert last.t == pytest.approx(0.1)
    for outline, D in zip(outlines(last), (way["D_T"][-1], way["D_L"][-1]), strict=True):
        z, r = np.ptp(outline[:, 0]), 2 * outline[:, 1].max()
        assert (z - r) / (z + r) == pytest.approx(D, abs=2e-3)
    assert (tmp_path / "out" / "fields.png").exists()
    assert "fields.png the last shapes" in done.stderr


@pytest.mark.slow
def test_zeros_before_one_that_was_lost_are_written(monkeypatch: pytest.MonkeyPatch) -> None:
    def zeros(branch: Branch, points: list[Point], _: object) -> Iterator[Zero]:
        yield Zero(points[1], branch.solver.snapshot, points[1].d)
        raise NoSteadyState("the second one was lost")

    monkeypatch.setattr("pairsim.questions.curve.computation.find_zeros", zeros)
    result = pairsim.curve(PAIR, d=[0.1, 0.2, 0.3], tol=1)
    assert (result.status, result.reason) == ("failed", "not_resolved")
    assert len(result.zeros) == 1


@pytest.mark.slow
def test_a_change_of_sign_between_two_meshes_is_no_zero_and_is_told() -> None:
    """On ten cells dU at d = .8 has the wrong sign; its neighbour .7 lies on a mesh made for another distance."""
    result = pairsim.curve(PAIR, mesh={"Np": 10, "max_size": 0.2}, tol=1, d=[0.7, 0.8]).check()
    assert result.table["dU"].iloc[0] > 0 > result.table["dU"].iloc[-1]
    assert len(result.zeros) == 0
    assert "Not decided between" in result.answer


@pytest.mark.slow
def test_critical_distances_follow_the_zeros_of_curves(tmp_path: Path) -> None:
    """At beta .4 there is an unstable distance, smaller for larger Ca_e, as in Fig. 11."""
    mesh = {"Np": 8, "max_size": 0.1}  # 0.1 is that of `accuracy: 5%`: no warning of it
    pair = {"beta": 0.4, "De": 0.5, "Ca_e": 0.1, "ends": "developed", "length": 3.0, "mesh": mesh}
    critical = pairsim.critical(pair, along={"Ca_e": [0.05, 0.1]}, d=[0.22, 0.28], folder=tmp_path / "out").check()
    rows = critical.table[critical.table["kind"] == "wanted"]
    assert rows["Ca_e"].tolist() == [0.05, 0.1]
    assert rows["branch"].nunique() == 1
    assert not rows["stable"].any()
    assert rows["d_error"].to_numpy() == pytest.approx((rows["dU_error"] / rows["slope"].abs()).to_numpy(), rel=1e-6)
    assert (rows["d_error"] > 0).all()
    found = rows.set_index("Ca_e")
    assert found.loc[0.1, "d_cr"] < found.loc[0.05, "d_cr"]
    zeros = pairsim.curve(pair, d={"start": 0.22, "stop": 0.28, "num": 3}, tol=1).check().zeros
    d_cr, d_error = found.loc[0.1, ["d_cr", "d_error"]]
    assert zeros["d"].tolist() == pytest.approx([d_cr], abs=float(d_error))
    assert zeros["stable"].tolist() == [False]
    assert {end["reason"] for end in critical.ends} == {"range"}
    assert not any("not resolved" in warning for warning in critical.warnings)
    assert any("was not kept" in warning for warning in critical.warnings)
    (picture,) = critical.plot(tmp_path)
    assert picture.stat().st_size > 10_000


def test_one_critical_distance_is_no_picture_and_plot_says_so(pairsim: Pairsim, tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text("{beta: 0.4, De: 0, Ca_e: 0, d: [0.1, 0.3], mesh: {Np: 8}}")
    pairsim("critical", "case.yaml", "-o", "out")
    done = pairsim("plot", "out")
    assert (done.returncode, done.stdout) == (0, "")
    assert "nothing to draw" in done.stderr


@pytest.mark.slow
def test_one_distance_of_a_row_may_vary_alone() -> None:
    row = {key: PAIR[key] for key in ("beta", "De", "Ca_e", "mesh")} | {"particles": 3, "length": 6}
    alone = pairsim.curve(row | {"d": [0.2, {"start": 0.1, "stop": 0.3, "num": 2}]}).check()
    lists = pairsim.curve(row | {"d": [[0.2, 0.3], [0.2, 0.1]]}).check().columns
    found = alone.columns
    assert set(found["d_1"]) == {0.2}
    assert (np.diff(found["d_2"]) > 0).all()
    assert len(found["d_2"]) > 2, "points no more than a factor of 1.8 apart"
    for gap in "12":
        off = abs(found[f"dU_{gap}"][[-1, 0]] - lists[f"dU_{gap}"])
        assert (off <= lists[f"dU_error_{gap}"]).all()
        assert (off < 0.05 * abs(lists["dU_1"])).all()
    slopes, at = alone.frame("slopes"), slice(1, None, 2)  # by the second distance
    held = (slopes["U_slope_held_2"] - slopes["U_slope_held_1"]).to_numpy()[at]
    assert found["slope_1"] == pytest.approx(held, rel=1e-6)
    least, most = np.sort(found["dU_1"])[[0, -1]]
    assert least < alone.dU(0.15, 1) < most
    assert "at d_2 = " in alone.answer
    with pytest.raises(pairsim.InputError, match="must be 2 numbers, one for each gap"):
        pairsim.load(
            row | {"d": [{"start": 0.1, "stop": 0.3, "num": 2}, {"start": 0.1, "stop": 0.3, "num": 2}]}, kind="curve"
        )
