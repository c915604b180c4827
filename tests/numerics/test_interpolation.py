"""Quadratic fields at points of a mesh of six-node triangles, which are found with a grid; patches of few cells."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.tri import Triangulation

from pairsim.fem.meshes.interpolation import containing, interpolate
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.fem.recovery.enriched_nodes import EnrichedNodes
from pairsim.fem.recovery.patch_recovery import WIDE, PatchRecovery


def lattice(columns: int, rows: int, bent: float) -> SixNodeMesh:
    """A mesh of the rectangle from (-1, 0) to (1, 1/2) with graded columns, its mid-sides moved in part by `bent`."""
    z, r = np.meshgrid(np.linspace(-1, 1, 2 * columns + 1) ** 3, np.linspace(0, 0.5, 2 * rows + 1), indexing="ij")
    number = np.arange(z.size).reshape(z.shape)
    cells = []
    for i in range(0, 2 * columns, 2):
        for j in range(0, 2 * rows, 2):
            n = number[i : i + 3, j : j + 3]
            cells.append([n[0, 0], n[2, 0], n[2, 2], n[1, 0], n[2, 1], n[1, 1]])
            cells.append([n[0, 0], n[2, 2], n[0, 2], n[1, 1], n[1, 2], n[0, 1]])
    cells = np.array(cells)
    points = np.column_stack([z.ravel(), r.ravel()])
    for mid, (a, b) in ((3, (0, 1)), (4, (1, 2)), (5, (2, 0))):
        points[cells[:, mid]] = (points[cells[:, a]] + points[cells[:, b]]) / 2
    inside = (np.abs(points[:, 0]) < 0.99) & (points[:, 1] > 0.01) & (points[:, 1] < 0.49)
    points[inside, 1] += bent * np.sin(7 * points[inside, 0])
    return SixNodeMesh(points, cells)


@pytest.mark.parametrize("bent", [0.0, 0.01])
def test_a_linear_field_is_reproduced_and_a_quadratic_one_in_straight_cells(bent: float) -> None:
    mesh = lattice(12, 5, bent)
    rng = np.random.default_rng(1)
    wanted = np.vstack([np.column_stack([rng.uniform(-1, 1, 500), rng.uniform(0, 0.5, 500)]), mesh.points])

    def field(x: np.ndarray) -> np.ndarray:
        square = (x[:, 0] * x[:, 1] + x[:, 1] ** 2) * (bent == 0.0)
        return np.column_stack([2 * x[:, 0] - x[:, 1], square])

    found = interpolate(mesh, mesh.points, field(mesh.points), wanted)
    assert np.abs(found - field(wanted)).max() < 1e-10


def test_points_are_found_as_another_library_finds_them_and_those_outside_are_not() -> None:
    mesh = lattice(12, 5, 0.01)
    rng = np.random.default_rng(2)
    wanted = np.column_stack([rng.uniform(-1.2, 1.2, 2000), rng.uniform(-0.1, 0.6, 2000)])
    found = containing(mesh.cells[:, :3], mesh.points, wanted)
    finder = Triangulation(*mesh.points.T, mesh.cells[:, :3]).get_trifinder()
    assert np.array_equal(found, finder(*wanted.T))
    assert 0 < np.count_nonzero(found < 0) < 1500


@pytest.mark.parametrize(("degree", "count"), [(2, 4), (3, 9)])
def test_a_mesh_of_fewer_nodes_than_a_patch_wants_is_one_patch(degree: int, count: int) -> None:
    mesh = lattice(1, 1, 0.0)
    fits = PatchRecovery(EnrichedNodes(mesh, degree), WIDE[degree]).fits(odd=False)
    assert (np.diff(fits.indptr) == count).all()
