"""Meshes of six-node triangles as arrays: nodes, mirror images, shape functions and Jacobians."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pairsim.runtime.arrays import Array, Indices
from pairsim.runtime.errors import MeshFailure

# Permutation of the nodes of gmsh's six-node triangle that restores the orientation of a mirrored cell.
MIRRORED_CELL = np.array([0, 2, 1, 5, 4, 3])
_MIDSIDE_PARENTS = {3: (0, 1), 4: (1, 2), 5: (2, 0)}
# basix numbers mid-side nodes by the opposite vertex, gmsh by the first vertex of the side.
TO_BASIX = np.array([0, 1, 2, 4, 5, 3])
# Local number of the mid-side opposite each vertex.
MIDSIDE_OPPOSITE = (4, 5, 3)
SAME = 1e-9  # distance below which two nodes are the same [D_c]


@dataclass(frozen=True)
class SixNodeMesh:
    """A mesh of 6-node triangles in the half-plane (z, r >= 0).

    Attributes:
        points: Nodes, shape (n, 2).
        cells: Node numbers in gmsh's order (vertices, then mid-sides 01, 12, 20), shape (m, 6).
    """

    points: Array
    cells: Indices

    @cached_property
    def vertices(self) -> Indices:
        """Numbers of the nodes that are vertices, ascending."""
        return np.unique(self.cells[:, :3])

    @cached_property
    def parents(self) -> Indices:
        """The two end vertices of the side of each mid-side node, and a vertex itself twice, shape (n, 2)."""
        pair = np.repeat(np.arange(len(self.points))[:, None], 2, axis=1)
        for k, (i, j) in _MIDSIDE_PARENTS.items():
            pair[self.cells[:, k]] = self.cells[:, [i, j]]
        return pair

    @cached_property
    def jacobians(self) -> Array:
        """Jacobian determinants of all cells at seven points (see the function `jacobians`), shape (m, 7)."""
        return jacobians(self.points[self.cells])

    def at_nodes(self, values: Array) -> Array:
        """Mean at each node of the values of the cells around it, shape (m,) -> (n,)."""
        count, total = np.zeros(len(self.points)), np.zeros(len(self.points))
        np.add.at(count, self.cells, 1.0)
        np.add.at(total, self.cells, values[:, None])
        return total / count

    def mirror(self) -> SixNodeMesh:
        """The mirror image under z -> -z."""
        return SixNodeMesh(self.points * [-1.0, 1.0], self.cells[:, MIRRORED_CELL])

    def with_mirror_image(self) -> SixNodeMesh:
        """This mesh, of z >= 0, joined to its mirror image along z = 0."""
        on_plane = np.abs(self.points[:, 0]) < 1e-10
        points = self.points.copy()
        points[on_plane, 0] = 0.0
        image = np.arange(len(points))
        image[~on_plane] = len(points) + np.arange(np.count_nonzero(~on_plane))
        other = (points * [-1.0, 1.0])[~on_plane]
        return SixNodeMesh(np.vstack([points, other]), np.vstack([self.cells, image[self.cells[:, MIRRORED_CELL]]]))

    def repeated(self, count: int, length: float) -> tuple[SixNodeMesh, list[Indices]]:
        """Several copies side by side, joined at their ends, which have nodes at the same radii.

        Args:
            count: Number of copies.
            length: Length of each, which lies between -length/2 and length/2 [D_c].

        Returns:
            The mesh, whose middle is at z = 0, and for each copy the numbers of its nodes.
        """
        steps = (np.arange(count) - (count - 1) / 2) * length
        points = np.vstack([self.points + [step, 0.0] for step in steps])
        _, first, numbers = np.unique(np.round(points / SAME), axis=0, return_index=True, return_inverse=True)
        numbers = numbers.reshape(count, -1)
        return SixNodeMesh(points[first], np.vstack([each[self.cells] for each in numbers])), list(numbers)

    def nodes_of_plane(self, z: float) -> Indices:
        """Nodes of a cross-section, in ascending r."""
        nodes = np.flatnonzero(np.abs(self.points[:, 0] - z) < SAME)
        return nodes[np.argsort(self.points[nodes, 1])]


def barycentric(points: Array) -> Array:
    """Barycentric coordinates, the P1 shape functions, at points of the reference triangle, (q, 2) -> (q, 3)."""
    return np.column_stack([1 - points.sum(axis=1), points])


def shape_values(points: Array) -> Array:
    """The six P2 shape functions at points of the reference triangle, shape (q, 2); returns shape (q, 6)."""
    s, t = points[:, 0], points[:, 1]
    u = 1 - s - t
    return np.stack([u * (2 * u - 1), s * (2 * s - 1), t * (2 * t - 1), 4 * u * s, 4 * s * t, 4 * t * u], axis=1)


def shape_gradients(points: Array) -> Array:
    """Gradients of the P2 shape functions in the reference triangle at points, shape (q, 2); returns (q, 6, 2)."""
    s, t = points[:, 0], points[:, 1]
    u = 1 - s - t
    zero = np.zeros_like(s)
    ds = np.stack([1 - 4 * u, 4 * s - 1, zero, 4 * (u - s), 4 * t, -4 * t], axis=1)
    dt = np.stack([1 - 4 * u, zero, 4 * t - 1, -4 * s, 4 * s, 4 * (u - t)], axis=1)
    return np.stack([ds, dt], axis=2)


# Vertices, mid-sides and centroid: good samples of the determinant, which is a polynomial of degree 2.
_SAMPLES = shape_gradients(
    np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5], [1 / 3, 1 / 3]], dtype=np.float64)
)


def jacobians(cell_points: Array) -> Array:
    """Jacobian determinants of the maps from the reference triangle at vertices, mid-sides and centroid.

    Args:
        cell_points: Node positions of each cell, shape (m, 6, 2).

    Returns:
        Determinants, shape (m, 7); all positive in a valid mesh.
    """
    dx = np.einsum("qak,mai->mqik", _SAMPLES, cell_points, optimize=True)  # uses BLAS, fifty times as fast
    return np.asarray(dx[..., 0, 0] * dx[..., 1, 1] - dx[..., 0, 1] * dx[..., 1, 0])


def nodes_at(points: Array, wanted: Array) -> Indices:
    """Indices of the points at given positions.

    Args:
        points: Points, shape (n, 2).
        wanted: Positions, shape (k, 2).

    Returns:
        Indices, shape (k,); -1 where no point is within `SAME` in both coordinates.
    """
    order = np.argsort(points[:, 0])
    z = points[order, 0]
    first, last = np.searchsorted(z, wanted[:, 0] - SAME), np.searchsorted(z, wanted[:, 0] + SAME, "right")
    found = np.full(len(wanted), -1, dtype=np.int64)
    for i, r in enumerate(wanted[:, 1]):
        column = order[first[i] : last[i]]
        away = np.abs(points[column, 1] - r)
        if len(column) and away.min() <= SAME:
            found[i] = column[away.argmin()]
    return found


def match(points: Array, wanted: Array) -> Indices:
    """Indices of the points at given positions.

    Args:
        points: Points, shape (n, 2).
        wanted: Positions, shape (k, 2).

    Returns:
        Indices, shape (k,).

    Raises:
        MeshFailure: There is no point at a position.
    """
    index = nodes_at(points, wanted)
    if index.min() < 0:
        raise MeshFailure("a node of an outline is not one of the mesh")
    return index
