"""Cell sizes that follow from what single cells contribute to an error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pairsim.fem.meshes.cell_sizes import make_outlines
from pairsim.fem.meshes.geometry import Geometry, MeshSettings, Reference
from pairsim.fem.meshes.meshing import liquid_mesh
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.fem.meshes.size_field import ASKED, GRADATION, MOST_FACTOR, AdaptedSizes, CellIndicators, SizeField
from pairsim.runtime.arrays import Array

PAIR = Geometry((0.4, 0.4), (0.4,), 5.2)
COARSE = MeshSettings(Np=10, growth=0.3, max_size=0.12, rows=0.5)
LAYER = 0.23  # radius of a layer beside the particles that contributes most


def mesh_of(geometry: Geometry, settings: MeshSettings) -> SixNodeMesh:
    return liquid_mesh(Reference.spheres(geometry, make_outlines(geometry, settings)), settings)


@pytest.fixture(scope="module")
def indicators() -> CellIndicators:
    corners = (mesh := mesh_of(PAIR, COARSE)).points[mesh.cells[:, :3]]
    z, r = corners.mean(axis=1).T
    squares = np.exp(-(((r - LAYER) / 0.03) ** 2)) * (np.abs(z) < 0.7) + 1e-6
    return CellIndicators(PAIR, True, corners, squares[:, None] / squares.sum())


def test_cells_become_smaller_where_they_contribute_and_no_larger_than_allowed_elsewhere(
    indicators: CellIndicators,
) -> None:
    field = indicators.sizes(np.array([0.1]), MOST_FACTOR, 0.5)
    coarse, fine = mesh_of(PAIR, COARSE), mesh_of(PAIR, replace(COARSE, sizes=AdaptedSizes((field,))))

    def cells_in(mesh: SixNodeMesh, where: Callable[[Array, Array], Array]) -> int:
        return int(where(*mesh.points[mesh.cells[:, :3]].mean(axis=1).T).sum())

    def layer(z: Array, r: Array) -> Array:
        return (np.abs(z) < 0.7) & (np.abs(r - LAYER) < 0.03)

    def away(z: Array, r: Array) -> Array:
        return (np.abs(z) > 0.95) & (np.abs(z) < 1.1)

    assert cells_in(fine, layer) > 2.5 * cells_in(coarse, layer)
    assert cells_in(fine, away) < 1.2 * cells_in(coarse, away)
    assert np.array_equal(np.sort(fine.points[:, 0]), np.sort(-fine.points[:, 0])), "mirrored"


def test_the_less_error_is_wanted_the_smaller_the_cells(indicators: CellIndicators) -> None:
    least = [indicators.sizes(np.array([most]), MOST_FACTOR, 0.5).at(0.4, LAYER) for most in (0.5, 0.1, 0.02)]
    assert least[0] > 1.2 * least[1] > 1.2**2 * least[2]


def test_sizes_that_are_good_enough_are_kept(indicators: CellIndicators) -> None:
    """With the error that it has already and no larger cells allowed, a mesh keeps its number of cells."""
    field = indicators.sizes(np.array([1.0]), 1.0, 0.5)
    before, after = mesh_of(PAIR, COARSE), mesh_of(PAIR, replace(COARSE, sizes=AdaptedSizes((field,))))
    assert len(after.cells) == pytest.approx(len(before.cells), rel=0.25)


def test_sizes_grow_slowly(indicators: CellIndicators) -> None:
    field = indicators.sizes(np.array([0.02]), MOST_FACTOR, 0.5)
    for axis in (0, 1):
        assert np.abs(np.diff(field.sizes, axis=axis)).max() <= 1.001 * GRADATION * field.spacing


def test_sizes_move_with_the_particles() -> None:
    z = np.arange(-1.0, 1.001, 0.01)
    sizes = 0.01 + 0.05 * np.abs(z - 0.4)[:, None] * np.ones(51)  # least beside the downstream particle's centre
    near = AdaptedSizes((SizeField(PAIR, -1.0, 0.01, sizes),))
    wider = replace(PAIR, gaps=(0.5,))
    assert near.on(PAIR)(0.4, 0.2) == pytest.approx(0.01)
    assert near.on(wider)(float(wider.centres[1]), 0.2) == pytest.approx(0.01)
    assert near.on(wider)(0.0, 0.2) == pytest.approx(near.on(PAIR)(0.0, 0.2))
    assert near.scaled(2.0).on(PAIR)(0.4, 0.2) == pytest.approx(0.02)
    far = SizeField(wider, -1.0, 0.01, np.full((201, 51), 0.08))
    both = AdaptedSizes((*near.fields, far))
    assert both.on(replace(PAIR, gaps=(0.48,)))(0.4, 0.2) == pytest.approx(0.08), "the nearest distance's"
    arcs = both.along_outline(1, np.array([np.pi / 2]))
    assert arcs == pytest.approx(0.01 / ASKED), "an outline has the least of all distances"
