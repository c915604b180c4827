"""Differences between the diameters of two particles, as percentages in the `physical` block."""

from __future__ import annotations

from pathlib import Path

import pytest

import pairsim as api
from pairsim.cases.quantity_text import percentage
from pairsim.runtime.errors import InputError
from pairsim.sweeps.grid import read_grid


@pytest.mark.parametrize(
    ("text", "found"),
    [("0 %", (0.0, 0.0)), ("-1.5 +- 0.5 %", (-0.015, 0.005)), ("+- 2%", (0.0, 0.02)), ("1% +- 1%", (0.01, 0.01))],
)
def test_percentages(text: str, found: tuple[float, float]) -> None:
    assert percentage(text) == pytest.approx(found)


@pytest.mark.parametrize("text", ["", "%", "1", "100 %", "1 um", "1 +- 200 %", 0.01])
def test_what_is_no_percentage_is_refused(text: object) -> None:
    with pytest.raises(ValueError, match="must be a percentage between -100 % and 100 %"):
        percentage(text)


def test_a_sweep_takes_beads_of_several_differences(tmp_path: Path) -> None:
    block = "tube: 50um, particle: 20um, particle_difference: 0 +- 1 %, flow_rate: 1ul/min, viscosity: 1Pa.s"
    (tmp_path / "grid.yaml").write_text(
        f"command: curve\nbase: {{physical: {{{block}}}, Ca_e: 0, d: [0.1, 0.2]}}\n"
        "grid: {physical.particle_difference: [0 %, 0 +- 1 %, 2 %]}\n"
    )
    grid = read_grid(tmp_path / "grid.yaml")
    assert [each.case.betas for each in grid.cases] == [(0.4, 0.4), (0.4, 0.4), pytest.approx((0.396, 0.404))]


def test_beads_of_a_given_difference_are_unequal() -> None:
    block = {
        "tube": "50um",
        "particle": "20um",
        "particle_difference": "1 +- 0.2 %",
        "flow_rate": "1ul/min",
        "viscosity": "1Pa.s",
    }
    case = api.load({"physical": block, "Ca_e": 0, "d": [0.1, 0.2]}, kind="curve")
    assert case.betas == pytest.approx((0.398, 0.402))
    several = {"particle": ["20um", "21um"]}
    with pytest.raises(InputError, match=r"must go with a single diameter physical\.particle, the mean of both"):
        api.load({"physical": block | several, "Ca_e": 0, "d": [0.1, 0.2]}, kind="curve")
    with pytest.raises(InputError, match="it applies to two particles only"):
        api.load({"physical": block, "Ca_e": 0, "particles": 3, "d": [0.1, 0.2]}, kind="curve")
