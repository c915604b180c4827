"""Interpolation of P2 fields at arbitrary points."""

from __future__ import annotations

import numpy as np
import scipy

from pairsim.fem.compilation.loops import call
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh, shape_gradients, shape_values
from pairsim.runtime.arrays import Array

# Division of a six-node triangle into four linear ones, in which points are located.
_PARTS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])

# Barycentric coordinate, negative, down to which a point on a side belongs to a triangle; for rounding only.
ON_SIDE = 1e-12
CONVERGED = 1e-12  # change of a local coordinate, after which the next one is at rounding


def interpolate(mesh: SixNodeMesh, positions: Array, values: Array, wanted: Array) -> Array:
    """Interpolate P2 fields at given points.

    Args:
        mesh: Mesh whose cells are used.
        positions: Current positions of its nodes, shape (n, 2).
        values: Nodal values, shape (n, k).
        wanted: Points, shape (m, 2). For a point slightly outside a curved boundary the nearest cell is extrapolated.

    Returns:
        Values at the points, shape (m, k).
    """
    parts = np.ascontiguousarray(mesh.cells[:, _PARTS].reshape(-1, 3), dtype=np.int32)
    corners, places = (np.ascontiguousarray(points, dtype=np.float64) for points in (positions, wanted))
    found = np.empty(len(places), dtype=np.int32)
    if call("find_triangles", len(parts), parts, len(corners), corners, len(places), places, ON_SIDE, found):
        raise MemoryError
    cell = found.astype(np.int64) // len(_PARTS)
    lost = np.flatnonzero(found < 0)
    if lost.size:
        nearest = scipy.spatial.cKDTree(positions[mesh.cells].mean(axis=1)).query(wanted[lost])[1]
        cell[lost] = nearest
    nodes = mesh.cells[cell]
    local, left = np.full((len(wanted), 2), 1 / 3), np.arange(len(wanted))
    for _ in range(8):  # Newton's method for the local coordinates; the number of iterations was chosen
        points, at = positions[nodes[left]], local[left]
        miss = wanted[left] - np.einsum("ma,mai->mi", shape_values(at), points)
        dx = np.einsum("mak,mai->mik", shape_gradients(at), points)
        local[left] = np.clip(at + np.linalg.solve(dx, miss[..., None])[..., 0], -0.2, 1.2)
        left = left[np.abs(local[left] - at).max(axis=1) > CONVERGED]
    return np.asarray(np.einsum("ma,mak->mk", shape_values(local), values[nodes]))
