"""Integrals over six-node meshes in numpy, for diagnostics and for the constant vectors of a scene."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import pi

import basix
import numpy as np
from scipy import sparse

from pairsim.fem.meshes.six_node_mesh import SixNodeMesh, shape_gradients, shape_values
from pairsim.runtime.arrays import Array, Indices


@dataclass(frozen=True)
class CellQuadrature:
    """Quadrature over the m cells of a mesh with q points in each.

    Attributes:
        mesh: The reference mesh, with n nodes and v vertices.
        degree: Degree of the polynomials that are integrated exactly on cells with straight sides.
    """

    mesh: SixNodeMesh
    degree: int = 6

    @cached_property
    def _rule(self) -> tuple[Array, Array]:
        points, weights = basix.make_quadrature(basix.CellType.triangle, self.degree)
        return points, weights

    @cached_property
    def shapes(self) -> Array:
        """P2 shape functions at the quadrature points, shape (q, 6)."""
        return shape_values(self._rule[0])

    @cached_property
    def _local_gradients(self) -> Array:
        return shape_gradients(self._rule[0])

    @cached_property
    def gradients(self) -> Array:
        """Gradients of the shape functions with respect to the reference coordinates, shape (m, q, 6, 2)."""
        dx = np.einsum("qak,mai->mqik", self._local_gradients, self.mesh.points[self.mesh.cells])
        return np.asarray(np.einsum("qak,mqki->mqai", self._local_gradients, np.linalg.inv(dx)))

    @property
    def gradient_products(self) -> Array:
        """Integrals of d_i N_a d_j N_b/|det dX| over the cells for shape functions N, shape (m, 6, 2, 6, 2).

        With this factor, which cancels the determinant of the integral, small cells are stiffer than large ones.
        """
        flat = self.gradients.reshape(*self.gradients.shape[:2], 12)
        return (flat.transpose(0, 2, 1) @ (self._rule[1][:, None] * flat)).reshape(-1, 6, 2, 6, 2)

    def weights(self, points: Array) -> Array:
        """Weights of volume integrals, 2 pi R dA, with the nodes at `points`, shape (n, 2); returns shape (m, q)."""
        x = points[self.mesh.cells]
        dx = np.einsum("qak,mai->mqik", self._local_gradients, x, optimize=True)
        det = dx[..., 0, 0] * dx[..., 1, 1] - dx[..., 0, 1] * dx[..., 1, 0]
        radius = np.einsum("qa,ma->mq", self.shapes, x[..., 1], optimize=True)
        return np.asarray(2 * pi * radius * det * self._rule[1])

    def volume(self, points: Array) -> float:
        """Volume of the body of revolution with the nodes at `points`, shape (n, 2)."""
        return float(self.weights(points).sum())

    def mean(self, values: Array, points: Array) -> float:
        """Volume average of a P2 field with nodal values of shape (n,), with the nodes at `points`, shape (n, 2)."""
        w = self.weights(points)
        at_points = np.einsum("qa,ma->mq", self.shapes, values[self.mesh.cells], optimize=True)
        return float((w * at_points).sum() / w.sum())

    def mean_weights(self, points: Array) -> Array:
        """The weights of the nodal values in `mean`, with the nodes at `points`, shape (n, 2); returns shape (n,)."""
        w = self.weights(points)
        at_nodes = np.einsum("qa,mq->ma", self.shapes, w)
        return np.bincount(self.mesh.cells.ravel(), at_nodes.ravel(), len(points)) / w.sum()

    def integrals(self, weights: Array) -> Array:
        """Integrals of the P1 shape functions with weights at the quadrature points, (m, q); returns shape (v,)."""
        s, t = self._rule[0].T
        linear = np.stack([1 - s - t, s, t], axis=1)
        load = np.zeros(len(self.mesh.points))
        np.add.at(load, self.mesh.cells[:, :3], np.einsum("mq,qa->ma", weights, linear))
        return load[self.mesh.vertices]

    @cached_property
    def p1_load(self) -> Array:
        """Volume integrals of the P1 shape functions over the reference domain, shape (v,)."""
        return self.integrals(self.weights(self.mesh.points))


def assembled(cells: Array, unknowns: Indices, size: int) -> sparse.csr_matrix:
    """Assemble a global matrix from those of the cells.

    Args:
        cells: Matrices of the cells, shape (m, k, k).
        unknowns: Global numbers of their rows and columns, shape (m, k).
        size: Number of all unknowns.

    Returns:
        The matrix, shape (size, size).
    """
    k = unknowns.shape[1]
    at = np.repeat(unknowns, k, axis=1).ravel(), np.tile(unknowns, (1, k)).ravel()
    return sparse.csr_matrix(sparse.coo_matrix((cells.ravel(), at), shape=(size, size)))


def end_load(mesh: SixNodeMesh, nodes: Indices, degree: int) -> Array:
    """Integrals of the shape functions over an end of the tube, int N_a 2 pi r dr.

    Args:
        mesh: The mesh of the liquid.
        nodes: Nodes of the end in ascending r, vertices and mid-sides alternating, shape (2 k + 1,).
        degree: Degree of the shape functions: 2, or 1 with zeros at the mid-sides.

    Returns:
        One weight for each node, shape (2 k + 1,).
    """
    r = mesh.points[nodes, 1]
    gauss, w = np.polynomial.legendre.leggauss(4)
    s = (gauss + 1) / 2
    if degree == 2:
        shapes = np.stack([(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)])
    else:
        shapes = np.stack([1 - s, np.zeros_like(s), s])
    load = np.zeros(len(nodes))
    for k in range(0, len(nodes) - 2, 2):
        width = r[k + 2] - r[k]
        radius = r[k] + width * s
        load[k : k + 3] += (shapes * (w / 2 * width * 2 * pi * radius)).sum(axis=1)
    return load
