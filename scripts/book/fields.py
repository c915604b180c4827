"""Outlines, triangles and values of the fields that `pairsim.open(...).fields(...)` returns as grids."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from pairsim.runtime.arrays import Array

TRIANGLE = 22  # VTK's number of quadratic triangles
SIDES = ((0, 1, 3), (1, 2, 4), (2, 0, 5))  # corners and middle node
QUARTERS = ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))
PIECES = 12  # of a side


def regions(grid: Any) -> Iterator[Array]:
    """Six-node cells of the liquid, then of each particle from upstream, (m, 6)."""
    cells, region = grid.cells_dict[TRIANGLE], grid.cell_data["region"]
    for number in range(int(region.max()) + 1):
        yield cells[region == number]


def near(grid: Any, distance: float) -> Array:
    """Nodes of the liquid less than a distance along the tube from the middle of the particles' nodes."""
    liquid, *particles = regions(grid)
    z, nodes = grid.points[:, 0], np.unique(liquid)
    middle = z[np.vstack(particles)].mean()
    return nodes[np.abs(z[nodes] - middle) < distance]


def outlines(grid: Any) -> list[Array]:
    """The surface of each soft particle from its rear pole to its front, from upstream: (z, r), (k, 2)."""
    s = np.linspace(0, 1, PIECES + 1)[:-1]
    shapes = np.stack([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)], axis=1)
    found = []
    for cells in list(regions(grid))[1:]:
        sides = np.vstack([cells[:, side] for side in SIDES])
        _, where, count = np.unique(np.sort(sides[:, :2], axis=1), axis=0, return_index=True, return_counts=True)
        sides = sides[where[count == 1]]
        points = grid.points[:, :2]
        sides = sides[points[sides[:, 2], 1] > 1e-8]  # not those on the axis
        centre = (points[sides, 0].min() + points[sides, 0].max()) / 2
        # A particle is seen whole from its centre, so that the angle orders the surface.
        angle = np.arctan2(-points[:, 1], points[:, 0] - centre) % (2 * np.pi)  # pi at the rear, 2 pi at the front
        angle[(points[:, 1] < 1e-8) & (points[:, 0] > centre)] = 2 * np.pi
        turned = np.where((angle[sides[:, 0]] > angle[sides[:, 1]])[:, None], sides[:, [1, 0, 2]], sides)
        turned = turned[np.argsort(angle[turned[:, 2]])]
        line = np.einsum("sa,mai->msi", shapes, points[turned]).reshape(-1, 2)
        found.append(np.vstack([line, points[turned[-1, 1]]]))
    return found


def deviations(grid: Any) -> list[float]:
    """Root mean square of the distance between each particle's outline and the sphere of its volume, over its radius.

    Spheres are centred where the particle has its centre of volume; from upstream.
    """
    found = []
    for line in outlines(grid):
        z, r = line.T
        slices = np.pi * ((r[1:] + r[:-1]) / 2) ** 2 * np.diff(z)
        centre = np.sum(slices * (z[1:] + z[:-1]) / 2) / np.sum(slices)
        radius = (0.75 * np.sum(slices) / np.pi) ** (1 / 3)
        squares, lengths = (np.hypot(z - centre, r) - radius) ** 2, np.hypot(np.diff(z), np.diff(r))
        found.append(float(np.sqrt(np.average((squares[1:] + squares[:-1]) / 2, weights=lengths)) / radius))
    return found


def in_particles(grid: Any, radius: float) -> tuple[Array, Array]:
    """Undeformed positions about each particle's centre, over its radius, (n, 2), and the nodes there; 10 apart."""
    places, found = [], []
    for number, cells in enumerate(list(regions(grid))[1:], 1):
        nodes = np.unique(cells)
        at = (grid.points[nodes] - grid.point_data["displacement"][nodes])[:, :2]
        middle = (at[:, 0].max() + at[:, 0].min()) / 2
        places.append((at - [middle, 0]) / radius + [10.0 * number, 0])
        found.append(nodes)
    return np.vstack(places), np.concatenate(found)


def quarters(cells: Array) -> Array:
    """Six-node cells as straight triangles, (4 m, 3)."""
    return np.vstack([cells[:, part] for part in QUARTERS])
