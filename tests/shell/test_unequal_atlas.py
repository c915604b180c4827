"""Pairs whose beads differ, in an atlas and in its answers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.atlases import BOX, D, exact_of_unequal, make_unequal_atlas, random_pairs, unequal_curves_at
from support.commands import Pairsim

import pairsim as api
from pairsim.atlas.atlas import Atlas
from pairsim.atlas.unequal import UnequalAtlas, beads_of, gradients_of
from pairsim.lab.atlas_curve import curve_of_atlas
from pairsim.runtime.errors import InputError

PAIR: dict[str, Any] = {"betas": [0.42, 0.4], "De": 0.4, "Ca_es": [0.06, 0.04]}
BENCH = {"tube": "50um", "flow_rate": "1ul/min", "viscosity": "1Pa.s", "relaxation": "2ms", "liquid": "giesekus"}
UNEQUAL = BENCH | {"particle": ["20um", "19um"], "modulus": ["10kPa", "14kPa"]}


@pytest.fixture(scope="module")
def made() -> Atlas:
    return make_unequal_atlas()


@pytest.fixture(scope="module")
def pairs(made: Atlas) -> UnequalAtlas:
    assert made.of_unequal is not None
    return made.of_unequal


@pytest.fixture(scope="module")
def file(made: Atlas, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("atlas") / "a.npz"
    made.save(path)
    return path


def test_intervals_hold_a_known_function(pairs: UnequalAtlas) -> None:
    beads = random_pairs(100, 9)
    (dU, half_width), exact = pairs.velocities(beads), exact_of_unequal(beads)
    assert (np.abs(dU - exact) <= half_width).mean() > 0.93
    assert np.median(half_width / np.abs(exact).max(axis=1, keepdims=True)) < 0.01


def test_equal_beads_are_what_they_are_without_unequal_curves(made: Atlas, pairs: UnequalAtlas) -> None:
    table = curve_of_atlas(made, beta=0.4, De=0.4, Ca_e=0.05).table
    alone = curve_of_atlas(replace(made, unequal=None), beta=0.4, De=0.4, Ca_e=0.05).table
    same, too = ({k: v.tolist() for k, v in each.items() if k != "by_difference"} for each in (table, alone))
    assert same == too
    high, low = (pairs.at([0.4 * (1 - s / 2), 0.4 * (1 + s / 2)], 0.4, [0.05, 0.05]).dU for s in (1e-5, -1e-5))
    assert table["by_difference"] == pytest.approx((high - low) / 2e-5, rel=1e-3), "known from pairs that differ"
    near = pairs.at([0.4, 0.4 * (1 + 1e-7)], 0.4, [0.05, 0.05])
    assert near.dU == pytest.approx(table["dU"], abs=1e-6)
    assert (near.half_widths >= table["dU_error"] * (1 - 1e-6)).all()


def test_derivatives_are_differences(made: Atlas, pairs: UnequalAtlas) -> None:
    """With ratios held where both beads change; a difference, over the mean, is shared by both."""
    (first, second), De, (soft, softer), e = *PAIR.values(), 1e-5
    by = {
        "by_beta": (lambda s: ([first * (1 + s), second * (1 + s)], De, [soft, softer]), first),
        "by_De": (lambda s: ([first, second], De * (1 + s), [soft, softer]), De),
        "by_Ca_e": (lambda s: ([first, second], De, [soft * (1 + s), softer * (1 + s)]), soft),
        "by_difference": (lambda s: ([first * (1 - s / 2), second * (1 + s / 2)], De, [soft, softer]), 1.0),
        "by_stiffness": (lambda s: ([first, second], De, [soft * (1 + s / 2), softer * (1 - s / 2)]), 1.0),
    }
    table = curve_of_atlas(made, beta=PAIR["betas"], De=De, Ca_e=PAIR["Ca_es"], stiffness=True).table
    for name, (line, size) in by.items():
        high, low = (pairs.at(*line(s)).dU for s in (e, -e))
        assert table[name] == pytest.approx((high - low) / (2 * e * size), rel=1e-3, abs=1e-7), name


def test_columns_of_curves_become_derivatives_by_means_and_differences(made: Atlas, pairs: UnequalAtlas) -> None:
    beads = beads_of(PAIR["betas"], PAIR["De"], PAIR["Ca_es"])
    table = curve_of_atlas(made, beta=PAIR["betas"], De=PAIR["De"], Ca_e=PAIR["Ca_es"], stiffness=True).table
    by = {name: table[f"by_{name}"][None] for name in ("beta", "De", "Ca_e", "difference", "stiffness")}
    assert gradients_of(beads, by) == pytest.approx(pairs.slopes(beads), rel=1e-9)


def test_half_widths_grow_where_curves_nearby_are_uncertain(made: Atlas, pairs: UnequalAtlas) -> None:
    unequal, beads = pairs.unequal, random_pairs(50, 3)
    curves = replace(unequal.curves, errors=100 * unequal.curves.errors)
    wider = UnequalAtlas(made, replace(unequal, curves=curves))
    assert (wider.velocities(beads)[1] > 3 * pairs.velocities(beads)[1]).mean() > 0.9


def test_a_file_has_all_of_it(pairs: UnequalAtlas, file: Path) -> None:
    again = Atlas.load(file).of_unequal
    assert again is not None
    for one, other in zip(again.velocities(random_pairs(5, 1)), pairs.velocities(random_pairs(5, 1)), strict=True):
        assert one == pytest.approx(other, rel=1e-9)


def test_answers_are_those_of_the_pair(file: Path) -> None:
    answer = api.ask(**UNEQUAL, atlas=file)
    beads = beads_of(answer.case.betas, answer.case.De, answer.case.Ca_es)
    dU, half_width = answer.curve(D)
    assert (np.abs(dU - exact_of_unequal(beads)[0]) <= half_width).mean() > 0.9
    said = "\n".join(answer.findings())
    words = (
        "The beads differ: the leading one has 0.95 times the diameter and 1.4 times the modulus of the trailing one"
    )
    assert words in said
    assert "of equal size" not in said
    assert answer.travel("20um", "40um").time > 0


def test_a_case_file_may_have_lists(file: Path) -> None:
    case = {"beta": [0.4, 0.39], "De": 0.4, "Ca_e": [0.1, 0.07], "xi": 0.09, "d0": 0.2}
    answer = api.ask(case | {"liquid": {"law": "giesekus", "alpha": 0.2}}, atlas=file)
    exact = exact_of_unequal(beads_of([0.4, 0.39], 0.4, [0.1, 0.07]))[0]
    assert answer.columns["dU"] == pytest.approx(exact, abs=0.02 * np.abs(exact).max())


def test_what_is_not_known_of_the_experiment_changes_both_beads(file: Path) -> None:
    answer = api.ask(**UNEQUAL | {"viscosity": "1 +- 0.02 Pa.s", "flow_rate": "1 +- 0.02 ul/min"}, atlas=file)
    table, case, drawn = answer.columns, answer.case, answer.record["dU_inputs"]
    softness = max(case.Ca_es) * table["by_Ca_e"]  # proportional to the viscosity and to the velocity
    by_flow = softness + case.De * table["by_De"] + table["dU"]
    half = 0.02 * np.hypot(softness, by_flow)
    expected = 1e6 * answer.scales.velocity * half
    assert (drawn["largest"] - drawn["least"])[::4] / 2 == pytest.approx(expected, rel=0.15, abs=1e-3 * expected.max())


def test_a_spread_of_moduli_is_known(file: Path) -> None:
    given = BENCH | {"particle": "20um", "modulus": {"mean": "10kPa", "each": "1kPa"}}
    answer = api.ask(**given, atlas=file)
    change = answer.columns["by_stiffness"]
    assert answer.curve.unequal.deviations(D) == pytest.approx(
        np.hypot(2**0.5 * 0.1 * change, 0.1 / 2**0.5 * answer.case.Ca_e * answer.columns["by_Ca_e"]), rel=1e-6
    )
    assert "by_stiffness" not in api.ask(**given | {"modulus": "10kPa"}, atlas=file).columns


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"particle": ["20um", "17um"]},
            r"the ratio of the diameters, leading to trailing, is 0\.85, not between 0\.9 and 1",
        ),
        (
            {"modulus": ["10kPa", "30kPa"]},
            r"the ratio of the moduli, leading to trailing, is 3, not between 0\.5 and 2",
        ),
        ({"particle": ["25um", "26um"]}, r"beta = 0\.52 is not between 0\.3 and 0\.5; pairsim curve computes it"),
        ({"liquid": "oldroyd-b"}, "the liquid is Oldroyd-B, that of the atlas Giesekus"),
    ],
)
def test_beyond_the_ratios_or_the_box_it_says_so(file: Path, change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        api.ask(**UNEQUAL | change, atlas=file)


def test_options_have_one_value_for_each_bead(file: Path, pairsim: Pairsim) -> None:
    words = ["--tube", "50um", "--flow", "1ul/min", "--viscosity", "1Pa.s", "--relaxation", "2ms"]
    words += ["--liquid", "giesekus", "--at", "10um"]
    both = pairsim("ask", "--atlas", str(file), *words, "--particle", "20um,19um", "--modulus", "10kPa, 14kPa")
    assert both.returncode == 0, both.stderr
    repeated = ["--particle", "20um", "--particle", "19um", "--modulus", "10kPa", "--modulus", "14kPa"]
    assert pairsim("ask", "--atlas", str(file), *words, *repeated).stdout == both.stdout
    assert "At d = 10 um: dU = " in both.stdout


def test_pairs_that_are_drawn_are_in_the_box_and_the_ratios(pairs: UnequalAtlas) -> None:
    beads = random_pairs(300, 11)
    rounded = 1e-4  # of numbers with six digits, over what they differ by
    inside = pairs.unequal.ratios | {"moduli": (0.5 * (1 - rounded), 2 * (1 + rounded))}
    for name, values in beads.ratios.items():
        low, high = inside[name]
        assert ((values >= low * (1 - rounded)) & (values <= high * (1 + rounded))).mean() > 0.99
    assert (beads.betas >= BOX["beta"][0] - 1e-6).all()
    assert (beads.betas <= BOX["beta"][1] + 1e-6).all()
    assert unequal_curves_at(beads).dU.shape == (300, len(D))
