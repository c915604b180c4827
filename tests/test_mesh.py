"""Meshes of the liquid around outlines that are no longer circles."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from pairsim.geometry import Geometry, MeshSettings, Reference
from pairsim.mesh import liquid_mesh, make_outlines


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
