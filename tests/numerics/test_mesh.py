"""Meshes of the liquid: around outlines that are no longer circles, rows along the tube, motion with the particles."""

from __future__ import annotations

from dataclasses import replace

import gmsh
import numpy as np
import pytest
from scipy.spatial import cKDTree

from pairsim.fem.algebra.mesh_velocity import shares
from pairsim.fem.meshes.cell_columns import LONGEST
from pairsim.fem.meshes.cell_sizes import make_outlines
from pairsim.fem.meshes.geometry import Geometry, MeshSettings, Outline, Reference
from pairsim.fem.meshes.meshing import liquid_mesh
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh, nodes_at


def test_cells_around_deformed_outlines_grow_with_the_distance_from_them() -> None:
    """Bent and stretched by half, with a dimple: nearest points are not in the direction of the centre."""
    settings = MeshSettings(Np=20, growth=0.3)
    geometry = Geometry((0.3,), (), 4.0)
    (outline,) = make_outlines(geometry, settings)
    z, r = outline.nodes.T
    nodes = np.column_stack([1.5 * z + 6 * r**2, 0.7 * r * (1 + 0.5 * z / outline.radius)])
    mesh = liquid_mesh(Reference(geometry, (outline,), (nodes,), True), settings)
    distance, nearest = cKDTree(nodes).query(mesh.points)
    arcs = np.hypot(*np.diff(nodes[::2], axis=0).T)
    wanted = arcs[np.minimum(nearest // 2, len(arcs) - 1)] + settings.growth * distance
    sides = mesh.points[mesh.cells[:, [1, 2, 0]]] - mesh.points[mesh.cells[:, :3]]
    longest = np.hypot(sides[..., 0], sides[..., 1]).max(axis=1)
    ratio = longest / wanted[mesh.cells[:, :3]].max(axis=1)
    beside = distance[mesh.cells[:, :3]].max(axis=1) < 0.2
    far = wanted[mesh.cells[:, :3]].min(axis=1) > settings.max_size
    assert mesh.jacobians.min() > 0
    assert ratio.max() < 1.4
    assert 0.6 < ratio[beside].mean() < 1.1
    assert longest[far].max() < 1.4 * settings.max_size


def test_a_session_of_gmsh_keeps_its_model_and_its_options_and_changes_no_mesh() -> None:
    settings, geometry = MeshSettings(Np=8), Geometry((0.3,), (), 4.0)
    reference = Reference.spheres(geometry, make_outlines(geometry, settings))
    alone = liquid_mesh(reference, settings)
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("mine")
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        for option in ("Mesh.RecombineAll", "Mesh.MeshSizeFactor"):
            gmsh.option.setNumber(option, 1.5)
        within = liquid_mesh(reference, settings)
        assert gmsh.model.getCurrent() == "mine"
        assert gmsh.model.getEntities(3) == [(3, 1)]
        assert gmsh.option.getNumber("Mesh.MeshSizeFactor") == 1.5
    finally:
        gmsh.finalize()
    assert np.array_equal(within.points, alone.points)


def with_rows(
    betas: tuple[float, ...], gaps: tuple[float, ...], stretch: float = 1.0
) -> tuple[SixNodeMesh, SixNodeMesh, Reference]:
    """Meshes with and without rows beyond .5, around spheres or around what they are stretched to along the tube."""
    geometry = Geometry(betas, gaps, 8.0)
    settings = [MeshSettings(Np=12, max_size=0.06, rows=rows) for rows in (0.5, 0.0)]
    reference = Reference.spheres(geometry, make_outlines(geometry, settings[0]))
    if stretch != 1.0:
        positions = tuple(nodes * [stretch, 1.0] for nodes in reference.positions)
        reference = Reference(geometry, reference.outlines, positions, True)
    found, without = (liquid_mesh(reference, each) for each in settings)
    return found, without, reference


@pytest.mark.parametrize(
    ("betas", "stretch"),
    [((0.4, 0.4), 1.0), ((0.4, 0.3), 1.0), ((0.3,), 1.0), ((0.4, 0.3), 1.2)],
    ids=["equal", "unequal", "one", "stretched"],
)
def test_rows_continue_the_mesh_to_the_ends_of_the_tube(betas: tuple[float, ...], stretch: float) -> None:
    """They leave no hole and cover nothing twice, and every side off the boundary belongs to two cells."""
    mesh, without, reference = with_rows(betas, (0.1,) * (len(betas) - 1), stretch)
    assert mesh.jacobians.min() > 0
    area = mesh.jacobians[:, 3:6].sum() / 6  # exact for polynomials of degree 2
    assert area == pytest.approx(8.0 * 0.5 - stretch * sum(np.pi * beta**2 / 8 for beta in betas), rel=1e-5)
    assert (mesh.points[:, 0].min(), mesh.points[:, 0].max()) == (-4.0, 4.0)
    middles, count = np.unique(mesh.cells[:, 3:], return_counts=True)
    assert set(count) == {1, 2}
    z, r = mesh.points[middles[count == 1]].T
    outlines = np.vstack(reference.positions)
    distance, _ = cKDTree(outlines).query(np.column_stack([z, r]))
    assert np.all((r < 1e-12) | (r > 0.5 - 1e-9) | (np.abs(z) == 4.0) | (distance < 1e-9))
    ends = (mesh.points[:, 0] == -4.0, mesh.points[:, 0] == 4.0)
    first, last = (np.sort(mesh.points[end, 1]) for end in ends)
    assert first == pytest.approx(last, abs=1e-9)
    assert len(mesh.cells) < len(without.cells) / 2


def test_rows_keep_their_width_and_lengthen_with_the_distance() -> None:
    mesh, _, reference = with_rows((0.4, 0.3), (0.1,))
    end = max(nodes[:, 0].max() for nodes in reference.positions)
    for away in (mesh.points[:, 0] - end, -mesh.points[:, 0] - end):
        beyond = (away[mesh.cells[:, :3]] > 0.5 - 1e-9).all(axis=1)
        z, r = np.moveaxis(mesh.points[mesh.cells[beyond, :3]], 2, 0)
        assert np.ptp(r, axis=1) == pytest.approx(0.5 / 9)
        lengths = np.unique(np.round(np.sort(np.ptp(z, axis=1)), 9))
        assert lengths[0] == pytest.approx(0.5 / 9, rel=0.15)
        away_from_the_first = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
        assert lengths == pytest.approx(np.minimum(lengths[0] + 0.15 * away_from_the_first, LONGEST * 0.3), rel=0.01)


@pytest.mark.parametrize("betas", [(0.4, 0.4), (0.4, 0.3)])
def test_rows_are_graded_towards_the_wall_at_both_ends(betas: tuple[float, ...]) -> None:
    geometry = Geometry(betas, (0.1,), 4.0)
    settings = MeshSettings(Np=12, max_size=0.06, rows=0.5, row_grading=3.0)
    points = liquid_mesh(Reference.spheres(geometry, make_outlines(geometry, settings)), settings).points
    ends = [np.sort(points[np.abs(points[:, 0] - z) < 1e-9, 1]) for z in (-2.0, 2.0)]
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-12)
    cells = np.diff(ends[1][::2])
    assert cells[0] / cells[-1] == pytest.approx(3.0)
    assert (np.diff(cells) < 0).all()


def test_meshes_with_rows_are_mirrored_where_the_scene_is() -> None:
    mesh, _, _ = with_rows((0.4, 0.4), (0.1,))
    distance, image = cKDTree(mesh.points).query(mesh.points * [-1.0, 1.0])
    assert distance.max() == 0.0
    assert {*map(tuple, np.sort(image[mesh.cells], axis=1))} == {*map(tuple, np.sort(mesh.cells, axis=1))}


@pytest.mark.parametrize(
    ("beta", "distances", "rounded", "Np"), [(0.216, (0.438, 0.397), 0.398, 11), (0.4, (0.022, 0.018), 0.02, 10)]
)
def test_outlines_made_for_unequal_distances_have_a_mesh_where_these_are_rounded_to_equal_ones(
    beta: float, distances: tuple[float, float], rounded: float, Np: int
) -> None:
    """No half of the domain is the mirror image of the other one: the arcs of the particle in the middle are odd in
    number, so that none ends at its equator, or denser on one side."""
    unequal, settings = Geometry((beta,) * 3, distances, 8.0), MeshSettings(Np=Np, rows=0.8)
    reference = Reference.spheres(replace(unequal, gaps=(rounded, rounded)), make_outlines(unequal, settings))
    mesh = liquid_mesh(reference, settings)
    assert reference.geometry.mirrored
    assert not reference.mirrored
    for nodes in reference.positions:
        assert (nodes_at(mesh.points, nodes) >= 0).all()


def test_a_tube_without_room_for_rows_has_none() -> None:
    geometry = Geometry((0.4,), (), 1.5)
    settings = MeshSettings(Np=12, rows=0.5)
    reference = Reference.spheres(geometry, make_outlines(geometry, settings))
    assert np.array_equal(liquid_mesh(reference, settings).points, liquid_mesh(reference, MeshSettings(Np=12)).points)


def test_grading_moves_arcs_from_the_poles_to_the_equator() -> None:
    geometry, equal = Geometry((0.2,), (), 4.0), MeshSettings(Np=40, wall_arcs=0.1)
    one, two = (make_outlines(geometry, replace(equal, grading=grading))[0] for grading in (1.0, 2.0))
    assert len(one.angles) == len(two.angles) == 41
    lengths = np.diff(two.angles)
    assert lengths[0] / lengths[20] == pytest.approx(2.0, rel=0.01)
    assert np.allclose(np.diff(one.angles), np.pi / 40)


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
