"""Nodes of the continuous Lagrange space one degree above that of a field."""

from __future__ import annotations

from functools import cache

import basix
import numpy as np
from scipy import sparse

from pairsim.fem.meshes.six_node_mesh import MIDSIDE_OPPOSITE, SixNodeMesh, barycentric, shape_values
from pairsim.runtime.arrays import Array, Indices


def _element(degree: int) -> basix.finite_element.FiniteElement:
    variant = basix.LagrangeVariant.gll_warped
    return basix.create_element(basix.ElementFamily.P, basix.CellType.triangle, degree, variant)


def nodes_of(degree: int) -> Array:
    """Nodes of the Lagrange element of a degree on the reference triangle, (q, 2)."""
    points: Array = _element(degree).points
    return points


def own_shapes(degree: int) -> Array:
    """Values of the a shape functions one degree lower at the nodes of a degree, (q, a)."""
    points = nodes_of(degree)
    return shape_values(points) if degree == 3 else barycentric(points)


def tabulated(degree: int, points: Array) -> tuple[Array, Array]:
    """Shape functions of a degree, (q, a), and their gradients, (q, a, 2), at q points of the reference triangle."""
    table = _element(degree).tabulate(1, points)[..., 0]
    return table[0], np.moveaxis(table[1:], 0, -1)


@cache
def remainder(degree: int) -> Array:
    """Matrix from the nodal values of a polynomial to those of its interpolation error one degree lower, (q, q)."""
    points = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]])[: 6 if degree == 3 else 3]
    at_nodes, own = _element(degree).tabulate(0, points)[0, :, :, 0], own_shapes(degree)
    return np.asarray(np.eye(len(own)) - own @ at_nodes)


class EnrichedNodes:
    """Nodes of one degree higher on a mesh, shared by neighbouring cells.

    Args:
        mesh: The mesh.
        degree: Degree of the nodes: 2 for P1 fields, which the vertices of the mesh carry, or 3 for P2 fields.

    Attributes:
        numbers: Numbers of the nodes of each cell, in the order of `nodes_of`, (m, q).
        count: Number n of all nodes.
        vertices: Vertices of a cell that has each node, (n, 3).
        barycentric: Barycentric coordinates of each node in this cell, (n, 3).
        x: Positions of the nodes, (n, 2).
        interpolant: Matrix that interpolates a field from its values at the nodes of the mesh, (n, nodes of the mesh).
    """

    def __init__(self, mesh: SixNodeMesh, degree: int) -> None:
        self.mesh, self.degree, cells = mesh, degree, mesh.cells
        points = nodes_of(degree)
        coordinates = barycentric(points)
        keys = np.stack([self._key(each) for each in coordinates], axis=1)
        self._keys, first, numbers = np.unique(keys, return_index=True, return_inverse=True)
        self.numbers: Indices = numbers.reshape(keys.shape)
        self.count = len(first)
        cell, place = np.divmod(first, len(points))
        self.vertices: Indices = cells[cell, :3]
        self.barycentric: Array = coordinates[place]
        self.x: Array = np.einsum("qa,qak->qk", shape_values(points)[place], mesh.points[cells[cell]])
        own = own_shapes(degree)[place]
        rows, columns = np.repeat(np.arange(self.count), own.shape[1]), cells[cell, : own.shape[1]].ravel()
        self.interpolant = sparse.csr_matrix((own.ravel(), (rows, columns)), shape=(self.count, len(mesh.points)))

    def _key(self, barycentric: Array) -> Indices:
        """A number for the node with these coordinates in each cell, the same in all cells that share it, (m,)."""
        cells, count, present = self.mesh.cells, len(self.mesh.points), np.flatnonzero(barycentric > 1e-12)
        if len(present) == 1:
            return cells[:, present[0]]
        if len(present) == 3:
            return 3 * count + np.arange(len(cells))
        near, far = present[np.argsort(-barycentric[present], kind="stable")]
        side = cells[:, MIDSIDE_OPPOSITE[3 - near - far]]
        return self._on_side(side, cells[:, near], cells[:, far])

    def _on_side(self, side: Indices, near: Indices, far: Indices) -> Indices:
        """Numbers of the nodes on given sides that are nearer to the vertex `near` than to `far`.

        Args:
            side: The mid-side node of each side.
            near: The vertex of each side that is nearer.
            far: The other vertex.
        """
        first = near > far if self.degree == 3 else np.zeros(len(near), dtype=bool)
        return np.asarray(len(self.mesh.points) + 2 * side + first)

    def along(self, line: Indices) -> Indices:
        """Numbers of the nodes along a line of nodes of the mesh, in its order.

        Args:
            line: Vertices and mid-sides alternating, (2 k + 1,).
        """
        start, side, end = line[:-2:2], line[1::2], line[2::2]
        inner = [self._on_side(side, start, end)] + [self._on_side(side, end, start)] * (self.degree == 3)
        keys = np.append(np.stack([start, *inner], axis=1).ravel(), line[-1:])
        return np.asarray(np.searchsorted(self._keys, keys))
