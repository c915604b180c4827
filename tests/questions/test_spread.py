"""What the spread of particles does to pairs, beside pairs that differ."""

from __future__ import annotations

from contextlib import closing
from typing import Any

import numpy as np
import pytest
from support.result_folders import curve_of, curve_table

import pairsim
from pairsim.analysis.unequal_pairs import Spread
from pairsim.cases.identity import alike, identity_of
from pairsim.computing.problems import steady_problem
from pairsim.runtime.errors import InputError
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.curves.point import Point
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.steady.first_solution import first_scene

SOFT = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "mesh": {"Np": 12}}
D = np.geomspace(0.05, 1.6, 24)


def point(d: float, betas: tuple[float, float], Ca_es: tuple[float, float], **more: Any) -> Point:
    case = pairsim.load(SOFT | more | {"beta": list(betas), "Ca_e": list(Ca_es), "d": [d]}, kind="curve")
    start = Parameters((d,), case.solid_models, case.liquid_model)
    with closing(Branch(arrived(first_scene(steady_problem(case, d), start)), by_particle=True)) as branch:
        return arrived(branch.at(start))


@pytest.mark.parametrize(
    "more",
    [{"mesh": {"Np": 18}}, pytest.param({"De": 0.5, "mesh": {"Np": 16}}, marks=pytest.mark.slow)],
    ids=["newtonian", "giesekus"],
)
def test_velocities_by_each_particle_are_those_of_pairs_that_differ(more: dict[str, Any]) -> None:
    """To the discretisation error: pairs that differ contain its estimate, derivatives are of the discrete solution."""
    d, equal = 0.2, np.ones((2, 2))
    by_particle = point(d, (0.4, 0.4), (0.1, 0.1), **more).by_particle.sum(axis=-1)
    for i in range(2):
        changed = np.eye(2)[i] * np.array([[1.0], [-1.0]])  # of particle i, up and down
        for k, (beta, Ca_e) in enumerate(((0.02 * changed, 0 * changed), (0 * changed, 0.1 * changed))):
            each = zip(0.4 * (equal + beta), 0.1 * (equal + Ca_e), strict=True)
            up, down = (point(d, tuple(betas), tuple(Ca_es), **more).observation.U for betas, Ca_es in each)
            slope = (up - down) / (2 * (beta + Ca_e)[0, i])
            assert by_particle[:, i, k] == pytest.approx(slope, abs=0.03 * abs(by_particle[:, :, k]).max())


def test_the_mesh_of_a_rigid_particle_alone_does_not_tell_its_derivative_by_size() -> None:
    case = pairsim.load({"beta": 0.4, "De": 0, "Ca_e": 0, "particles": 1, "mesh": {"Np": 8}}, kind="curve")
    start = Parameters((), case.solid_models, case.liquid_model)
    scene = arrived(first_scene(steady_problem(case, np.inf), start))
    with closing(Branch(scene, by_particle=True)) as branch, pytest.raises(ValueError, match="does not move"):
        branch.at(start)


def test_dU_of_a_pair_that_differs_follows_from_the_curve_with_a_spread() -> None:
    """One per cent of size is worth as much as the interaction of very soft beads."""
    spread = pairsim.curve(SOFT | {"d": [0.1, 0.4, 1.6], "spread": {"diameter": 0.02}}).check().curve
    unequal = pairsim.curve(SOFT | {"beta": [0.4, 0.396], "d": [0.1, 0.4, 1.6]}).check().curve
    assert spread.unequal is not None
    pairs = spread.unequal.spread.draw(1)._replace(diameters=np.array([[0.0, -0.01]]))
    at = np.array([0.1, 0.4, 1.6])
    first_order = spread.unequal.source.dU(at, pairs)[0]
    assert first_order == pytest.approx(unequal(at)[0], abs=2e-4)
    assert first_order == pytest.approx([0.0100, 0.0054, 0.0043], abs=6e-4)  # on finer meshes


def a_curve(spread: dict[str, float]) -> Any:
    """dU = 0.004 exp(-d) - 0.4 (difference of the diameters) + 0.02 (that of the moduli)."""
    dU = 0.004 * np.exp(-D)
    table = curve_table(D, dU, -dU, dU_error=np.full_like(D, 1e-6))
    table |= {"U_L": 1.7 + dU / 2, "U_T": 1.7 - dU / 2, "stretch": 1 + 0 * D, "t_relax": 0 * D}
    table |= {"by_beta": 0 * D, "by_Ca_e": 0 * D}
    table |= {"by_difference": 0 * D - 0.4, "by_stiffness": 0 * D + 0.02}
    return curve_of(table, [], {"spread": {"diameter": 0.0, "modulus": 0.0, "beta": 0.4, "Ca_e": 0.1} | spread})


