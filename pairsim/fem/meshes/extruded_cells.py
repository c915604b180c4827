"""Structured rows of cells along the tube, at some distance from the particles.

There the disturbance by the particles is small, but the stress of the undisturbed tube flow is not. On unstructured
cells the discretisation error of this stress varies from cell to cell, and its divergence acts like a body force. In
rows of cells the error is uniform along the tube and exerts no force, so that the cells may be long.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.quantities.scales import TUBE_RADIUS
from pairsim.runtime.arrays import Array

# Vertices and mid-sides of the two triangles of a square, as node indices (along, across) from 0 to 2, for both
# directions of the diagonal.
_RISING = (((0, 0), (2, 0), (2, 2), (1, 0), (2, 1), (1, 1)), ((0, 0), (2, 2), (0, 2), (1, 1), (1, 2), (0, 1)))
_FALLING = (((0, 0), (2, 0), (0, 2), (1, 0), (1, 1), (0, 1)), ((2, 0), (2, 2), (0, 2), (2, 1), (1, 2), (1, 1)))


def extruded(mesh: SixNodeMesh, z: Array) -> SixNodeMesh:
    """Extend a mesh beyond its straight downstream end by structured cells.

    Args:
        mesh: Mesh that ends at z[0].
        z: Boundaries between the columns of cells, ascending.

    Returns:
        The extended mesh. Its first nodes and cells are those of `mesh`; the rows continue the radial nodes of its end.
    """
    end = np.flatnonzero(mesh.points[:, 0] > z[0] - 1e-9)
    end = end[np.argsort(mesh.points[end, 1])]
    columns, rows = len(z) - 1, len(end) // 2
    along = np.empty(2 * columns)
    along[::2], along[1::2] = (z[:-1] + z[1:]) / 2, z[1:]
    r = np.broadcast_to(mesh.points[end, 1], (len(along), len(end)))
    points = np.column_stack([np.repeat(along, len(end)), r.ravel()])
    node = np.vstack([end, len(mesh.points) + np.arange(len(points)).reshape(r.shape)])
    # The direction of the diagonal alternates, such that two triangles meet in the corner of the wall and the end: a
    # triangle with two sides on Dirichlet boundaries would have an undetermined pressure.
    k, j = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    is_rising = (columns + rows - k - j) % 2 == 0
    cells = [
        np.stack([node[2 * k[chosen] + dz, 2 * j[chosen] + dr] for dz, dr in corners], axis=1)
        for chosen, halves in ((is_rising, _RISING), (~is_rising, _FALLING))
        for corners in halves
    ]
    return SixNodeMesh(np.vstack([mesh.points, points]), np.vstack([mesh.cells, *cells]))


def graded_ends(mesh: SixNodeMesh, ends: Sequence[float], cells: int, grading: float) -> SixNodeMesh:
    """Move the nodes of straight ends to exact radii, so that both ends agree: gmsh places them to 1e-7 only.

    Args:
        mesh: The mesh, with ends that gmsh has graded.
        ends: Axial positions of the ends.
        cells: Number of cells on an end.
        grading: Length of the cell on the axis over that at the wall.
    """
    lengths = grading ** -np.linspace(0.0, 1.0, cells)
    radii = np.zeros(2 * cells + 1)
    radii[2::2] = TUBE_RADIUS * np.cumsum(lengths) / lengths.sum()
    radii[1::2] = (radii[:-1:2] + radii[2::2]) / 2
    points = mesh.points.copy()
    for z in ends:
        end = np.flatnonzero(np.abs(points[:, 0] - z) < 1e-9)
        points[end[np.argsort(points[end, 1])], 1] = radii
    return SixNodeMesh(points, mesh.cells)
