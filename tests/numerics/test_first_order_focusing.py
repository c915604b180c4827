"""Focusing to first order, from the table that ships, beside what `pairsim focus` computes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pairsim as api
from pairsim.atlas.focusing import OFF, FirstOrderFocusing, Row
from pairsim.physics.liquids import NEWTONIAN
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.liquid import single
from pairsim.physics.liquids.power_law import PowerLaw
from pairsim.physics.liquids.white_metzner import WhiteMetzner
from pairsim.physics.solids.kelvin_voigt import KelvinVoigt
from pairsim.physics.solids.neo_hookean import NeoHookean

# Rates at N_p 24 over their limits for small particles, and by inertia over beta^3: docs/explanation/focus.md.
KNOWN = {
    0.1: (1.0072, 0.8260, 0.8230, 0.9490),
    0.3: (1.1784, 0.5646, 0.5374, 0.3270),
    0.5: (1.7589, 0.4608, 0.3731, 0.0758),
    0.6: (2.4114, 0.4586, 0.3292, 0.0269),
}


class TestRow:
    @pytest.mark.parametrize("beta", KNOWN)
    def test_rates_are_those_of_other_meshes(self, beta: float) -> None:
        row = Row.at(beta)
        assert row is not None
        soft, first, both, inertia = KNOWN[beta]
        assert row.by_Ca_e == pytest.approx(-100 / 9 * beta**2 * soft, rel=5e-3)
        assert row.by_Psi_1 == pytest.approx(-8 * beta**2 * first, rel=5e-3)
        assert row.by_Psi_1 - row.by_Psi_2 / 2 == pytest.approx(-8 * beta**2 * 20 / 9 * both, rel=5e-3)
        assert row.by_Re == pytest.approx(beta**3 * inertia, rel=1e-2)

    def test_diameters_between_those_of_the_table_are_interpolated_and_others_have_none(self) -> None:
        low, between, high = Row.at(0.4), Row.at(0.42), Row.at(0.45)
        assert low is not None
        assert between is not None
        assert high is not None
        assert high.by_Ca_e < between.by_Ca_e < low.by_Ca_e
        assert Row.at(0.09) is None
        assert Row.at(0.71) is None


class TestFirstOrder:
    def test_rates_of_softness_and_elasticity_add_up(self) -> None:
        liquid, solid = single(Giesekus(alpha=0.2), 0.01), NeoHookean(0.005)
        soft, elastic, both = (
            FirstOrderFocusing.of(0.4, *each) for each in ((solid, NEWTONIAN), (None, liquid), (solid, liquid))
        )
        assert soft is not None
        assert elastic is not None
        assert both is not None
        assert both.rate == pytest.approx(soft.rate + elastic.rate)
        assert both.share == pytest.approx(soft.share + elastic.share)
        assert both.tube < min(soft.tube, elastic.tube)
        assert both.Re_c == pytest.approx(soft.Re_c + elastic.Re_c)

    def test_the_largest_De_is_that_at_which_it_ends(self) -> None:
        found = FirstOrderFocusing.of(0.4, None, single(Giesekus(alpha=0.2), 0.01))
        assert found is not None
        for factor in (0.99, 1.01):
            there = FirstOrderFocusing.of(0.4, None, single(Giesekus(alpha=0.2), factor * found.De_most))
            assert there is not None
            assert there.holds == (factor < 1)

    def test_there_is_none_where_another_law_decides(self) -> None:
        assert FirstOrderFocusing.of(0.4, None, NEWTONIAN) is None
        assert FirstOrderFocusing.of(0.4, NeoHookean(0.01), single(PowerLaw(n=0.5))) is None
        assert FirstOrderFocusing.of(0.4, KelvinVoigt(0.01, eta=1.0), NEWTONIAN) is None
        thinning = FirstOrderFocusing.of(0.4, None, single(WhiteMetzner(n=0.5, Cu=1.0), 1e-3))
        assert thinning is not None
        assert not thinning.holds


@pytest.mark.slow
class TestBesideFocus:
    @pytest.mark.parametrize(
        "case",
        [
            {"beta": 0.4, "De": 0, "Ca_e": 0.03},
            {"beta": 0.3, "De": 0.02, "Ca_e": 0, "xi": 0.3, "liquid": {"law": "giesekus", "alpha": 0.5}},
            {"beta": 0.35, "De": 0.05, "Ca_e": 0.02, "liquid": {"law": "fene-p", "L2": 30}},
        ],
    )
    def test_it_is_within_its_error_where_it_holds(self, case: dict[str, Any]) -> None:
        computed = api.focus({**case, "particles": 1, "mesh": {"Np": 12, "max_size": 0.1}}).check().table
        loaded = api.load({**case, "particles": 1}, kind="focus")
        found = FirstOrderFocusing.of(case["beta"], loaded.solid_models[0], loaded.liquid_model)
        assert found is not None
        assert found.holds
        assert found.rate == pytest.approx(computed["growth"][0], rel=OFF)
        assert found.tube == pytest.approx(computed["tube"][0], rel=OFF)
        assert found.Re_c == pytest.approx(computed["Re_c"][0], rel=OFF)
        assert abs(found.rate / computed["growth"][0] - 1) < OFF * np.sqrt(found.share) + 0.01
