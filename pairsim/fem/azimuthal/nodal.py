"""Derivatives of nodal fields at nodes."""

from __future__ import annotations

import numpy as np

from pairsim.fem.meshes.six_node_mesh import SixNodeMesh, shape_gradients
from pairsim.runtime.arrays import Array

NODES_OF_CELL = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]])
"""Nodes of the reference triangle in the order of `SixNodeMesh.cells`."""


def derivative_along(mesh: SixNodeMesh, values: Array, direction: Array) -> Array:
    """The derivative of a field along a direction at the nodes, averaged over the cells around each.

    Args:
        mesh: The mesh.
        values: The field at its nodes, shape (n, k).
        direction: Direction at its nodes, shape (n, 2).

    Returns:
        Shape (n, k).
    """
    local = shape_gradients(NODES_OF_CELL)
    dX, df = (np.einsum("qak,mai->mqik", local, each[mesh.cells]) for each in (mesh.points, values))
    along = np.einsum("mqik,mqk->mqi", df, np.linalg.solve(dX, direction[mesh.cells][..., None])[..., 0])
    nodes = mesh.cells.ravel()
    sums = [np.bincount(nodes, along[..., c].ravel(), len(mesh.points)) for c in range(values.shape[1])]
    return np.column_stack(sums) / np.bincount(nodes, minlength=len(mesh.points))[:, None]
