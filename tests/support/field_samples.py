"""Small frames with deformed particles, made by hand: what tests of the field file and of the pictures draw on."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pairsim.record.xdmf import FieldFrame

LOCAL = np.array([(0, 0), (2, 0), (2, 2), (1, 0), (2, 1), (1, 1)])
"""Nodes of a six-node triangle in VTK's order, on the 3 x 3 nodes of a square."""


def patch(nodes: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Six-node triangles on a lattice of nodes, shape (2a + 1, 2b + 1, 2)."""
    numbers = np.arange(nodes.shape[0] * nodes.shape[1]).reshape(nodes.shape[:2])
    cells = []
    for i in range(0, nodes.shape[0] - 1, 2):
        for j in range(0, nodes.shape[1] - 1, 2):
            square = numbers[i : i + 3, j : j + 3]
            cells.append([square[a, b] for a, b in LOCAL])
            cells.append([square[b, a] for a, b in LOCAL[[0, 2, 1, 5, 4, 3]]])
    return nodes.reshape(-1, 2), np.array(cells)


def scene(
    t: float, shapes: list[tuple[float, float, float]], *, rigid: bool = False, rays: int = 8, half_length: float = 2.0
) -> FieldFrame:
    """A tube with ellipsoids (z of the centre, half axis in z, half axis in r), given from upstream.

    Each particle is a half-disc of polar cells, and so is the liquid around it, out to the wall and half-way to the
    next one. Nodes on interfaces are doubled.
    """
    angle = np.linspace(0, np.pi, 4 * rays + 1)
    ray = np.stack([-np.cos(angle), np.sin(angle)], axis=-1)
    ray[[0, -1], 1] = 0.0
    centres = [z for z, _, _ in shapes]
    cuts = [-half_length, *((a + b) / 2 for a, b in pairwise(centres)), half_length]
    patches: list[tuple[NDArray[np.float64], NDArray[np.int64], int]] = []
    for i, (z, a, b) in enumerate(shapes, 1):
        centre, outline = np.array([z, 0.0]), np.array([z, 0.0]) + ray * [a, b]
        room = np.where(ray[:, 0] < 0, z - cuts[i - 1], cuts[i] - z)
        with np.errstate(divide="ignore"):
            reach = np.minimum(room / np.abs(ray[:, 0]), 0.5 / np.abs(ray[:, 1]))
        box = centre + ray * reach[:, None]
        s = np.linspace(0, 1, 9)[:, None, None]
        patches.append((*patch(outline * (1 - s) + box * s), 0))
        if not rigid:
            s = np.linspace(0, 1, 5)[:, None, None]
            patches.append((*patch(centre * (1 - s) + outline * s), i))
    if not shapes:
        lattice = np.meshgrid(
            np.linspace(-half_length, half_length, 4 * rays + 1), np.linspace(0, 0.5, 9), indexing="ij"
        )
        patches.append((*patch(np.stack(lattice, axis=-1)), 0))
    starts = np.cumsum([0, *(len(points) for points, _, _ in patches)])
    points = np.vstack([p for p, _, _ in patches])
    cells = np.vstack([c + start for (_, c, _), start in zip(patches, starts[:-1], strict=True)])
    region = np.concatenate([np.full(len(c), i) for _, c, i in patches])
    owner = np.concatenate([np.full(len(p), i) for p, _, i in patches])
    # Neighbouring patches of liquid share the nodes half-way between the particles.
    keys = [tuple(key) for key in np.column_stack([owner, points.round(7) + 0.0]).tolist()]
    first = {key: i for i, key in reversed(list(enumerate(keys)))}
    kept = np.array(sorted(first.values()))
    number = np.searchsorted(kept, [first[key] for key in keys])
    points, owner, cells = points[kept], owner[kept], number[cells]
    z, r = points.T
    data = {"velocity": np.column_stack([(2 - 8 * r**2) * (1 - 0.2 * np.exp(-4 * z**2)), 0 * r]), "pressure": -32 * z}
    if shapes and not rigid:
        soft = (owner > 0).astype(float)
        data["displacement"] = np.column_stack([0.01 * z, -0.01 * r])
        data["tau_s"] = soft[:, None] * np.column_stack([np.sin(9 * z), z * r, -r, r - 0.1])
    return FieldFrame(t, points, cells, region, data)


PAIR = [(-0.3, 0.22, 0.19), (0.3, 0.21, 0.2)]
"""Two ellipsoids for `scene`."""
