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

from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.fem.recovery.enriched_nodes import EnrichedNodes
from pairsim.runtime.arrays import Array, Indices

# Fewest nodes of a patch by degree of the recovered field: two rings of cells inside the mesh. Fewer nodes (9 and 15)
# gave estimates of .3 to .9 of the errors of Newtonian pairs, a third ring at boundaries (18 and 40) 1.1 to 1.9 where
# two rings gave 1.05 to 1.4.
WIDE = {2: 14, 3: 25}
# The same for a second recovery of quadratic fields, the pressures, mostly from one ring of cells. Where the two
# differ, neither is close to the adjoint: on coarse cells in viscoelastic liquids the difference is as large as the
# estimate.
NARROW = {2: 9}
# Ridge of the normal equations over their mean diagonal, for patches whose nodes do not determine all coefficients.
RIDGE = 1e-13


def _powers(degree: int) -> list[tuple[int, int]]:
    return [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]


def _monomials(x: Array, degree: int) -> Array:
    """All products z^i r^j with i + j up to a degree, (..., 2) -> (..., (degree + 1)(degree + 2)/2)."""
    powers = np.ones((degree + 1, 2, *x.shape[:-1]))
    for i in range(degree):
        powers[i + 1] = powers[i] * np.moveaxis(x, -1, 0)
    i, j = np.transpose(_powers(degree))
    return np.moveaxis(powers[i, 0] * powers[j, 1], 0, -1)


def _least_squares(basis: Array) -> Array:
    """Maps values at the points of patches to the coefficients of k functions, (v, points, k) -> (v, k, points)."""
    transposed, size = basis.transpose(0, 2, 1), basis.shape[2]
    normal = transposed @ basis
    ridge = RIDGE * normal.trace(axis1=1, axis2=2) / size
    return np.linalg.inv(normal + ridge[:, None, None] * np.eye(size)) @ transposed


class PatchRecovery:
    """Recovers fields of one Lagrange degree at the nodes of one degree higher.

    Args:
        nodes: The nodes.
        fewest: Patches with fewer nodes of the mesh than this are extended by the next ring of cells.
    """

    def __init__(self, nodes: EnrichedNodes, fewest: int) -> None:
        self._nodes, self._degree = nodes, nodes.degree
        mesh, number = nodes.mesh, np.full(len(nodes.mesh.points), -1)
        number[mesh.vertices] = np.arange(len(mesh.vertices))
        self._centres, patches = mesh.points[mesh.vertices], _patches(mesh, fewest, 6 if nodes.degree == 3 else 3)
        # Arrays over patches are padded to the size of the largest patch.
        count = np.diff(patches.indptr)
        self._filled = np.arange(count.max()) < count[:, None]
        self._members = np.zeros(self._filled.shape, dtype=np.int32)
        self._members[self._filled] = patches.indices
        x = (mesh.points[self._members] - self._centres[:, None]) * self._filled[..., None]
        self._scales = np.sqrt((x**2).sum(axis=1) / count[:, None])
        basis = _monomials(x / self._scales[:, None], self._degree) * self._filled[..., None]
        self._coefficients, self._on_axis = _least_squares(basis), self._centres[:, 1] < 1e-12
        self._basis = basis[self._on_axis]
        self._fits: dict[bool, sparse.csr_matrix] = {}
        self._blend = self._blended(number[nodes.vertices])

    def added(self, nodal: Array, odd: bool) -> Array:
        """What recovery adds to k fields of one parity in r at all nodes of one degree higher, (n, k).

        Args:
            nodal: Their values at the nodes of the mesh, (nodes of the mesh, k).
            odd: Whether they are odd in r, else they are even.
        """
        return np.asarray(self._blend @ (self.fits(odd) @ nodal) - self._nodes.interpolant @ nodal)

    def fits(self, odd: bool) -> sparse.csr_matrix:
        """The polynomials around all vertices as a matrix that acts on the nodal values of a field of one parity in r.

        Returns:
            Shape (n_vertices k, n_nodes) for k coefficients.
        """
        if odd not in self._fits:
            # At the axis a field is odd or even in r, and so is its polynomial, as if the patch had its mirror image.
            parity = np.array([j % 2 == odd for _, j in _powers(self._degree)])
            self._coefficients[self._on_axis] = _least_squares(self._basis * parity)
            size = len(parity)
            filled, columns = (np.repeat(each[:, None], size, axis=1) for each in (self._filled, self._members))
            ends = np.concatenate([[0], filled.sum(axis=2).cumsum()])
            shape = len(filled) * size, len(self._nodes.mesh.points)
            self._fits[odd] = sparse.csr_matrix((self._coefficients[filled], columns[filled], ends), shape=shape)
        return self._fits[odd]

    def _blended(self, patches: Indices) -> sparse.csr_matrix:
        """The recovered field at the nodes of one degree higher, as a matrix that acts on the polynomials of `fits`.

        Args:
            patches: Numbers of the patches around the vertices of each node's cell, (n, 3).

        Returns:
            Shape (n, n_vertices k) for k coefficients.
        """
        size, count = len(_powers(self._degree)), len(patches)
        local = (self._nodes.x[:, None] - self._centres[patches]) / self._scales[patches]
        powers = _monomials(local, self._degree) * self._nodes.barycentric[..., None]
        columns = patches[..., None].astype(np.int32) * size + np.arange(size, dtype=np.int32)
        starts, shape = np.arange(count + 1, dtype=np.int32) * 3 * size, (count, len(self._centres) * size)
        matrix = sparse.csr_matrix((powers.ravel(), columns.ravel(), starts), shape=shape)
        matrix.eliminate_zeros()  # for a node on a side the weight of the polynomial of the opposite vertex is zero
        return matrix.copy()


def _patches(mesh: SixNodeMesh, fewest: int, carried: int) -> sparse.csr_matrix:
    """Boolean matrix of the nodes in the patch around each vertex, shape (vertices, nodes).

    Args:
        mesh: The mesh.
        fewest: Patches with fewer nodes are extended by the next ring of cells.
        carried: Number of nodes of a cell that carry the field: 3 (the vertices) or 6.
    """

    def of_cells(numbers: Indices, count: int) -> sparse.csr_matrix:
        ends, shape = np.arange(len(numbers) + 1) * numbers.shape[1], (len(numbers), count)
        return sparse.csr_matrix((np.ones(numbers.size, dtype=bool), numbers.ravel(), ends), shape=shape)

    vertices = np.arange(len(mesh.vertices))
    corners = of_cells(np.searchsorted(mesh.vertices, mesh.cells[:, :3]), len(vertices))
    nodes = of_cells(mesh.cells[:, :carried], len(mesh.points))
    around, neighbours = (sparse.csr_matrix(corners.T @ each) for each in (nodes, corners))
    fewest = min(fewest, len(np.unique(mesh.cells[:, :carried])))  # a mesh of a few cells may have fewer in all
    row, patches, near = vertices.copy(), around, neighbours
    few = np.diff(patches.indptr) < fewest
    while few.any():
        vertices, near = vertices[few], near[few]
        more = near @ around
        row[vertices] = patches.shape[0] + np.arange(len(vertices))
        patches, near = sparse.vstack([patches, more], format="csr"), near @ neighbours
        few = np.diff(more.indptr) < fewest
    return patches[row]
