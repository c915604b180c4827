"""Liquids in slow flow: the normal stress coefficients of a second-order fluid, and how far shear departs from them."""

from __future__ import annotations

import pytest

from pairsim.physics.liquids import NEWTONIAN, Liquid
from pairsim.physics.liquids.carreau import Carreau
from pairsim.physics.liquids.conformation import ConformationLaw
from pairsim.physics.liquids.fene_p import FeneP
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.liquid import single
from pairsim.physics.liquids.newtonian import Newtonian
from pairsim.physics.liquids.oldroyd_b import OldroydB
from pairsim.physics.liquids.ptt import LinearPTT
from pairsim.physics.liquids.white_metzner import WhiteMetzner
from pairsim.physics.slow_flow import SecondOrderFluid, departure, slower


class TestSecondOrderFluid:
    @pytest.mark.parametrize("law", [OldroydB(), FeneP(L2=20.0), LinearPTT(epsilon=0.3)])
    def test_the_first_coefficient_is_twice_the_relaxation_time_times_the_viscosity_of_the_polymer(
        self, law: ConformationLaw
    ) -> None:
        slow = SecondOrderFluid.of(single(law, 0.3, 0.1))
        assert slow.Psi_1 == pytest.approx(2 * 0.9 * 0.3, rel=1e-4)
        assert slow.Psi_2 == pytest.approx(0, abs=1e-9)

    def test_the_second_one_of_a_giesekus_liquid_is_minus_half_of_alpha_times_that(self) -> None:
        slow = SecondOrderFluid.of(single(Giesekus(alpha=0.4), 0.3, 0.1))
        assert slow.Psi_2 == pytest.approx(-0.2 * slow.Psi_1, rel=1e-4)

    def test_those_of_several_modes_add_up(self) -> None:
        modes = OldroydB(time=1.0, weight=0.25), Giesekus(time=3.0, weight=0.75, alpha=0.2)
        slow = SecondOrderFluid.of(Liquid(Newtonian(), 0.1, 0.2, modes))
        assert slow.Psi_1 == pytest.approx(2 * 0.9 * 0.2 * (0.25 + 0.75 * 3), rel=1e-4)

    def test_a_newtonian_liquid_has_none(self) -> None:
        assert SecondOrderFluid.of(NEWTONIAN) == SecondOrderFluid(0.0, 0.0)


class TestDeparture:
    def test_oldroyd_b_shears_as_in_slow_flow_at_any_rate(self) -> None:
        assert departure(single(OldroydB(), 1.0), 8.0) < 1e-6

    def test_that_of_a_thinning_liquid_grows_as_the_square_of_the_rate(self) -> None:
        liquid = single(Giesekus(alpha=0.2), 0.01)
        assert departure(slower(liquid, 0.5), 8.0) == pytest.approx(departure(liquid, 8.0) / 4, rel=0.02)

    def test_a_viscosity_that_depends_on_the_rate_departs_however_short_the_memory_is(self) -> None:
        assert departure(single(WhiteMetzner(n=0.5, Cu=1.0), 1e-4), 8.0) > 0.5
        assert departure(Liquid(Carreau(n=0.5, Cu=1.0)), 8.0) > 0.5
