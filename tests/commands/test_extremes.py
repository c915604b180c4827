"""A few steps at the ends of the ranges that a case file may use (`pairsim.config.values`)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pairsim

SMALL = {"ends": "developed", "mesh": {"Np": 8, "max_size": 0.3}, "output": {"fields": False}}
PAIR = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.2, "length": 2.4, "time": {"end": 1e-3}, "limits": {"max_steps": 3}}
EXTREMES: dict[str, dict[str, Any]] = {
    "almost Newtonian": {"De": 1e-6, "xi": 0.5},
    "De 1e4": {"De": 1e4},
    "almost rigid": {"Ca_e": 1e-6},
    "Ca_e 1e4": {"Ca_e": 1e4},
    "small particles": {"beta": 0.001},
    "as wide as the tube": {"beta": 0.999, "length": 4.0},
    "narrow rows": {"De": 1, "mesh": {**SMALL["mesh"], "rows": 0.05}},
    "short time": {"time": {"end": 1e-9, "first_step": 1e-9}},
    "shortest tube": {"particles": 0, "beta": None, "Ca_e": None, "d0": None, "length": 0.1},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", EXTREMES)
def test_computes_or_ends_with_a_reason(name: str) -> None:
    case = {key: value for key, value in (SMALL | PAIR | EXTREMES[name]).items() if value is not None}
    result = pairsim.run(case)
    assert result.status == "finished" or result.reason in ("max_steps", "mesh_failed", "step_too_small"), (
        result.message
    )
    assert len(result.table) > 0
    assert np.isfinite(result.table["dp_plus"].to_numpy()).all()
