"""`accuracy`: run.json tells which error was wanted and reached."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import pairsim
from pairsim.computing.accuracy import listed

PAIR: dict[str, Any] = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": "auto", "accuracy": "3%"}


@pytest.mark.slow
def test_a_curve_keeps_its_accuracy() -> None:
    result = pairsim.curve(PAIR | {"d": [0.3, 0.2, 0.1], "tol": 1.0})
    record, peak = result.record["adaptation"], result.table["dU"].abs().max()
    assert record["wanted"] == 0.03
    assert record["kept"]
    assert record["reference_dU"] == peak
    whole = result.table["dU_error"].max() / peak
    assert 0.9 * whole < record["reached"] < whole, "meshes cannot reduce what the motion leaves"
    assert 0.0003 < record["reached"] <= 0.03
    assert not result.warnings


@pytest.mark.slow
def test_what_could_not_be_kept_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pairsim.solvers.curves.adaptation.ROUNDS", 0)
    result = pairsim.curve(PAIR | {"accuracy": "0.1%", "beta": 0.2, "d": [0.1]})
    (warning,) = (w for w in result.warnings if "was not kept" in w)
    assert warning.startswith("accuracy: 0.1% was not kept at Ca_e = 0.1, d = 0.1: dU_error is up to ")
    assert not result.record["adaptation"]["kept"]
    assert result.record["adaptation"]["reached"] > 0.001


def test_a_given_mesh_is_not_adapted_and_named_where_it_does_not_do() -> None:
    bench = {"tube": "50 um", "particle": "20 um", "flow_rate": "1 ul/min", "viscosity": "1 Pa.s", "modulus": "2 kPa"}
    given = {"ends": "developed", "length": "auto", "mesh": {"Np": 8}, "accuracy": "0.1%"}
    result = pairsim.curve({"physical": bench | {"distance": ["5 um"]}, **given})
    assert result.record["adaptation"]["meshes"][0]["rounds"] == 0
    (warning,) = (w for w in result.warnings if "was not kept" in w)
    assert re.search(r"of \|dU\| \([.\d]+ um/s\); leave out mesh\.Np$", warning)


@pytest.mark.slow
def test_errors_are_compared_with_values_on_the_last_mesh() -> None:
    """On the first mesh dp_plus is larger by 0.7 %."""
    result = pairsim.pressure({"particles": 1, "beta": 0.4, "De": 0.2, "Ca_e": 0.05})
    assert sum(each["rounds"] for each in result.record["adaptation"]["meshes"]) > 0
    assert result.record["adaptation"]["reference_dp_plus"] == result.table["dp_plus"][0]


def test_places_have_what_is_the_same_once() -> None:
    places = [("De = 0.5", "Ca_e = 0.1", f"d = {d}") for d in (0.1, 0.17)]
    assert str(listed(places)) == "De = 0.5, Ca_e = 0.1, d = 0.1; d = 0.17"
    assert str(listed(places[:1])) == "De = 0.5, Ca_e = 0.1, d = 0.1"
    places = [(f"Ca_e = {Ca_e}", "d = 0.2") for Ca_e in (0.1, 0.2)]
    assert str(listed(places)) == "Ca_e = 0.1, d = 0.2; Ca_e = 0.2, d = 0.2"
    places = [("De = 1", f"d = 0.1, {d}") for d in (0.2, 0.3)]
    assert str(listed(places)) == "De = 1, d = 0.1, 0.2; d = 0.1, 0.3", "one of two distances is no place"


def test_dU_that_is_zero_asks_for_no_mesh() -> None:
    result = pairsim.curve(PAIR | {"Ca_e": 0, "d": [0.1]})
    assert result.record["adaptation"]["meshes"][0]["rounds"] == 0
    assert abs(result.table["dU"].iloc[0]) < 1e-11


RUN: dict[str, Any] = {"d0": 0.1, "dU_error": True, "accuracy": "1%", "time": {"end": 0.4}, "output": {"fields": False}}


@pytest.mark.slow
def test_a_run_keeps_its_accuracy(tmp_path: Path) -> None:
    result = pairsim.run(PAIR | RUN, folder=tmp_path / "run")
    record, table = result.record["adaptation"], result.table
    assert record["wanted"] == pytest.approx(0.01)
    assert record["kept"]
    assert record["reference_dU"] == table["dU_discrete"].abs().max()
    assert record["reached"] == pytest.approx(table["dU_error"][table["t"] > 5e-3].max() / record["reference_dU"])
    assert 0.001 < record["reached"] <= 0.01
    assert record["cells"] < 1.9, "finer than those of the coarse run"
    assert result.record["unknowns"] > record["coarse_run"]["unknowns"]
    assert record["coarse_run"]["t"] == 0.4
    percent = 100 * record["reached"]
    assert result.record["message"] == f"finished at t = 0.4; accuracy: 1% was kept, dU_error is up to {percent:.2g} %"


@pytest.mark.slow
def test_a_run_says_what_it_could_not_keep(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pairsim.solvers.transient.adaptation.FACTORS", (2.0, 2.0))
    result = pairsim.run(PAIR | RUN)
    (warning,) = (w for w in result.warnings if "was not kept" in w)
    assert warning.startswith("accuracy: 1% was not kept: dU_error is up to ")
    assert "1% was not kept" in result.record["message"]
    assert not result.record["adaptation"]["kept"]
    assert result.record["adaptation"]["reached"] > 0.01


@pytest.mark.long
def test_followed_zeros_keep_their_accuracy_at_the_requested_values() -> None:
    keys = {"beta": 0.2, "accuracy": "0.7%", "d": [0.05, 0.2], "along": {"Ca_e": [0.08, 0.1]}}
    result = pairsim.critical(PAIR | keys)
    record, table = result.record["adaptation"], result.table[result.table["kind"] == "wanted"]
    assert record["kept"]
    assert 1 <= max(mesh["rounds"] for mesh in record["meshes"]) <= 3
    assert len(table) == 2
    assert (table["d_error"] <= 1.01 * 0.007 * table["d_cr"]).all(), "with what moving adds"


@pytest.mark.slow
def test_the_force_on_a_moved_particle_keeps_its_accuracy() -> None:
    keys = {"particles": 1, "De": 0.3, "Ca_e": 0, "velocity": 1, "flow": 0, "length": 8, "accuracy": "1%"}
    result = pairsim.curve(PAIR | keys)
    record, row = result.record["adaptation"], result.table.iloc[0]
    assert record["kept"]
    assert record["meshes"][0]["rounds"] >= 1
    assert record["reached_by"]["F"] == pytest.approx(row["F_error_1"] / row["F_1"])
    assert record["reached_by"]["dp_plus"] == pytest.approx(row["dp_plus_error"] / abs(row["dp_plus"]))
    assert 0.005 < record["reached"] <= 0.01
    assert abs(row["F_1"] - 6.0134) < row["F_error_1"], "accuracy: 0.3%"
