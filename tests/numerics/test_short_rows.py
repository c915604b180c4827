"""Short rows that are solved, of which the model of long ones is made."""

from __future__ import annotations

import numpy as np
import pytest

from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.solids import soft
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.rows.deviations import deviations
from pairsim.solvers.rows.model import Row
from pairsim.solvers.rows.short_rows import APART, solved


def short(count: int, places: list[tuple[float, ...]], parts: np.ndarray | None = None) -> list[Row]:
    """Rows of soft particles in a Newtonian liquid, on few cells."""
    problem = SteadyProblem(betas=(0.4,), length=8.0, periodic=True, mesh=MeshSettings(Np=10))
    alone = Parameters((), soft(0.1))
    assert all(len(place) == count - 1 for place in places)
    return list(solved(problem, alone, places, parts is not None, parts))


def test_a_particle_far_downstream_changes_no_length() -> None:
    """The length of the last one is that of one which is followed by another far from it."""
    (alone,) = short(1, [()])
    (pair,) = short(2, [(0.12,)])
    (triplet,) = short(3, [(0.12, 1.5)])
    lengths = [row.followed(alone.rear).values[:, 1] for row in (alone, pair, triplet)]
    assert lengths[2][:2] == pytest.approx(lengths[1], abs=3e-4)
    assert abs(lengths[1][1] - lengths[0][0]) > 2e-3, "the front of the second one is another one in a pair"


def test_what_the_size_of_a_rigid_particle_changes_is_what_it_changes_of_two_that_are_far_apart() -> None:
    problem = SteadyProblem(betas=(0.4,), length=8.0, periodic=True, mesh=MeshSettings(Np=10))
    rigid = Parameters((), (None,))
    (alone,), (pair,) = (list(solved(problem, rigid, [place], True)) for place in ((), (1.2,)))
    assert alone.by_particle is not None
    assert pair.by_particle is not None
    assert alone.by_particle[0, 0] == pytest.approx([-0.405, 0.0], abs=0.01)
    assert pair.by_particle[0, 0] == pytest.approx(alone.by_particle[0, 0], abs=0.004)


def test_what_size_and_softness_change_of_one_particle_is_known_to_second_order() -> None:
    rows = [short(1, [()], sign * APART * each[None])[0] for each in np.eye(2) for sign in (1, -1)]
    (equal,) = short(1, [()], np.zeros((1, 2)))
    found = deviations(equal, [], rows, [], 0.04)
    for parts in (np.array([[0.1, 0.0]]), np.array([[-0.1, 0.2]])):
        (other,) = short(1, [()], parts)
        change, first = (other.U - equal.U)[0], float((parts @ found.alone)[0])
        twice = found.velocities(np.zeros(0), parts)[0]
        assert abs(twice - change) < 0.2 * abs(first - change)
