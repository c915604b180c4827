"""Rigid spheres in a tube against multipoles with exact wall images, free and moved at a prescribed velocity."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from studies.rigid import references as known
from support.scenes import solve_rigid

import pairsim

SINGLE = {beta: (known.U[beta], known.DP_PLUS[beta]) for beta in known.U}
PAIR = {d: (known.PAIR_U[d], known.PAIR_DP_PLUS[d]) for d in known.PAIR_U}


@pytest.mark.parametrize("beta", SINGLE)
def test_single_sphere_moves_as_the_exact_solution(beta: float) -> None:
    found = solve_rigid((beta,))
    U, dp_plus = SINGLE[beta]
    assert abs(found.U[0] - U) < 5e-6
    assert abs(found.dp_plus - dp_plus) < 1e-4
    assert abs(found.m) < 1e-12


@pytest.mark.parametrize("d", PAIR)
def test_equal_spheres_keep_their_distance(d: float) -> None:
    found = solve_rigid((0.4, 0.4), (d,))
    U, dp_plus = PAIR[d]
    assert np.abs(found.U - U).max() < 5e-6
    assert abs(found.dp_plus - dp_plus) < 1e-4
    assert abs(found.U[1] - found.U[0]) < 1e-9
    assert abs(found.m) < 1e-12


def test_velocity_converges_at_third_order_at_least() -> None:
    error = [abs(solve_rigid((0.4,), Np=Np).U[0] - SINGLE[0.4][0]) for Np in (10, 20, 40)]
    assert np.log2(error[0] / error[2]) / 2 > 3


def test_a_far_pair_moves_as_single_spheres() -> None:
    pair = solve_rigid((0.4, 0.4), (3.0,), Np=20)
    assert np.abs(pair.U - SINGLE[0.4][0]).max() < 3e-5
    assert abs(pair.dp_plus - 2 * SINGLE[0.4][1]) < 2e-3


def test_narrow_gaps_and_tight_tubes_can_be_meshed_and_solved() -> None:
    close = solve_rigid((0.4, 0.4), (0.005,), Np=20)
    assert abs(close.U[1] - close.U[0]) < 1e-9
    tight = solve_rigid((0.8, 0.8), (0.1,), Np=20)
    assert abs(tight.U[1] - tight.U[0]) < 1e-9
    assert tight.U[0] < SINGLE[0.6][0]


MOVED = {"De": 0, "Ca_e": 0, "particles": 1, "ends": "developed", "length": "auto"}
# Force over 3 pi beta: a sphere dragged in a liquid at rest, one held where the largest velocity of the flow is 2.
DRAG = {(0.6, 1, 0): known.DRAGGED[0.6], (0.4, 0, 1): -2 * known.HELD[0.4]}


@pytest.mark.parametrize(("beta", "velocity", "flow"), DRAG, ids=["dragged", "held"])
def test_force_on_a_moved_sphere_is_the_exact_one_within_its_interval(beta: float, velocity: int, flow: int) -> None:
    row = pairsim.curve(MOVED, beta=beta, velocity=velocity, flow=flow).check().table.iloc[0]
    exact = 3 * pi * beta * DRAG[beta, velocity, flow]
    error = abs(row["F_1"] - exact)
    assert error < min(2e-4 * abs(exact), row["F_error_1"])
    assert error < 0.25 * abs(row["F_1"] - row["F_correction_1"] - exact)


def test_force_and_velocity_are_two_sides_of_one_problem() -> None:
    """A pair held together at the velocity at which it moves by itself needs no force; drag grows with the velocity."""
    pair = MOVED | {"beta": 0.4, "particles": 2, "d": [0.1], "mesh": {"Np": 12}}
    found = pairsim.curve(pair).check().table.iloc[0]
    free = found["U_L"] - found["U_correction_L"]
    at, faster = (pairsim.curve(pair, velocity=U).check().table.iloc[0] for U in (free, free + 1))
    discrete = [at[f"F_{i}"] - at["corrected"] * at[f"F_correction_{i}"] for i in ("L", "T")]
    assert np.abs(discrete).max() < 1e-9
    at_rest = pairsim.curve(pair, velocity=1, flow=0, ends="periodic", length=8).check().table.iloc[0]
    for name in ("F_L", "F_T"):
        assert abs(faster[name] - at_rest[name]) < faster[name.replace("F", "F_error")] + 1e-4 * abs(faster[name])
    assert at_rest["F_L"] == pytest.approx(at_rest["F_T"], rel=1e-9)
