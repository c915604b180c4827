"""Drawing the meridional section: curved cells as fine triangles, surfaces of particles as fine polylines."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pairsim.results.xdmf import FieldFrame
from pairsim.runtime.arrays import Array

EDGES = {6: [(0, 1, 3), (1, 2, 4), (2, 0, 5)], 9: [(0, 1, 4), (1, 2, 5), (2, 3, 6), (3, 0, 7)]}
"""Corners and mid-node of the edges of a cell, by its number of nodes (VTK's order)."""
ON_AXIS = 1e-8


@dataclass(frozen=True)
class Surface:
    """Straight triangles in the (z, r) plane with a value at each node: (n, 2), (m, 3), (n,)."""

    points: Array
    triangles: NDArray[np.int64]
    values: Array

    def mirrored(self) -> Surface:
        """Together with its mirror image at r < 0."""
        other = self.points * [1, -1]
        triangles = np.vstack([self.triangles, self.triangles[:, ::-1] + len(self.points)])
        return Surface(np.vstack([self.points, other]), triangles, np.tile(self.values, 2))


def _line(s: Array) -> Array:
    """Quadratic shape functions of an edge at s in [0, 1]: both ends, middle."""
    return np.stack([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)], axis=-1)


def _lattice(kind: int, level: int) -> tuple[Array, NDArray[np.int64]]:
    """Shape functions on a regular lattice of one cell, (nodes, kind), and the triangles between its nodes."""
    grid = [(i, j) for j in range(level + 1) for i in range(level + 1 - (j if kind == 6 else 0))]
    number = {node: k for k, node in enumerate(grid)}
    triangles = []
    for i, j in grid:
        if (i + 1, j) in number and (i, j + 1) in number:
            triangles.append([number[i, j], number[i + 1, j], number[i, j + 1]])
            if (i + 1, j + 1) in number:
                triangles.append([number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]])
    x, y = np.array(grid, dtype=float).T / level
    if kind == 6:
        a, b, c = 1 - x - y, x, y
        shapes = [a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * c * a]
        return np.stack(shapes, axis=1), np.array(triangles)
    order = [(0, 0), (1, 0), (1, 1), (0, 1), (2, 0), (1, 2), (2, 1), (0, 2), (2, 2)]
    along, across = _line(x), _line(y)
    return np.stack([along[:, i] * across[:, j] for i, j in order], axis=1), np.array(triangles)


def tessellate(frame: FieldFrame, chosen: NDArray[np.bool_], values: Array, level: int = 3) -> Surface:
    """Some cells of a frame, each edge divided into `level` pieces along its curve.

    Args:
        frame: Mesh, (m) cells and (n) nodes.
        chosen: Which cells, (m,).
        values: What to show, at the nodes, (n,).
        level: Pieces of an edge.
    """
    cells = frame.cells[chosen]
    shapes, triangles = _lattice(frame.cells.shape[1], level)
    points = np.einsum("qa,mai->mqi", shapes, frame.points[cells]).reshape(-1, 2)
    starts = np.arange(len(cells))[:, None, None] * len(shapes)
    return Surface(points, (triangles + starts).reshape(-1, 3), (values[cells] @ shapes.T).ravel())


def surface_nodes(frame: FieldFrame) -> list[NDArray[np.int64]]:
    """The edges of the liquid's cells on each particle: (first, last, middle node), (k, 3), from pole to pole.

    They are read off the liquid, so that rigid particles, which have no cells, have them too.
    """
    cells = frame.cells[frame.region == 0]
    edges = np.vstack([cells[:, edge] for edge in EDGES[frame.cells.shape[1]]])
    _, first, count = np.unique(np.sort(edges[:, :2], axis=1), axis=0, return_index=True, return_counts=True)
    edges = edges[first[count == 1]]
    edges = edges[(np.abs(frame.points[edges, 1]) > ON_AXIS).any(axis=1)]
    wall = float(frame.points[edges, 1].max(initial=0.0))
    return [arc for arc in _chains(edges) if frame.points[arc, 1].max() < (1 - 1e-6) * wall]


def outlines(frame: FieldFrame, pieces: int = 6) -> list[Array]:
    """The surface of each particle from one pole to the other, from upstream: polylines (k, 2).

    Args:
        frame: The frame.
        pieces: Straight pieces that an edge of a cell is divided into.
    """
    shapes = _line(np.linspace(0, 1, pieces + 1)[:-1])
    found = []
    for arc in surface_nodes(frame):
        line = np.einsum("sa,mai->msi", shapes, frame.points[arc]).reshape(-1, 2)
        line = np.vstack([line, frame.points[arc[-1, 1]]])
        found.append(line if line[0, 0] <= line[-1, 0] else line[::-1])
    return sorted(found, key=lambda line: float(line[:, 0].mean()))


def _chains(edges: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Open chains of edges (first, last, middle node), each in the order and direction of the walk along it."""
    at: dict[int, list[int]] = defaultdict(list)
    for i, (a, b, _) in enumerate(edges.tolist()):
        at[a].append(i)
        at[b].append(i)
    used: set[int] = set()
    chains = []
    for start in (node for node, meeting in at.items() if len(meeting) == 1):
        node, chain = start, []
        while (step := next((i for i in at[node] if i not in used), None)) is not None:
            used.add(step)
            a, b, middle = (int(k) for k in edges[step])
            chain.append((a, b, middle) if a == node else (b, a, middle))
            node = chain[-1][1]
        if chain:
            chains.append(np.array(chain))
    return chains
