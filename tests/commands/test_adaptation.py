"""`accuracy` that is no level: run.json tells which error was wanted and reached, and keys under mesh switch it off."""

from __future__ import annotations

from typing import Any

import pytest

import pairsim

PAIR: dict[str, Any] = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": "auto", "accuracy": "3%"}


@pytest.mark.slow
def test_a_curve_keeps_its_accuracy() -> None:
    result = pairsim.curve(PAIR | {"d": [0.3, 0.2, 0.1], "tol": 1.0})
    record, peak = result.record["adaptation"], result.table["dU"].abs().max()
    assert record["wanted"] == 0.03
    assert record["kept"]
    assert record["reference_dU"] == peak
    assert record["scout_d"] == [0.3, 0.2, 0.1]
    assert record["reached"] == pytest.approx(result.table["dU_error"].max() / peak)
    assert 0.003 < record["reached"] <= 0.03
    assert not result.warnings


@pytest.mark.slow
def test_what_could_not_be_kept_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pairsim.solvers.adaptation.ROUNDS", 0)
    result = pairsim.curve(PAIR | {"accuracy": "0.5%", "beta": 0.2, "d": [0.1]})
    (warning,) = (w for w in result.warnings if "was not kept" in w)
    assert warning.startswith("accuracy: 0.5% was not kept at Ca_e = 0.1, d = 0.1: dU_error is up to ")
    assert not result.record["adaptation"]["kept"]
    assert result.record["adaptation"]["reached"] > 0.005


def test_a_given_mesh_is_not_adapted() -> None:
    result = pairsim.curve(PAIR | {"d": [0.1], "mesh": {"Np": 10}})
    assert "adaptation" not in result.record
    assert "dU_error" in result.table


def test_dU_that_is_zero_asks_for_no_mesh() -> None:
    result = pairsim.curve(PAIR | {"Ca_e": 0, "d": [0.1]})
    assert "adaptation" not in result.record
    assert abs(result.table["dU"].iloc[0]) < 1e-11


@pytest.mark.slow
def test_a_run_has_the_cells_of_the_quasi_steady_pair() -> None:
    result = pairsim.run(PAIR | {"d0": 0.1, "time": {"end": 0.002}})
    record = result.record["adaptation"]
    assert record["kept"]
    assert [mesh["d"] for mesh in record["meshes"]] == [0.1]
    assert record["scout_d"] == [0.8, 0.4, 0.2, 0.1, 0.05]
