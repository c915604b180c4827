"""Rigid spheres in a Newtonian tube against multipoles with exact wall images."""

from __future__ import annotations

import numpy as np
import pytest
from support.scenes import solve_rigid

SINGLE = {0.2: (1.94677814, 0.0102456698), 0.4: (1.79081169, 0.3327323298), 0.6: (1.55302692, 2.7447509031)}
PAIR = {0.1: (1.781813862, 0.6196818815), 0.3: (1.788255961, 0.6533886603)}


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


def test_the_smaller_of_two_spheres_is_faster() -> None:
    found = solve_rigid((0.4, 0.3), (0.5,), Np=20)
    assert found.U[1] - found.U[0] > 0.03


def test_narrow_gaps_and_tight_tubes_can_be_meshed_and_solved() -> None:
    close = solve_rigid((0.4, 0.4), (0.005,), Np=20)
    assert abs(close.U[1] - close.U[0]) < 1e-9
    tight = solve_rigid((0.8, 0.8), (0.1,), Np=20)
    assert abs(tight.U[1] - tight.U[0]) < 1e-9
    assert tight.U[0] < SINGLE[0.6][0]
