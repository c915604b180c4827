"""Velocity of the mesh in quasi-steady scenes."""

from __future__ import annotations

import numpy as np
import pytest

from pairsim.fem.algebra.mesh_velocity import shares
from pairsim.fem.meshes.geometry import Geometry, Outline, Reference

BETAS, GAPS, LENGTH = (0.4, 0.3, 0.2), (0.2, 0.6), 6.0


def triplet() -> Reference:
    outlines = [Outline(beta / 2, np.linspace(0, np.pi, 9)) for beta in BETAS]
    return Reference.spheres(Geometry(BETAS, GAPS, LENGTH), outlines)


@pytest.mark.parametrize("periodic", [False, True])
def test_the_mesh_moves_with_each_particle_as_far_as_a_quarter_of_the_gap(periodic: bool) -> None:
    reference = triplet()
    ends = [(nodes[-1, 0], nodes[0, 0]) for nodes in reference.positions]
    for i, (upstream, downstream) in enumerate(ends):
        before = GAPS[i - 1] if i else 0.2
        after = GAPS[i] if i < len(GAPS) else 0.2
        z = np.linspace(upstream - 0.249 * before, downstream + 0.249 * after, 50)
        expected = np.zeros((3, 50))
        expected[i] = 1
        assert shares(reference, z, periodic) == pytest.approx(expected)
    for i, gap in enumerate(GAPS):
        middle = np.array([ends[i][1] + gap / 2])
        assert shares(reference, middle, periodic)[i : i + 2].ravel() == pytest.approx([0.5, 0.5])


@pytest.mark.parametrize("periodic", [False, True])
def test_a_common_velocity_moves_the_whole_mesh_with_it(periodic: bool) -> None:
    z = np.linspace(-LENGTH / 2, LENGTH / 2, 301)
    found = shares(triplet(), z, periodic)
    assert found.sum(axis=0) == pytest.approx(np.ones(301))
    assert found.min() >= 0


def test_the_mesh_moves_with_the_outer_particles_up_to_developed_ends() -> None:
    ends = np.array([-LENGTH / 2, LENGTH / 2])
    first, _, last = shares(triplet(), ends, False)
    assert first == pytest.approx([1, 0])
    assert last == pytest.approx([0, 1])


def test_both_ends_of_a_period_move_alike() -> None:
    ends = np.array([-LENGTH / 2, LENGTH / 2])
    found = shares(triplet(), ends, True)
    assert found[:, 0] == pytest.approx(found[:, 1])
    assert 0 < found[0, 0] < 1


def test_without_particles_there_is_nothing_to_share() -> None:
    assert shares(Reference(Geometry((), (), LENGTH), (), (), False), np.zeros(4), True).shape == (0, 4)
