"""Nodes of the continuous Lagrange space one degree above that of a field, and what recovery adds to it there."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from pairsim.fem.enriched_residual import nodes_of
from pairsim.fem.patch_recovery import PatchRecovery
from pairsim.fem.six_node_mesh import MIDSIDE_OPPOSITE, SixNodeMesh, shape_values
from pairsim.runtime.arrays import Array, Indices


class EnrichedNodes:
    """Nodes of one degree higher on a mesh, shared by neighbouring cells.

    Args:
        mesh: The mesh.
        degree: Degree of the nodes, 2 or 3: that of the recovered fields.
        fewest: Fewest nodes of a patch (see `PatchRecovery`).

    Attributes:
        numbers: Numbers of the nodes of each cell, in the order of `nodes_of`, (m, q).
        count: Number n of all nodes.
    """

    def __init__(self, mesh: SixNodeMesh, degree: int, fewest: int) -> None:
        self._mesh, self._degree, cells = mesh, degree, mesh.cells
        points = nodes_of(degree)
        barycentric = np.column_stack([1 - points.sum(axis=1), points])
        keys = np.stack([self._key(each) for each in barycentric], axis=1)
        self._keys, first, numbers = np.unique(keys, return_index=True, return_inverse=True)
        self.numbers: Indices = numbers.reshape(keys.shape)
        cell, place = np.divmod(first, len(points))
        x = np.einsum("qa,qak->qk", shape_values(points)[place], mesh.points[cells[cell]])
        own = own_shapes(degree)[place]
        rows = np.repeat(np.arange(len(first)), own.shape[1])
        columns = cells[cell, : own.shape[1]].ravel()
        self._interpolant = sparse.csr_matrix((own.ravel(), (rows, columns)), shape=(len(first), len(mesh.points)))
        self._recovery = PatchRecovery(mesh, degree, fewest)
        self._values = self._recovery.values(cells[cell, :3], barycentric[place], x)
        self.count = len(first)

    def added(self, nodal: Array, odd: bool) -> Array:
        """What recovery adds at all nodes to a field, (n,).

        Args:
            nodal: Its values at the nodes of the mesh, (n_nodes,).
            odd: Its parity in r.
        """
        return np.asarray(self._values @ (self._recovery.fits(odd) @ nodal) - self._interpolant @ nodal)

    def _key(self, barycentric: Array) -> Indices:
        """A number for the node of each cell with these coordinates, the same in all cells that have it."""
        cells, count, present = self._mesh.cells, len(self._mesh.points), np.flatnonzero(barycentric > 1e-12)
        if len(present) == 1:
            return cells[:, present[0]]
        if len(present) == 3:
            return 3 * count + np.arange(len(cells))
        near, far = present[np.argsort(-barycentric[present], kind="stable")]
        side = cells[:, MIDSIDE_OPPOSITE[3 - near - far]]
        return self._on_side(side, cells[:, near], cells[:, far])

    def _on_side(self, side: Indices, near: Indices, far: Indices) -> Indices:
        """The numbers of nodes on sides, given by their mid-side nodes, that are nearer to one of their ends."""
        first = near > far if self._degree == 3 else np.zeros(len(near), dtype=bool)
        return np.asarray(len(self._mesh.points) + 2 * side + first)

    def along(self, line: Indices) -> Indices:
        """Numbers of the nodes along a line of nodes of the mesh, in its order.

        Args:
            line: Vertices and mid-sides alternating, (2 k + 1,).
        """
        start, side, end = line[:-2:2], line[1::2], line[2::2]
        inner = [self._on_side(side, start, end)] + [self._on_side(side, end, start)] * (self._degree == 3)
        keys = np.append(np.stack([start, *inner], axis=1).ravel(), line[-1:])
        return np.asarray(np.searchsorted(self._keys, keys))


def own_shapes(degree: int) -> Array:
    """Shape functions one degree lower at the nodes of a degree, (q, a)."""
    points = nodes_of(degree)
    return shape_values(points) if degree == 3 else np.column_stack([1 - points.sum(axis=1), points])
