"""Rows of cells along the tube, beyond a distance from the particles.

What the particles do to the flow fades there, but the stress of the tube's own flow does not: cells that lie at random
have errors of it that differ from cell to cell and act like forces. Rows have the same error all along the tube, which
acts on nothing, so that they may be long.
"""

from __future__ import annotations

import numpy as np

from pairsim.fem.six_node_mesh import SixNodeMesh
from pairsim.physics.scales import TUBE_RADIUS
from pairsim.runtime.arrays import Array

# Corners and mid-sides of both halves of a square whose nodes are counted (along, across) from 0 to 2.
_RISING = (((0, 0), (2, 0), (2, 2), (1, 0), (2, 1), (1, 1)), ((0, 0), (2, 2), (0, 2), (1, 1), (1, 2), (0, 1)))
_FALLING = (((0, 0), (2, 0), (0, 2), (1, 0), (1, 1), (0, 1)), ((2, 0), (2, 2), (0, 2), (2, 1), (1, 2), (1, 1)))


def stations(begin: float, end: float, first: float, growth: float) -> Array:
    """Where columns of cells meet, from `begin` to `end`.

    Args:
        begin, end: Ends of the stretch.
        first: Length of a cell at `begin`, below the tube's radius.
        growth: Growth of the length by unit distance, up to the tube's radius.

    Returns:
        At least two positions; the lengths are those wanted, then scaled alike to fill the stretch.
    """
    places = [0.0]
    while places[-1] < end - begin:
        places.append(places[-1] + min(first + growth * places[-1], TUBE_RADIUS))
    if len(places) > 2 and places[-1] - (end - begin) > (places[-1] - places[-2]) / 2:
        places.pop()
    z = begin + np.array(places) * (end - begin) / places[-1]
    z[-1] = end  # to the last digit
    return np.asarray(z)


def extruded(mesh: SixNodeMesh, z: Array) -> SixNodeMesh:
    """Continue a mesh beyond its straight downstream end.

    Args:
        mesh: The mesh; its end is at z[0].
        z: Ends of the columns of cells, ascending.

    Returns:
        The mesh and, behind its nodes and cells, those of the rows, as wide as the sides of its end.
    """
    end = np.flatnonzero(mesh.points[:, 0] > z[0] - 1e-9)
    end = end[np.argsort(mesh.points[end, 1])]
    columns, rows = len(z) - 1, len(end) // 2
    along = np.empty(2 * columns)
    along[::2], along[1::2] = (z[:-1] + z[1:]) / 2, z[1:]
    r = np.broadcast_to(mesh.points[end, 1], (len(along), len(end)))
    points = np.column_stack([np.repeat(along, len(end)), r.ravel()])
    node = np.vstack([end, len(mesh.points) + np.arange(len(points)).reshape(r.shape)])
    # Sides cross over from cell to cell; one of them ends in the corner at the wall, which two cells share then:
    # a cell with two sides on walls would have a pressure of its own.
    k, j = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    is_rising = (columns + rows - k - j) % 2 == 0
    cells = [
        np.stack([node[2 * k[chosen] + dz, 2 * j[chosen] + dr] for dz, dr in corners], axis=1)
        for chosen, halves in ((is_rising, _RISING), (~is_rising, _FALLING))
        for corners in halves
    ]
    return SixNodeMesh(np.vstack([mesh.points, points]), np.vstack([mesh.cells, *cells]))
