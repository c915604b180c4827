"""The study that judges what atlases say of pairs whose beads differ, without computing a curve."""

from __future__ import annotations

import sys

import numpy as np
import pandas as pd
import pytest
from support.inputs import ROOT

import pairsim
from pairsim.lab.atlas_curve import curve_of_atlas

sys.path.append(str(ROOT / "scripts"))

from studies.unequal_atlas import cases, judgement

STATED = "at least 95 % of dU are inside the half-widths of the atlas"


def test_pairs_are_valid_cases_in_the_box_and_the_ratios() -> None:
    drawn = cases.pairs()
    assert [liquid.name for liquid, _ in drawn].count("newtonian") == 10
    for liquid, pair in drawn:
        keys = {**liquid.keys, **pair, "ends": "developed", "length": "auto", "d": [0.1]}
        case = pairsim.load(keys, kind="curve")
        unequal = judgement.atlas_of(liquid.name).of_unequal
        assert unequal is not None
        assert unequal.outside(case.betas, case.De, case.Ca_es) == []


@pytest.fixture(scope="module")
def of_atlas() -> pd.DataFrame:
    """Rows of the study with what the atlas has in the place of computed dU."""
    rows = []
    for number, (liquid, pair) in enumerate(cases.pairs(4)):
        (beta_T, beta_L), (Ca_e_T, Ca_e_L) = pair["beta"], pair["Ca_e"]
        curve = curve_of_atlas(judgement.atlas_of(liquid.name), beta=pair["beta"], De=pair["De"], Ca_e=pair["Ca_e"])
        about = {"part": f"{number:02d}-{liquid.name}", "liquid": liquid.name, "De": pair["De"], "ended": None}
        about |= {"beta_T": beta_T, "beta_L": beta_L, "Ca_e_T": Ca_e_T, "Ca_e_L": Ca_e_L, "computed": "2026-11-29"}
        for d in cases.DISTANCES:
            rows.append({**about, "d": d, "dU": curve.numbers(d)[0], "dU_error": 0.0})
    return pd.DataFrame(rows)


def test_what_is_off_by_more_than_a_half_width_is_outside(of_atlas: pd.DataFrame) -> None:
    parts = cases.parts(False)
    assert judgement.statements(of_atlas, parts)[STATED].verdict == "holds"
    table = judgement.judged(of_atlas)
    off = of_atlas.assign(dU=of_atlas["dU"] * (1 + 1e-9))
    wrong = np.arange(len(off)) < 0.2 * len(off)
    size = np.abs(table["value"]).max()
    off.loc[wrong, "dU"] += 3 * size
    found = judgement.statements(off, parts)
    assert found[STATED].verdict == "does not hold"
    assert found[STATED].numbers == f"{(~wrong).sum()} of {len(off)}: {100 * (~wrong).mean():.1f} %"
    assert found["all curves are computed"].verdict == "does not hold"


def test_the_page_says_which_points_are_outside(of_atlas: pd.DataFrame) -> None:
    parts = cases.parts(False)
    assert judgement.blocks(of_atlas, parts)["outside"] == "None.\n"
    off = of_atlas.copy()
    off.loc[3, "dU"] += 1.0
    assert "| 00-giesekus | 0.2 |" in judgement.blocks(off, parts)["outside"]