def test_dU_of_pairs_is_distributed_as_their_draws_are() -> None:
    unequal = a_curve({"diameter": 0.02, "modulus": 0.1}).unequal
    drawn = unequal.source.dU(D, unequal.spread.draw(20_000))
    assert unequal.deviations(D) == pytest.approx(2**0.5 * np.hypot(0.4 * 0.02, 0.02 * 0.1))
    assert drawn.std(axis=0) == pytest.approx(unequal.deviations(D), rel=0.03)
    assert (drawn > 0).mean(axis=0) == pytest.approx(unequal.separate(D), abs=0.015)


def test_from_a_difference_on_size_alone_decides() -> None:
    curve = a_curve({"diameter": 0.02})
    assert curve.unequal.decisive["diameter"] == pytest.approx(0.004 * np.exp(-0.05) / 0.4, rel=1e-3)


def test_pairs_that_meet_are_those_whose_leading_bead_is_slower_all_the_way() -> None:
    curve = a_curve({"diameter": 0.02})
    way = curve.travel_of_pairs(1.0, 0.1)
    # Those that still come closer where equal ones separate fastest: a difference above 0.004 exp(-0.1)/0.4.
    least = 0.004 * np.exp(-0.1) / 0.4 / (2**0.5 * 0.02)
    drawn = np.random.default_rng(5).standard_normal(200_000)
    assert way.part == pytest.approx((drawn > least).mean(), abs=0.02)
    assert 0 < way.half < way.most
    assert curve.travel_of_pairs(0.1, 1.0).part > way.part
    assert "of pairs whose particles differ (diameter 2 %)" in str(way)
    assert a_curve({"diameter": 1e-9}).travel_of_pairs(1.0, 0.1).part == 0


def test_a_table_has_the_spread_at_any_distance() -> None:
    found = a_curve({"diameter": 0.02}).at([0.1, 0.3])
    assert found["dU_spread"] == pytest.approx(2**0.5 * 0.4 * 0.02)
    assert ((found["separate"] > 0.5) & (found["separate"] < 0.7)).all()


def test_spread_in_units_is_a_part_of_the_mean() -> None:
    block = {
        "tube": "60 um",
        "velocity": "5 mm/s",
        "viscosity": "50 mPa s",
        "particle": {"mean": "24 +- 1 um", "each": "0.5 um"},
        "modulus": {"mean": "40 Pa", "each": "4 Pa"},
        "distance": ["6 um"],
    }
    case = pairsim.load({"physical": block}, kind="curve")
    assert case.betas == (0.4, 0.4)
    assert case.spread.diameter == pytest.approx(0.5 / 24)
    assert case.spread.modulus == pytest.approx(0.1)
    in_words = block | {"particle": "24 +- 1 um each 0.5 um", "modulus": "40 Pa each 4 Pa"}
    other = pairsim.load({"physical": in_words}, kind="curve")
    assert alike(other) == alike(case)
    relative = block | {"particle": "24 +- 1 um each 2.5 %", "modulus": {"mean": "40 Pa", "each": "10 %"}}
    spread = pairsim.load({"physical": relative}, kind="curve").spread
    assert (spread.diameter, spread.modulus) == pytest.approx((0.025, 0.1))
    with pytest.raises(InputError, match=r"physical\.particle\.each: got 'half'"):
        pairsim.load({"physical": block | {"particle": "24 um each half"}}, kind="curve")
    with pytest.raises(InputError, match="cases of this command have no spread"):
        pairsim.load({"physical": block | {"distance": "6 um"}}, kind="run")
    with pytest.raises(InputError, match=r"if particles differ, \{mean: 20 um"):
        pairsim.load({"physical": block | {"particle": {"mean": "24 um"}}}, kind="curve")
    with pytest.raises(InputError, match=r"physical\.particle\.each"):
        pairsim.load({"physical": block | {"particle": {"mean": "24 um", "each": "40 kPa"}}}, kind="curve")


def test_equal_particles_have_the_case_that_they_had() -> None:
    case = pairsim.load(SOFT | {"d": [0.1]}, kind="curve")
    assert "spread" not in identity_of(case)
    assert "spread" in identity_of(pairsim.load(SOFT | {"d": [0.1], "spread": {"diameter": 0.01}}, kind="curve"))
    assert not Spread(0.0, 0.0, 0.4, 0.1).words
