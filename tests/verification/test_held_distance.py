"""Runs at held distances: what quasi-steady solutions at these distances are reached by."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pairsim


def test_a_soft_pair_held_at_its_distance_comes_to_the_quasi_steady_dU() -> None:
    case = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": "auto", "accuracy": "5%"}
    point = pairsim.curve({**case, "d": [0.1]}).table.iloc[0]
    run = pairsim.run({**case, "d0": 0.1, "hold": True, "dU_error": True, "mesh": {"Np": 20}, "time": {"end": 2.5}})
    end = run.table.iloc[-1]
    assert abs(run.table["d"] - 0.1).max() < 2e-3 * 0.1
    assert abs(end["dU"] - point["dU_held"]) < point["dU_error"] + end["dU_error"] < 0.03 * point["dU_held"]
    assert "held, dU is" in run.findings()[0]


def test_a_sweep_of_held_distances_has_dU_at_a_quarter_half_and_all_of_the_time(tmp_path: Path) -> None:
    """Which is a curve of liquids in which no state is steady by itself."""
    base = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "hold": True, "accuracy": "5%", "time": {"end": 0.1}}
    sweep = pairsim.sweep({"base": base, "grid": {"d0": [0.2]}}, folder=tmp_path)
    series, row = sweep.cases[0].table, sweep.table.iloc[0]
    for name, part in {"dU_quarter": 0.25, "dU_half": 0.5, "dU": 1.0}.items():
        assert row[name] == pytest.approx(np.interp(part * 0.1, series["t"], series["dU"]), rel=1e-12)
    assert len({row["dU_quarter"], row["dU_half"], row["dU"]}) == 3
