"""What critical distances are followed over: a number or a quantity on which liquid and softness alone depend."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pairsim
from pairsim.cases.followed_key import FollowedKey

BEADS = {"tube": "60 um", "flow_rate": "1 ul/min", "viscosity": "50 mPa s", "particle": "24 um", "modulus": "1 kPa"}
EXPERIMENT = {"physical": BEADS | {"relaxation": "6 ms", "distance": ["12 um", "18 um"]}}
NUMBERS = {"beta": 0.4, "De": 0.5, "Ca_e": [0.1, 0], "d": [0.2, 0.4]}
MODES = {
    "law": "modes",
    "modes": [{"law": "giesekus", "time": 1, "weight": 1}, {"law": "fene-p", "L2": 9, "time": 0.3, "weight": 2}],
}


@pytest.mark.parametrize(
    ("case", "key", "value"),
    [
        (NUMBERS, "De", 0.7),
        (NUMBERS, "Ca_e", 0.04),
        (NUMBERS, "xi", 0.3),
        (NUMBERS | {"liquid": "giesekus"}, "liquid.alpha", 0.3),
        (NUMBERS | {"liquid": {"law": "giesekus", "solvent": {"law": "power-law", "n": 0.7}}}, "liquid.solvent.n", 0.5),
        (NUMBERS | {"liquid": MODES}, "liquid.modes[1].L2", 20.0),
        (NUMBERS | {"solid": {"law": "mooney-rivlin", "c": 0.2}}, "solid.c", 0.4),
        (EXPERIMENT, "physical.flow_rate", "2 ul/min"),
        (EXPERIMENT, "physical.modulus", "3 kPa"),
        (EXPERIMENT, "physical.relaxation", "0.01 s"),
        (EXPERIMENT, "physical.viscosity", "30 mPa s"),
        (EXPERIMENT, "liquid.alpha", 0.1),
    ],
)
def test_materials_are_those_of_a_case_with_the_value(case: dict[str, Any], key: str, value: Any) -> None:
    followed = FollowedKey.of(pairsim.load(case, kind="critical"), key, [value])
    changed = pairsim.load(_with(case, key, value), kind="critical")
    liquid, solids = followed.materials(followed.values[0])
    assert liquid.structure == changed.liquid_model.structure
    assert liquid.numbers == pytest.approx(changed.liquid_model.numbers, rel=1e-9)
    for mine, other in zip(solids, changed.solid_models, strict=True):
        assert (mine is None) == (other is None), "rigid particles remain rigid"
        assert mine is None or other is None or mine.numbers == pytest.approx(other.numbers, rel=1e-9)
    if changed.scales is not None:
        scales = followed.scales(followed.values[0])
        assert scales is not None
        assert (scales.velocity, scales.stress) == pytest.approx((changed.scales.velocity, changed.scales.stress))


def _with(case: dict[str, Any], key: str, value: Any) -> dict[str, Any]:
    """A case with another value of a key, written out where the key is that of a mode or of a solvent."""
    if key == "Ca_e":
        return case | {"Ca_e": [value, 0]}
    if key == "liquid.modes[1].L2":
        return case | {"liquid": MODES | {"modes": [MODES["modes"][0], {**MODES["modes"][1], "L2": value}]}}
    if key == "liquid.solvent.n":
        return case | {"liquid": {"law": "giesekus", "solvent": {"law": "power-law", "n": value}}}
    return pairsim.load(case, kind="critical", **{key: value}).resolved()


@pytest.mark.parametrize(
    ("key", "values", "wrong"),
    [
        ("beta", [0.3, 0.4], "must be a number of the liquid or of the particles, or a quantity: De, xi"),
        ("physical.tube", ["50 um"], "must change nothing but the liquid and the softness of the particles, not beta"),
        ("physical.young", ["1 kPa"], "must be a quantity in physical of the case"),
        ("physical.flow_rate", [1.0], "must be quantities with their unit, such as 1 ul/min"),
        ("liquid.alpha", [0.1, 2.0], "must be values of liquid.alpha from 0 to 1"),
        ("physical.relaxation", ["1 ms", "1000 s"], "must be values of De from 1e-06 to 10000, where De = "),
        ("De", ["1 ms"], "must be numbers, since De is one"),
    ],
)
def test_what_cannot_be_followed_is_refused(key: str, values: list[Any], wrong: str) -> None:
    with pytest.raises(pairsim.InputError, match=wrong):
        pairsim.load(EXPERIMENT, kind="critical", along={key: values})


@pytest.mark.slow
def test_critical_distances_over_the_flow_rate_are_those_of_cases_with_it(tmp_path: Path) -> None:
    coarse = {"mesh": {"Np": 10}, "accuracy": "5%"}
    result = pairsim.critical(EXPERIMENT | coarse, along={"physical.flow_rate": ["1 ul/min", "1.2 ul/min"]}).check()
    table = result.table[result.table["kind"] == "wanted"]
    assert list(table["followed"]) == [1.0, 1.2]
    for rate, d in zip(table["followed"], table["d_cr"], strict=True):
        alone = pairsim.critical(EXPERIMENT | coarse, **{"physical.flow_rate": f"{rate} ul/min"}).check()
        assert alone.table["d_cr"].to_numpy() == pytest.approx([d], rel=5e-3), "on another mesh"
    physical = result.frame(physical=True)
    assert physical.attrs["units"]["followed"] == "μl/min"
    mean = physical["followed"] * 1e-9 / 60 / (np.pi / 4 * 60e-6**2)  # [m/s]
    assert physical["U"].to_numpy() == pytest.approx((1e6 * mean * result.table["U"]).to_numpy())
    assert physical["t_relax"].to_numpy() == pytest.approx((result.table["t_relax"] * 60e-6 / mean).to_numpy())
    assert "Over physical.flow_rate: " in result.answer
    assert [path.name for path in result.plot(tmp_path)] == ["critical.png"]


def test_a_critical_distance_has_the_velocity_of_the_pair() -> None:
    """At the distance at which both beads move alike, they do so about as fast as one on its own."""
    case = {"beta": 0.4, "De": 0.25, "Ca_e": 0.005, "d": [0.2, 0.35], "along": {"Ca_e": [0.005]}, "mesh": {"Np": 6}}
    found = pairsim.critical(case).check()
    (row,) = found.table.to_dict("records")
    assert abs(row["d_cr"] - 0.274) < row["d_error"]
    assert row["U"] == pytest.approx(1.667, rel=0.01), "as one on its own, on finer cells"
