"""Runs at held distances: what quasi-steady solutions at these distances are reached by."""

from __future__ import annotations

import pairsim


def test_a_soft_pair_held_at_its_distance_comes_to_the_quasi_steady_dU() -> None:
    case = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": "auto", "accuracy": "5%"}
    point = pairsim.curve({**case, "d": [0.1]}).table.iloc[0]
    run = pairsim.run({**case, "d0": 0.1, "hold": True, "dU_error": True, "mesh": {"Np": 20}, "time": {"end": 2.5}})
    end = run.table.iloc[-1]
    assert abs(run.table["d"] - 0.1).max() < 2e-3 * 0.1
    assert abs(end["dU"] - point["dU_held"]) < point["dU_error"] + end["dU_error"] < 0.03 * point["dU_held"]
    assert "held, dU is" in run.findings()[0]
