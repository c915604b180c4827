"""Runs at held distances: what quasi-steady solutions at these distances are reached by."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pairsim
from pairsim.errors import InputError
from pairsim.runtime.errors import MeshFailure


@pytest.mark.slow
def test_a_soft_pair_held_at_its_distance_comes_to_the_quasi_steady_dU() -> None:
    case = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": "auto", "accuracy": "5%"}
    point = pairsim.curve({**case, "d": [0.1]}).table.iloc[0]
    run = pairsim.run({**case, "d0": 0.1, "hold": True, "dU_error": True, "mesh": {"Np": 20}, "time": {"end": 2.5}})
    end = run.table.iloc[-1]
    assert abs(run.table["d"] - 0.1).max() < 2e-3 * 0.1
    assert abs(end["dU"] - point["dU_held"]) < point["dU_error"] + end["dU_error"] < 0.03 * point["dU_held"]
    assert "held, dU is" in run.findings()[0]


GEL = {"law": "oldroyd-b", "yielding": {"law": "saramito-2007", "Bn": 0.5}}
PAIR = {"beta": [0.4, 0.3], "De": 0.5, "Ca_e": 0, "ends": "developed", "length": "auto", "accuracy": "5%"}
CHEAP = PAIR | {"liquid": GEL, "accuracy": "20%", "mesh": {"Np": 8, "max_size": 0.2}}
OUTPUT = {"output": {"times": [0.02, 0.04], "fields": False}}


@pytest.mark.slow
def test_a_curve_from_rest_has_dU_of_held_runs_after_a_time_twice_and_four_times_that(tmp_path: Path) -> None:
    curve = pairsim.curve({**CHEAP, "d": [0.1, 0.2], "after": 0.02}, folder=tmp_path / "curve").check()
    run = pairsim.run({**CHEAP, "d0": 0.2, "hold": True, "dU_error": True, "time": {"end": 0.08}, **OUTPUT}).check()
    row, series = curve.table.iloc[1], run.table
    for name, t in {"dU_quarter": 0.02, "dU_half": 0.04, "dU": 0.08}.items():
        assert row[name] == pytest.approx(np.interp(t, series["t"], series["dU"]), rel=1e-9)
    assert row["dU_error"] == pytest.approx(series["dU_error"].iloc[-1], rel=1e-9)
    assert "is taken at t = 0.08 after a start from rest, with the distances held; since t = 0.04 it has" in " ".join(
        curve.findings()
    )
    low, high = sorted(curve.table["dU"])
    assert low < curve.curve(0.15)[0] < high
    pairsim.plot(tmp_path / "curve", out=tmp_path)
    assert (tmp_path / "curve.png").stat().st_size > 10_000


def test_a_curve_from_rest_whose_first_run_has_no_mesh_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: Any) -> None:
        raise MeshFailure("no mesh around these spheres")

    monkeypatch.setattr("pairsim.solvers.meshed_scene.liquid_mesh", none)
    failed = pairsim.curve({**CHEAP, "d": [0.1, 0.2], "after": 0.02})
    assert (failed.status, failed.reason) == ("failed", MeshFailure.reason)
    assert failed.record["points"] == failed.record["steps"] == 0


@pytest.mark.parametrize(
    ("wrong", "key"),
    [
        ({"velocity": 1.0}, "velocity"),
        ({"fields": [0.1]}, "fields"),
        ({"after": 0}, "after"),
        ({"particles": 1, "d": None, "beta": 0.4}, "after"),
    ],
)
def test_what_a_curve_from_rest_does_not_go_with_is_refused(wrong: dict[str, Any], key: str) -> None:
    with pytest.raises(InputError, match=rf"\b{key}\b"):
        pairsim.load({**PAIR, "d": [0.1, 0.2], "after": 0.05, **wrong}, kind="curve")


def test_a_curve_of_steady_states_is_refused_below_a_yield_stress() -> None:
    with pytest.raises(InputError, match="the key after of a curve"):
        pairsim.load({**PAIR, "liquid": GEL, "d": [0.1, 0.2]}, kind="curve")
