"""`pairsim curve` and `pairsim critical` as commands: files, input errors, MPI ranks, failures."""

from __future__ import annotations

import csv
import errno
import json
import re
import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
import yaml
from mpi4py import MPI
from support.commands import Pairsim, interrupted
from support.inputs import ROOT

from pairsim.config.case_file import curve_from_dict, load_critical, load_curve
from pairsim.drivers.curve import WarmStart, run_curve
from pairsim.drivers.progress import Reporter
from pairsim.drivers.session import Options
from pairsim.results.output import read_series
from pairsim.results.xdmf import FieldFrame, read_frame
from pairsim.runtime.errors import InputError, NoSteadyState
from pairsim.solvers.branch import Branch, Point
from pairsim.solvers.curve import Zero

CURVE = "beta: 0.4\nDe: 0\nCa_e: 0.1\nends: developed\nlength: auto\nmesh: {Np: 10}\nd: [0.3, 0.1]\n"
OPTIONS = Options(MPI.COMM_WORLD, overwrite=False, reporter=Reporter(), command="test")


def test_curve_command(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text(CURVE + "mesh_error: false\nfields: [0.1]\n")
    done = pairsim("curve", "case.yaml", "-o", "out", "--sensitivities")
    assert done.returncode == 0, done.stderr
    header = (tmp_path / "out" / "curve.csv").read_text().splitlines()[0]
    assert header.startswith("d,U_L,U_T,dU,D_L,D_T,dp,dp_plus,newton,drift,")
    table = read_series(tmp_path / "out" / "curve.csv")
    assert set(table["d"][table["wanted"] == 1]) == {0.1, 0.3}
    assert np.array_equal(table["d"], np.sort(table["d"]))
    assert (table["wanted"] == 0).any()  # points are added where dU(d) is curved
    assert {"by_Ca_e", "by_beta"} < set(table)
    assert (tmp_path / "out" / "equilibria.csv").read_text().splitlines()[0].startswith("d,stable,slope,peak")
    assert {"fields.xdmf", "curve.png", "run.json"} < {p.name for p in (tmp_path / "out").iterdir()}
    assert pairsim("curve", "case.yaml", "-o", "out").returncode == 2  # results are not overwritten without --overwrite


@pytest.mark.slow
def test_critical_command_follows_the_zero_of_the_curve(tmp_path: Path, pairsim: Pairsim) -> None:
    """At De .5, beta .4 there is an unstable distance, smaller for larger Ca_e; it is the zero of a curve there."""
    mesh = "mesh: {Np: 8, max_size: 0.1}\nmesh_error: false\n"  # 0.1 is that of `accuracy: 5%`: no warning of it
    keys = f"beta: 0.4\nDe: 0.5\nCa_e: 0.1\nends: developed\nlength: 4.2\n{mesh}"
    (tmp_path / "critical.yaml").write_text(keys + "along: {Ca_e: [0.05, 0.1]}\nd: [0.2, 0.35]\n")
    (tmp_path / "curve.yaml").write_text(keys + "d: {start: 0.2, stop: 0.35, num: 3}\ntol: 1.0e-3\n")
    done = pairsim("critical", "critical.yaml", "-o", "critical")
    assert done.returncode == 0, done.stderr
    with (tmp_path / "critical" / "critical.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["kind"] == "wanted"]
    assert [float(row["Ca_e"]) for row in rows] == pytest.approx([0.05, 0.1])
    assert [row["stable"] for row in rows] == ["false", "false"]
    assert float(rows[1]["d_cr"]) < float(rows[0]["d_cr"])
    assert pairsim("curve", "curve.yaml", "-o", "curve").returncode == 0
    with (tmp_path / "curve" / "equilibria.csv").open() as file:
        (zero,) = csv.DictReader(file)
    assert float(zero["d"]) == pytest.approx(float(rows[1]["d_cr"]), abs=1e-4)
    assert zero["stable"] == "false"
    record = json.loads((tmp_path / "critical" / "run.json").read_text())
    assert record["ends"][0]["reason"] == "range"
    assert ["not resolved" in warning for warning in record["warnings"]] == [
        False
    ]  # the only warning is that of a coarse mesh
    assert (tmp_path / "critical" / "critical.png").stat().st_size > 10_000


@pytest.mark.slow
def test_critical_follows_lines_over_De_with_their_errors(tmp_path: Path, pairsim: Pairsim) -> None:
    """Two lines over De: the softer pair has the smaller distance, as in Fig. 11."""
    keys = "beta: 0.4\nDe: 0.5\nCa_e: 0.1\nends: developed\nlength: 3\nmesh: {Np: 8, max_size: 0.15}\n"
    (tmp_path / "case.yaml").write_text(keys + "along: {De: [0.4, 0.5]}\nlines: {Ca_e: [0.02, 0.05]}\nd: [0.2, 0.35]\n")
    done = pairsim("critical", "case.yaml", "-o", "out")
    assert done.returncode == 0, done.stderr
    with (tmp_path / "out" / "critical.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["kind"] == "wanted"]
    assert {(row["Ca_e"], row["De"]) for row in rows} == {(c, d) for c in ("0.02", "0.05") for d in ("0.4", "0.5")}
    by_place = {(row["Ca_e"], row["De"]): row for row in rows}
    for De in ("0.4", "0.5"):
        assert float(by_place["0.05", De]["d_cr"]) < float(by_place["0.02", De]["d_cr"])
    assert len({row["branch"] for row in rows}) == 2
    for row in rows:
        error = float(row["mesh_error"]) / abs(float(row["slope"]))
        assert float(row["d_error"]) == pytest.approx(error, rel=1e-6)
        assert error > 0


@pytest.fixture(scope="module")
def cold(tmp_path_factory: pytest.TempPathFactory) -> FieldFrame:
    """The fields of a curve on its own."""
    return last_fields(tmp_path_factory.mktemp("cold"))


@pytest.mark.parametrize("first", [{"Ca_e": 0.005}, {"De": 0.25}])
def test_a_curve_that_starts_from_its_neighbour_has_the_stresses_of_its_own_parameters(
    first: dict[str, float], cold: FieldFrame, tmp_path: Path
) -> None:
    warm_start = WarmStart()
    last_fields(tmp_path / "neighbour", warm_start, **first)
    branch = warm_start._branch
    warm = last_fields(tmp_path / "warm", warm_start)
    assert warm_start._branch is branch is not None, "the second curve must have started from the first"
    warm_start.close()
    assert_same_fields(warm, cold)


def test_a_curve_whose_first_place_is_walked_to_has_the_stresses_of_that_place(
    cold: FieldFrame, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a solution on larger cells, the continuation starts at small Ca_e and De on the cells of the curve."""

    def none(*_: object) -> None:
        raise NoSteadyState("there is no solution on larger cells")

    monkeypatch.setattr("pairsim.solvers.branch.coarser", none)
    assert_same_fields(last_fields(tmp_path / "walked"), cold)


def last_fields(folder: Path, warm_start: WarmStart | None = None, **changes: float) -> FieldFrame:
    """The fields of a pair at d .3 in a Giesekus liquid."""
    keys = {"De": 0.5, "Ca_e": 0.05, "length": 3.0, "mesh_error": False, "d": [0.3], "fields": [0.3]}
    keys["mesh"] = {"Np": 8, "max_size": 0.15}
    made = curve_from_dict(yaml.safe_load(CURVE) | keys | changes, "test")
    assert run_curve(made, folder / "out", OPTIONS, warm_start=warm_start).status == "finished"
    return read_frame(folder / "out")


def assert_same_fields(a: FieldFrame, b: FieldFrame) -> None:
    assert {"displacement", "tau_s", "tau_p", "tau_p_zz_extra", "pressure_extra"} < a.point_data.keys()
    for name, values in b.point_data.items():
        assert a.point_data[name] == pytest.approx(values, abs=1e-6 * np.abs(values).max()), name


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_curve_keeps_its_points(number: int, tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text(CURVE.replace("[0.3, 0.1]", "{start: 0.02, stop: 1, num: 400}"))
    curve = tmp_path / "out" / "curve.csv"
    record = interrupted(["curve", "case.yaml", "-o", "out"], curve, number)
    assert record["points"] >= len(read_series(curve)["d"]) >= 4


SHORT = {
    "curve": ["d=[0.3, 0.1]", "max_points=2"],
    "critical": ["d=[0.15, 0.4]", "along={Ca_e: [0.05]}", "lines={De: [0.25]}"],
}


@pytest.mark.slow
@pytest.mark.parametrize("command", SHORT)
def test_shipped_case_runs(command: str, tmp_path: Path, pairsim: Pairsim) -> None:
    coarse = ["mesh.Np=8", "mesh.max_size=0.2", "mesh_error=false"]
    settings = [word for setting in [*coarse, *SHORT[command]] for word in ("--set", setting)]
    done = pairsim(command, str(ROOT / "configs" / f"{command}.yaml"), "-o", "out", *settings)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / f"{command}.png").stat().st_size > 10_000
    assert len((tmp_path / "out" / f"{command}.csv").read_text().splitlines()) >= 2
    if command == "curve":
        assert pv.get_reader(tmp_path / "out" / "fields.xdmf").time_values == pytest.approx([0.1, 0.3])
    assert pairsim("plot", "out", "-o", "pictures").returncode == 0
    assert (tmp_path / "pictures" / f"{command}.png").is_file()


BAD = {
    "no distances": ("curve", "d: null", "d", "is missing"),
    "a range that is none": ("curve", "d: {start: 0, stop: 1, num: 3}", "d", "start, stop, num"),
    "a list for another number of gaps": ("curve", "d: [[0.1, 0.2]]", "d", "numbers, or lists of 1"),
    "fields outside the curve": ("curve", "fields: [0.9]", "fields", "between the least and largest d"),
    "a key of run": ("curve", "d0: 0.1", "d0", "unknown key"),
    "no parameter": ("critical", "along: {beta: [0.1, 0.2]}", "along", "one of Ca_e and De"),
    "the same parameter twice": ("critical", "along: {De: [1]}\nlines: {De: [1]}", "lines", "the other parameter"),
    "softness of rigid particles": ("critical", "Ca_e: 0\nalong: {Ca_e: [0.1]}", "Ca_e", "one value above 0"),
    "three particles": ("critical", "particles: 3", "particles", "2: critical"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_case_is_refused(name: str, tmp_path: Path) -> None:
    command, text, key, allowed = BAD[name]
    changed = yaml.safe_load(text)
    plain = {"beta": 0.4, "De": 0.5, "Ca_e": 0.1} | ({"d": [0.1, 0.3]} if command == "curve" else {})
    path = tmp_path / "case.yaml"
    path.write_text(yaml.safe_dump(plain | changed))
    with pytest.raises(InputError) as caught:
        (load_curve if command == "curve" else load_critical)(path)
    assert re.match(rf"{path}(:\d+)?: {key}: ", str(caught.value))
    assert allowed in str(caught.value)


@pytest.mark.slow
def test_ranks_give_the_same_curve(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text(CURVE + "mesh_error: false\nmax_points: 3\ntol: 1e-3\n")
    settings = ["--set", "De=0.3", "--set", "mesh={Np: 8, max_size: 0.15}", "--set", "length=3"]
    for ranks in (1, 2):
        done = pairsim("curve", "case.yaml", "-o", f"n{ranks}", *settings, ranks=ranks)
        assert done.returncode == 0, done.stderr
    one, two = (read_series(tmp_path / f"n{ranks}" / "curve.csv") for ranks in (1, 2))
    assert one["d"] == pytest.approx(two["d"])
    assert len(one["d"]) == 3
    zeros = [csv.DictReader((tmp_path / f"n{ranks}" / "equilibria.csv").open()) for ranks in (1, 2)]
    (here,), (there,) = ([float(row["d"]) for row in rows] for rows in zeros)
    assert here == pytest.approx(there, abs=1e-8)
    for name in ("U_L", "dU", "D_L", "D_T", "dp_plus", "drift", "slope", "c_max"):
        assert one[name] == pytest.approx(two[name], abs=1e-8), name


@pytest.mark.slow
def test_no_steady_state_is_a_typed_failure(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text(CURVE)
    done = pairsim(
        "curve", "case.yaml", "-o", "out", "--set", "Ca_e=0.4", "--set", "mesh_error=false", "--set", "length=3"
    )
    assert done.returncode == 3, done.stderr
    assert "Traceback" not in done.stderr
    assert json.loads((tmp_path / "out" / "run.json").read_text())["reason"] == "no_steady_state"


def test_zeros_found_before_a_failure_are_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def zeros(branch: Branch, points: list[Point]) -> Iterator[Zero]:
        yield Zero(points[1], branch.snapshots)
        raise NoSteadyState("the second one was lost")

    monkeypatch.setattr("pairsim.drivers.curve.find_zeros", zeros)
    keys = {"mesh": {"Np": 8}, "mesh_error": False, "d": [0.1, 0.2, 0.3], "tol": 1}
    outcome = run_curve(curve_from_dict(yaml.safe_load(CURVE) | keys, "test"), tmp_path / "out", OPTIONS)
    assert (outcome.status, outcome.reason) == ("failed", "no_steady_state")
    assert len((tmp_path / "out" / "equilibria.csv").read_text().splitlines()) == 2


def test_curve_that_cannot_be_written_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("pairsim.drivers.session.write_table", full)
    made = curve_from_dict(yaml.safe_load(CURVE) | {"mesh": {"Np": 8}, "mesh_error": False}, "test")
    outcome = run_curve(made, tmp_path / "out", OPTIONS)
    assert (outcome.status, outcome.reason) == ("failed", "write_failed")
    assert json.loads((tmp_path / "out" / "run.json").read_text())["reason"] == "write_failed"


def test_change_of_sign_between_two_meshes_gives_a_warning_instead_of_a_zero(tmp_path: Path, pairsim: Pairsim) -> None:
    """On ten cells dU at d = .8 has the wrong sign; its neighbour .7 lies on a mesh made for another distance."""
    keys = "beta: 0.4\nDe: 0\nCa_e: 0.1\nends: developed\nlength: auto\nmesh: {Np: 10, max_size: 0.2}\n"
    (tmp_path / "case.yaml").write_text(keys + "tol: 1\nmesh_error: false\nd: [0.7, 0.8]\n")
    done = pairsim("curve", "case.yaml", "-o", "out")
    assert done.returncode == 0, done.stderr
    dU = read_series(tmp_path / "out" / "curve.csv")["dU"]
    assert dU[0] > 0 > dU[-1]
    assert len((tmp_path / "out" / "equilibria.csv").read_text().splitlines()) == 1
    warnings = json.loads((tmp_path / "out" / "run.json").read_text())["warnings"]
    assert sum("within the error of the mesh" in warning for warning in warnings) == 1
