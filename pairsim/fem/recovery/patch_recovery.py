"""Recovery of a field one degree above its Lagrange space, from polynomials fitted to its nodal values on patches.

Around each vertex a polynomial one degree higher is fitted by least squares to the values at the nodes of the cells
there; in a cell the three polynomials of its vertices are blended with the barycentric coordinates. The result is
continuous, and where the nodal values are more accurate than the interpolant it is closer to the exact field
(Zienkiewicz & Zhu, Int. J. Numer. Meth. Eng. 33, 1331, 1992; Bangerth & Rannacher, Adaptive Finite Element Methods for
Differential Equations, 2003, chapter 4).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from pairsim.fem.compilation.loops import call
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.fem.recovery.enriched_nodes import EnrichedNodes
from pairsim.runtime.arrays import Array, Indices

# Fewest nodes of a patch by degree of the recovered field: two rings of cells inside the mesh. Fewer nodes (9 and 15)
# gave estimates of .3 to .9 of the errors of Newtonian pairs, a third ring at boundaries (18 and 40) 1.1 to 1.9 where
# two rings gave 1.05 to 1.4.
WIDE = {2: 14, 3: 25}
# That of a second recovery of quadratic fields, the pressures, mostly from one ring. Where both differ, neither is near
# the adjoint: on coarse cells in viscoelastic liquids the difference is as large as the estimate.
NARROW = {2: 9}
# Ridge of the normal equations over their mean diagonal, for patches whose nodes do not settle all coefficients.
RIDGE = 1e-13
ANY = -1  # parity of polynomials that are neither even nor odd in r
SINGULAR = 2  # status of `patch_fits`


def _powers(degree: int) -> list[tuple[int, int]]:
    return [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]


def _monomials(x: Array, degree: int) -> Array:
    """All products z^i r^j with i + j up to a degree, (..., 2) -> (..., (degree + 1)(degree + 2)/2)."""
    powers = [np.ones_like(x)]
    for _ in range(degree):
        powers.append(powers[-1] * x)
    return np.stack([powers[i][..., 0] * powers[j][..., 1] for i, j in _powers(degree)], axis=-1)


class PatchRecovery:
    """Recovers fields of one Lagrange degree at the nodes of one degree higher.

    Args:
        nodes: The nodes.
        fewest: Patches with fewer nodes of the mesh than this take in the next ring of cells.
    """

    def __init__(self, nodes: EnrichedNodes, fewest: int) -> None:
        self._nodes, self._degree = nodes, nodes.degree
        mesh, number = nodes.mesh, np.full(len(nodes.mesh.points), -1)
        number[mesh.vertices] = np.arange(len(mesh.vertices))
        self._pointer, self._around = _patches(mesh, number, fewest, 6 if nodes.degree == 3 else 3)
        self._centres, pointer = mesh.points[mesh.vertices], self._pointer
        x = mesh.points[self._around] - np.repeat(self._centres, np.diff(pointer), axis=0)
        self._scales = np.sqrt(np.add.reduceat(x**2, pointer[:-1], axis=0) / np.diff(pointer)[:, None])
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
        if odd in self._fits:
            return self._fits[odd]
        size = len(_powers(self._degree))
        if self._fits:
            other = self._fits[not odd]
            data, columns, ends = other.data.copy(), other.indices, other.indptr
        else:
            data, columns = np.empty(len(self._around) * size), np.empty(len(self._around) * size, dtype=np.int32)
            ends = np.concatenate([[0], np.cumsum(np.repeat(np.diff(self._pointer), size))])
            self._fit(np.arange(len(self._centres)), ANY, data, columns)
        # On the axis a field is odd or even in r, and so is its polynomial, as if the patch had its mirror image.
        self._fit(np.flatnonzero(self._centres[:, 1] < 1e-12), int(odd), data, columns)
        shape = len(self._centres) * size, len(self._nodes.mesh.points)
        self._fits[odd] = sparse.csr_matrix((data, columns, ends), shape=shape)
        return self._fits[odd]

    def _fit(self, patches: Indices, parity: int, data: Array, columns: NDArray[np.int32]) -> None:
        """Set the rows of some patches, whose polynomials have ANY parity in r, are even (0) or odd (1)."""
        points = np.ascontiguousarray(self._nodes.mesh.points)
        status = call(
            *("patch_fits", len(patches), patches, self._pointer, self._around, points),
            *(self._centres, self._scales, np.int32(self._degree), np.int32(parity), RIDGE, data, columns),
        )
        if status == SINGULAR:
            raise np.linalg.LinAlgError("the nodes of a patch do not settle a polynomial")
        if status:
            raise MemoryError

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
        matrix.eliminate_zeros()  # a node on a side has no part of the polynomial of the vertex opposite
        return matrix.copy()


def _patches(mesh: SixNodeMesh, vertex: Indices, fewest: int, carried: int) -> tuple[Indices, NDArray[np.int32]]:
    """Nodes of the patch of every vertex, in compressed form.

    Args:
        mesh: The mesh.
        vertex: Number of each node among the vertices.
        fewest: Patches with fewer nodes take in the next ring of cells.
        carried: Number of nodes of a cell that count, the vertices or all.
    """
    corners, count = vertex[mesh.cells[:, :3]].ravel(), len(mesh.vertices)
    around = np.argsort(corners, kind="stable") // 3
    around_pointer = np.concatenate([[0], np.cumsum(np.bincount(corners, minlength=count))])
    pointer, most, found = np.empty(count + 1, dtype=np.int64), 2 * fewest * count, -1
    while found < 0:
        nodes, markers = np.empty(most, dtype=np.int32), [np.full(len(each), -1) for each in (mesh.cells, mesh.points)]
        found = call(
            *("patch_nodes", count, around_pointer, around, vertex, np.ascontiguousarray(mesh.cells)),
            *(np.int32(mesh.cells.shape[1]), np.int32(carried), fewest, *markers),
            *(np.empty(len(mesh.cells), dtype=np.int64), most, pointer, nodes),
        )
        most *= 2
    return pointer, nodes[:found].copy()
