"""Interpolation of P2 fields at arbitrary points."""

from __future__ import annotations

import numpy as np
import scipy
from scipy import sparse

from pairsim.fem.meshes.six_node_mesh import SixNodeMesh, shape_gradients, shape_values
from pairsim.runtime.arrays import Array, Indices

# Division of a six-node triangle into four linear ones, in which points are located.
_PARTS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])

# A point belongs to a triangle if no barycentric coordinate is below minus this; an allowance for rounding.
ON_SIDE = 1e-12
CONVERGED = 1e-12  # change of a local coordinate after which the next change is rounding error


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
    cell = containing(mesh.cells[:, _PARTS].reshape(-1, 3), positions, wanted) // len(_PARTS)
    if (lost := cell < 0).any():
        cell[lost] = scipy.spatial.cKDTree(positions[mesh.cells].mean(axis=1)).query(wanted[lost])[1]
    nodes = mesh.cells[cell]
    local, left = np.full((len(wanted), 2), 1 / 3), np.arange(len(wanted))
    for _ in range(8):  # Newton's method for the local coordinates; the number of iterations was chosen
        points, at = positions[nodes[left]], local[left]
        miss = wanted[left] - np.einsum("ma,mai->mi", shape_values(at), points)
        dx = points.transpose(0, 2, 1) @ shape_gradients(at)
        local[left] = np.clip(at + (_inverses(dx) @ miss[..., None])[..., 0], -0.2, 1.2)
        left = left[np.abs(local[left] - at).max(axis=1) > CONVERGED]
    return np.asarray(np.einsum("ma,mak->mk", shape_values(local), values[nodes]))


def containing(triangles: Indices, points: Array, places: Array) -> Indices:
    """The first triangle that contains each place, -1 where none does.

    A place is tried in the triangles whose bounding boxes touch its rectangle of a grid. (The trapezoidal map of
    matplotlib is as fast, but takes half a second to import; DOLFINx needs a mesh of its own, four times as long.)

    Args:
        triangles: Numbers of the corners, shape (t, 3).
        points: Positions of the corners, shape (n, 2).
        places: The places, shape (m, 2).

    Returns:
        Numbers of triangles, shape (m,).
    """
    x, low = points[triangles], points.min(axis=0)
    size = points.max(axis=0) - low
    shape = 1 + (size / np.sqrt(size.prod() / len(x))).astype(np.int64)

    def rectangles(at: Array) -> Indices:
        return np.clip((at - low) / size * shape, 0, shape - 1).astype(np.int64)

    first = rectangles(x.min(axis=1))
    touched = rectangles(x.max(axis=1)) - first + 1
    count = touched.prod(axis=1)
    triangle = np.repeat(np.arange(len(x)), count)
    number = np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count)
    along, across = first[triangle].T + np.divmod(number, touched[triangle, 1])
    entries = np.ones(len(triangle), dtype=bool), (along * shape[1] + across, triangle)
    tried = sparse.csr_matrix(entries, shape=(shape.prod(), len(x)))[rectangles(places) @ [shape[1], 1]]
    place, triangle = np.repeat(np.arange(len(places)), np.diff(tried.indptr)), tried.indices
    sides, (z, r) = _inverses(x[:, 1:] - x[:, :1]), (places[place] - x[triangle, 0]).T
    (s_z, s_r), (t_z, t_r) = sides.T[..., triangle]
    s, t = s_z * z + s_r * r, t_z * z + t_r * r
    inside = np.minimum(np.minimum(s, t), 1 - s - t) >= -ON_SIDE
    found = np.full(len(places), -1)
    found[place[inside][::-1]] = triangle[inside][::-1]  # of several values the last one stays
    return found


def _inverses(matrices: Array) -> Array:
    """The inverses of matrices of two rows, (m, 2, 2); LAPACK's, one by one, take seven times as long."""
    (a, b), (c, d) = matrices.transpose(1, 2, 0)
    return np.array([[d, -b], [-c, a]]).transpose(2, 0, 1) / (a * d - b * c)[:, None, None]
