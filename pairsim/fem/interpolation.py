"""Interpolation of P2 fields at arbitrary points."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from pairsim.fem.six_node_mesh import SixNodeMesh, shape_gradients, shape_values
from pairsim.runtime.arrays import Array

# Division of a six-node triangle into four linear ones, in which points are located.
_PARTS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])


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
    from matplotlib.tri import Triangulation  # takes a third of the start-up and is not needed by every case

    parts = mesh.cells[:, _PARTS].reshape(-1, 3)
    finder = Triangulation(positions[:, 0], positions[:, 1], parts).get_trifinder()
    found = np.asarray(finder(wanted[:, 0], wanted[:, 1]), dtype=np.int64)
    cell = found // len(_PARTS)
    lost = np.flatnonzero(found < 0)
    if lost.size:
        nearest = cKDTree(positions[mesh.cells].mean(axis=1)).query(wanted[lost])[1]
        cell[lost] = nearest
    nodes = mesh.cells[cell]
    local = np.full((len(wanted), 2), 1 / 3)
    for _ in range(8):  # Newton's method for the local coordinates; the number of iterations was chosen
        miss = wanted - np.einsum("ma,mai->mi", shape_values(local), positions[nodes])
        dx = np.einsum("mak,mai->mik", shape_gradients(local), positions[nodes])
        local = np.clip(local + np.linalg.solve(dx, miss[..., None])[..., 0], -0.2, 1.2)
    return np.asarray(np.einsum("ma,mak->mk", shape_values(local), values[nodes]))
