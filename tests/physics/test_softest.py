"""Particles that the tension of the polymer stretches without limit."""

from __future__ import annotations

import pytest

from pairsim.cases.softest import WALL_RATE, beyond_tension, tension
from pairsim.physics.liquids import NEWTONIAN, single
from pairsim.physics.liquids.oldroyd_b import OldroydB

DE, XI, BETA, CA_E = 0.8, 0.09, 0.4, 0.02
LIQUID = single(OldroydB(), DE, XI)


def test_tension_at_the_wall_is_that_of_a_hookean_polymer() -> None:
    exact = 2 * (1 - XI) * DE * WALL_RATE**2 * BETA * CA_E
    assert tension(LIQUID, (0.1, BETA), (CA_E, CA_E)) == pytest.approx(exact, rel=1e-9)
    assert tension(LIQUID, (BETA,), (0.0,)) == tension(NEWTONIAN, (BETA,), (CA_E,)) == 0
    assert list(beyond_tension(LIQUID, (BETA,), (CA_E / exact * 0.9,))) == []
    (said,) = beyond_tension(LIQUID, (BETA,), (CA_E / exact * 2,))
    assert " 2 times the modulus" in said
