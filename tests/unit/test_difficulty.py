"""How hard a case is: two numbers of its liquid in simple flows, and the time announced for it."""

from __future__ import annotations

import numpy as np
import pytest

from pairsim.commands import COMMANDS
from pairsim.config.difficulty import PASSAGE, WALL_RATE, beyond_tension, stretch, tension
from pairsim.inputs.case_files import parse_case
from pairsim.physics.liquids import NEWTONIAN, single
from pairsim.physics.liquids.oldroyd_b import OldroydB

DE, XI, BETA, CA_E = 0.8, 0.09, 0.4, 0.02
LIQUID = single(OldroydB(), DE, XI)


def test_stretch_beside_a_particle_is_that_of_a_hookean_polymer() -> None:
    e = 1 / (1 - BETA)
    along, across = (1 / DE - rate for rate in (2 * e, -e))
    c = [(1 / DE + (r - 1 / DE) * np.exp(-r * PASSAGE)) / r for r in (along, across)]
    assert stretch(LIQUID, BETA) == pytest.approx((c[0] + 2 * c[1]) / 3, rel=1e-7)
    assert stretch(NEWTONIAN, BETA) == 1


def test_tension_at_the_wall_is_that_of_a_hookean_polymer() -> None:
    exact = 2 * (1 - XI) * DE * WALL_RATE**2 * BETA * CA_E
    assert tension(LIQUID, (0.1, BETA), (CA_E, CA_E)) == pytest.approx(exact, rel=1e-9)
    assert tension(LIQUID, (BETA,), (0.0,)) == tension(NEWTONIAN, (BETA,), (CA_E,)) == 0
    assert list(beyond_tension(LIQUID, (BETA,), (CA_E / exact * 0.9,))) == []
    (said,) = beyond_tension(LIQUID, (BETA,), (CA_E / exact * 2,))
    assert " 2 times the modulus" in said


def announced(**keys: object) -> float:
    case = parse_case(COMMANDS["curve"], {"d": [0.3], "ends": "developed", "length": "auto"} | keys, "test")
    return COMMANDS["curve"].estimate(case).seconds


def test_the_way_to_a_hard_scene_is_announced() -> None:
    """Of scripts/hard: no end was announced where 13 s were said, and took 38 s; 4 s where rigid spheres take 161 s."""
    rigid = {"liquid": "oldroyd-b", "De": 1.08, "Ca_e": 0, "beta": [0.628, 0.69], "d": [0.582]}
    soft = {"liquid": {"law": "fene-p", "L2": 103}, "De": 0.605, "Ca_e": 0.177, "beta": 0.728, "d": [0.414]}
    assert 161 / 4 < announced(**rigid) < 161 * 2
    assert 38 / 2 < announced(**soft) < 38 * 2
    assert announced(**soft | {"Ca_e": 0}) < 0.3 * announced(**soft)
    newtonian = {"De": 0, "beta": 0.656, "d": [0.042]}
    assert announced(**newtonian, Ca_e=0.271) > 4 * announced(**newtonian, Ca_e=0.05)
