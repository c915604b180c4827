"""Time steps with an estimated error above the requested accuracy give a warning."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import pairsim

PAIR = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "ends": "developed", "length": 3, "mesh": {"Np": 8}}
PAIR |= {"output": {"fields": False}}


def warnings(result: Any) -> list[str]:
    """Warnings of a result about time steps."""
    return [warning for warning in result.check().warnings if "time steps" in warning]


@pytest.mark.parametrize(
    ("setting", "warned"),
    [({"tol": 3e-4}, False), ({"tol": 0.1}, True), ({"fixed_step": 0.1}, True), ({"fixed_step": 0.02}, True)],
)
def test_long_steps_are_reported(setting: dict[str, float], warned: bool, capfd: pytest.CaptureFixture[str]) -> None:
    assert bool(warnings(pairsim.run(PAIR, time={"end": 1, **setting}, progress=True))) == warned
    assert ("time steps may cause" in capfd.readouterr().err) == warned


@pytest.mark.slow
def test_long_steps_before_a_stop_are_reported_after_it(tmp_path: Path) -> None:
    long_steps = PAIR | {"time": {"fixed_step": 0.1, "end": 0.8}}
    whole = pairsim.run(long_steps)
    pairsim.run(long_steps, time={"end": 0.2}, folder=tmp_path).check()
    resumed = pairsim.run(long_steps, folder=tmp_path, resume=True)
    assert warnings(resumed) == warnings(whole) != []
