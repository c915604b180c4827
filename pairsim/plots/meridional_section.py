"""Drawing the meridional section: curved cells as fine triangles, surfaces of particles as fine polylines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.tri import Triangulation
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import depth_first_order

from pairsim.results.xdmf import FieldFrame
from pairsim.runtime.arrays import Array, Indices

EDGES = [(0, 1, 3), (1, 2, 4), (2, 0, 5)]
"""Corners and mid-node of the edges of a cell (VTK's order)."""
ON_AXIS = 1e-8


@dataclass(frozen=True)
class Surface:
    """Straight triangles in the (z, r) plane with a value at each node: (n, 2), (m, 3), (n,)."""

    points: Array
    triangles: NDArray[np.int64]
    values: Array

    def triangulation(self, side: int) -> Triangulation:
        """The triangles above the axis (1), or their mirror images below it (-1)."""
        return Triangulation(self.points[:, 0], side * self.points[:, 1], self.triangles)


def _line(s: Array) -> Array:
    """Quadratic shape functions of an edge at s in [0, 1]: both ends, middle."""
    return np.stack([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)], axis=-1)


def _lattice(level: int) -> tuple[Array, NDArray[np.int64]]:
    """Shape functions on a regular lattice of one cell, (nodes, 6), and the triangles between its nodes."""
    grid = [(i, j) for j in range(level + 1) for i in range(level + 1 - j)]
    b, c = np.array(grid, dtype=float).T / level
    a = 1 - b - c
    shapes = [a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * c * a]
    return np.stack(shapes, axis=1), Triangulation(b, c).triangles.astype(np.int64)


def tessellate(frame: FieldFrame, chosen: NDArray[np.bool_], values: Array, level: int = 3) -> Surface:
    """Some cells of a frame, each edge divided into `level` pieces along its curve.

    Args:
        frame: Mesh, (m) six-node triangles and (n) nodes.
        chosen: Which cells, (m,).
        values: What to show, at the nodes, (n,).
        level: Pieces of an edge.
    """
    cells = frame.cells[chosen]
    shapes, triangles = _lattice(level)
    points = np.einsum("qa,mai->mqi", shapes, frame.points[cells]).reshape(-1, 2)
    starts = np.arange(len(cells))[:, None, None] * len(shapes)
    return Surface(points, (triangles + starts).reshape(-1, 3), (values[cells] @ shapes.T).ravel())


def surface_nodes(frame: FieldFrame) -> list[Indices]:
    """The nodes of the liquid's cells on each particle, corners and mid-nodes in turn, (2k + 1,), from upstream.

    They are read off the liquid, so that rigid particles, which have no cells, have them too.
    """
    cells = frame.cells[frame.region == 0]
    edges = np.vstack([cells[:, edge] for edge in EDGES])
    _, first, count = np.unique(np.sort(edges[:, :2], axis=1), axis=0, return_index=True, return_counts=True)
    edges = edges[first[count == 1]]
    edges = edges[(np.abs(frame.points[edges, 1]) > ON_AXIS).any(axis=1)]
    a, b, middle = edges.T
    # Halves of edges: the surface of a particle is a path of them from pole to pole.
    halves, n = (np.concatenate([a, middle]), np.concatenate([middle, b])), len(frame.points)
    graph = coo_array((np.ones(2 * len(edges)), halves), shape=(n, n)).tocsr()
    ends = np.flatnonzero(np.bincount(np.concatenate(halves), minlength=n) == 1)
    wall, z = float(frame.points[edges, 1].max(initial=0.0)), frame.points[:, 0]
    paths = [depth_first_order(graph, end, directed=False, return_predecessors=False) for end in ends]
    paths = [path for path in paths if frame.points[path, 1].max() < (1 - 1e-6) * wall and z[path[0]] <= z[path[-1]]]
    return sorted((path.astype(np.int64) for path in paths), key=lambda path: float(z[path].mean()))


def outlines(frame: FieldFrame, pieces: int = 6) -> list[Array]:
    """The surface of each particle from one pole to the other, from upstream: polylines (k, 2).

    Args:
        frame: The frame.
        pieces: Straight pieces that an edge of a cell is divided into.
    """
    shapes = _line(np.linspace(0, 1, pieces + 1)[:-1])
    found = []
    for path in surface_nodes(frame):
        arc = frame.points[np.stack([path[:-2:2], path[2::2], path[1::2]], axis=1)]
        found.append(np.vstack([np.einsum("sa,mai->msi", shapes, arc).reshape(-1, 2), arc[-1, 1]]))
    return found
