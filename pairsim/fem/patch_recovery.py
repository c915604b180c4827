"""Recovery of a field one degree above its Lagrange space, from polynomials fitted to its nodal values on patches.

Around each vertex a polynomial one degree higher is fitted by least squares to the values at the nodes of the cells
there; in a cell the three polynomials of its vertices are blended with the barycentric coordinates. The result is
continuous, and where the nodal values are more accurate than the interpolant it is closer to the exact field
(Zienkiewicz & Zhu, Int. J. Numer. Meth. Eng. 33, 1331, 1992; Bangerth & Rannacher, Adaptive Finite Element Methods for
Differential Equations, 2003, chapter 4).
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from pairsim.fem.six_node_mesh import SixNodeMesh
from pairsim.runtime.arrays import Array, Indices

# Ridge of the normal equations over their mean diagonal, for patches whose nodes do not settle all coefficients.
RIDGE = 1e-13


def _powers(degree: int) -> list[tuple[int, int]]:
    return [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]


def _monomials(x: Array, degree: int) -> Array:
    """All products z^i r^j with i + j up to a degree, (..., 2) -> (..., (degree + 1)(degree + 2)/2)."""
    powers = [np.ones_like(x)]
    for _ in range(degree):
        powers.append(powers[-1] * x)
    return np.stack([powers[i][..., 0] * powers[j][..., 1] for i, j in _powers(degree)], axis=-1)


class PatchRecovery:
    """Recovers fields of one Lagrange degree on a mesh.

    Args:
        mesh: The mesh.
        degree: Degree of the recovered fields, 2 (from values at the vertices) or 3 (from values at all nodes).
        fewest: Patches with fewer nodes than this take in the next ring of cells.
    """

    def __init__(self, mesh: SixNodeMesh, degree: int, fewest: int) -> None:
        self._mesh, self._degree = mesh, degree
        self._number = np.full(len(mesh.points), -1)
        self._number[mesh.vertices] = np.arange(len(mesh.vertices))
        patches = _patches(mesh, fewest, mesh.cells if degree == 3 else mesh.cells[:, :3])
        count = np.diff(patches.indptr)
        inside = np.arange(count.max()) < count[:, None]
        self._nodes = np.zeros(inside.shape, dtype=np.int64)
        self._nodes[inside] = patches.indices
        self._inside = inside
        self._centres = mesh.points[mesh.vertices]
        x = (mesh.points[self._nodes] - self._centres[:, None]) * inside[..., None]
        self._scales = np.sqrt((x**2).sum(axis=1) / count[:, None])
        basis = _monomials(x / self._scales[:, None], degree) * inside[..., None]
        self._basis, self._inverse = basis, _inverse_normal(basis)
        # On the axis a field is odd or even in r, and so is its polynomial, as if the patch had its mirror image.
        self._on_axis = np.flatnonzero(self._centres[:, 1] < 1e-12)
        self._of_parity = []
        for odd in (False, True):
            part = basis[self._on_axis] * [j % 2 == odd for _, j in _powers(degree)]
            self._of_parity.append((part, _inverse_normal(part)))

    def coefficients(self, values: Array, odd: bool) -> Array:
        """Polynomials around all vertices for nodal values (n_nodes, k) of fields of one parity in r."""
        at_nodes, (part, inverse) = values[self._nodes], self._of_parity[odd]
        found = self._inverse @ (np.swapaxes(self._basis, 1, 2) @ at_nodes)
        found[self._on_axis] = inverse @ (np.swapaxes(part, 1, 2) @ at_nodes[self._on_axis])
        return np.asarray(found)

    def blended(self, coefficients: Array, vertices: Indices, barycentric: Array, x: Array) -> Array:
        """The recovered fields at points of cells or edges.

        Args:
            coefficients: From `coefficients`.
            vertices: Nodes that are the vertices of each cell or edge, (m, v).
            barycentric: Coordinates of the points, (q, v).
            x: Positions of the points, (m, q, 2).

        Returns:
            Values, (m, q, k).
        """
        total = np.zeros((*x.shape[:2], coefficients.shape[2]))
        for weight, nodes in zip(barycentric.T, vertices.T, strict=True):
            at = self._number[nodes]
            local = (x - self._centres[at][:, None]) / self._scales[at][:, None]
            total += weight[:, None] * (_monomials(local, self._degree) @ coefficients[at])
        return total

    def fits(self, odd: bool) -> sparse.csr_matrix:
        """The polynomials around all vertices as a matrix that acts on the nodal values of a field of one parity in r.

        Returns:
            Shape (n_vertices k, n_nodes) for k coefficients.
        """
        part, inverse = self._of_parity[odd]
        every = self._inverse @ np.swapaxes(self._basis, 1, 2)
        every[self._on_axis] = inverse @ np.swapaxes(part, 1, 2)
        size, inside = every.shape[1], self._inside
        within = np.broadcast_to(inside[:, None], every.shape)
        columns = np.broadcast_to(self._nodes[:, None], every.shape)[within]
        starts = np.concatenate([[0], np.cumsum(np.repeat(inside.sum(axis=1), size))])
        return sparse.csr_matrix((every[within], columns, starts), shape=(len(every) * size, len(self._mesh.points)))

    def values(self, vertices: Indices, barycentric: Array, x: Array) -> sparse.csr_matrix:
        """The recovered field at points, as a matrix that acts on the polynomials of `fits`.

        Args:
            vertices: Nodes that are the vertices of each point's cell, (q, 3).
            barycentric: Coordinates of each point in it, (q, 3).
            x: Positions of the points, (q, 2).

        Returns:
            Shape (q, n_vertices k) for k coefficients.
        """
        at, size = self._number[vertices], self._basis.shape[2]
        local = (x[:, None] - self._centres[at]) / self._scales[at]
        powers = _monomials(local, self._degree) * barycentric[..., None]
        columns = at[..., None] * size + np.arange(size)
        starts = np.arange(len(x) + 1) * 3 * size
        return sparse.csr_matrix((powers.ravel(), columns.ravel(), starts), shape=(len(x), len(self._centres) * size))


def _inverse_normal(basis: Array) -> Array:
    """Inverse of the normal equations of a least-squares fit on every patch, (n_vertices, k, k)."""
    normal = np.swapaxes(basis, 1, 2) @ basis
    size = normal.shape[1]
    ridge = RIDGE * np.trace(normal, axis1=1, axis2=2) / size
    return np.asarray(np.linalg.inv(normal + ridge[:, None, None] * np.eye(size)))


def _patches(mesh: SixNodeMesh, fewest: int, carriers: Indices) -> sparse.csr_matrix:
    """Nodes among the carriers of cells that belong to the patch of every vertex: rows of a sparse matrix."""

    def incidence(nodes: Indices) -> sparse.csr_matrix:
        rows = np.repeat(np.arange(len(nodes)), nodes.shape[1])
        shape = (len(nodes), len(mesh.points))
        return sparse.csr_matrix((np.ones(nodes.size), (rows, nodes.ravel())), shape=shape)

    corners, carried = incidence(mesh.cells[:, :3]), incidence(carriers)
    around = sparse.csr_matrix(corners[:, mesh.vertices].T)
    patches, before = sparse.csr_matrix(around @ carried), 0
    while (small := np.diff(patches.indptr) < fewest).any() and patches.nnz > before:
        before, rows = patches.nnz, np.arange(len(small))
        wider = sparse.vstack([around, around @ corners @ corners.T], format="csr")
        around = wider[np.where(small, len(rows) + rows, rows)]
        patches = sparse.csr_matrix(around @ carried)
    patches.sort_indices()
    return patches
