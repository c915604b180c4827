"""Surfaces of particles in the meridional section, read off the mesh of the liquid."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import depth_first_order

from pairsim.results.xdmf import FieldFrame
from pairsim.runtime.arrays import Array, Indices

EDGES = [(0, 1, 3), (1, 2, 4), (2, 0, 5)]
"""Corners and mid-node of the edges of a cell (VTK's order)."""
ON_AXIS = 1e-8


def surface_nodes(frame: FieldFrame) -> list[Indices]:
    """The nodes of the liquid's cells on each particle, corners and mid-nodes in turn, (2k + 1,), from upstream.

    They are read off the liquid, so that rigid particles, which have no cells, have them too.
    """
    cells, (z, r) = frame.cells[frame.region == 0], frame.points.T
    edges = np.vstack([cells[:, edge] for edge in EDGES])
    _, first, count = np.unique(np.sort(edges[:, :2], axis=1), axis=0, return_index=True, return_counts=True)
    edges = edges[first[count == 1]]
    edges = edges[(r[edges] > ON_AXIS).any(axis=1)]
    a, b, middle = edges.T
    # Halves of edges: the surface of a particle is a path of them from pole to pole, as wall and ends are one.
    halves, n = (np.concatenate([a, middle]), np.concatenate([middle, b])), len(r)
    graph = coo_array((np.ones(2 * len(edges)), halves), shape=(n, n)).tocsr()
    poles = np.flatnonzero(np.bincount(np.concatenate(halves), minlength=n) == 1)
    paths = [depth_first_order(graph, pole, directed=False, return_predecessors=False) for pole in poles]
    inner = [path for path in paths if r[path].max() < (1 - 1e-6) * r.max() and z[path[0]] <= z[path[-1]]]
    return sorted((path.astype(np.int64) for path in inner), key=lambda path: float(z[path].mean()))


def outlines(frame: FieldFrame, pieces: int = 6) -> list[Array]:
    """The surface of each particle from one pole to the other, from upstream: polylines (k, 2).

    Args:
        frame: The frame.
        pieces: Straight pieces that an edge of a cell is divided into.
    """
    s = np.linspace(0, 1, pieces + 1)[:-1]
    shapes = np.stack([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)], axis=-1)  # of both ends, middle
    found = []
    for path in surface_nodes(frame):
        arc = frame.points[np.stack([path[:-2:2], path[2::2], path[1::2]], axis=1)]
        found.append(np.vstack([np.einsum("sa,mai->msi", shapes, arc).reshape(-1, 2), arc[-1, 1]]))
    return found
