"""The log-conformation at nodes, in numpy: its exponential, what to watch in it, and carrying it to a new mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.tri import Triangulation
from scipy.spatial import cKDTree

from pairsim.materials import polymer
from pairsim.materials.polymer import Polymer
from pairsim.quadratic import Array, QuadraticMesh, shape_gradients, shape_values

# The four linear triangles that a quadratic one is cut into for finding points.
_PARTS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])


def exponential(s: Array) -> Array:
    """c = exp(s) for components (zz, zr, rr, tt), (n, 4) -> (n, 4)."""
    mean, half = (s[:, 0] + s[:, 2]) / 2, (s[:, 0] - s[:, 2]) / 2
    x = np.hypot(half, s[:, 1])
    sinhc = np.where(x > 1e-8, np.sinh(x) / np.where(x > 1e-8, x, 1.0), 1.0)
    scale, cosh = np.exp(mean), np.cosh(x)
    return np.column_stack(
        [scale * (cosh + sinhc * half), scale * sinhc * s[:, 1], scale * (cosh - sinhc * half), np.exp(s[:, 3])]
    )


def logarithm(c: Array) -> Array:
    """s = log c for components (zz, zr, rr, tt), (n, 4) -> (n, 4)."""
    mean, half = (c[:, 0] + c[:, 2]) / 2, (c[:, 0] - c[:, 2]) / 2
    x = np.hypot(half, c[:, 1])
    high, low = np.log(mean + x), np.log(mean - x)
    slope = np.where(x > 1e-12, (high - low) / np.where(x > 1e-12, 2 * x, 1.0), 1 / mean)
    middle = (high + low) / 2
    return np.column_stack([middle + slope * half, slope * c[:, 1], middle - slope * half, np.log(c[:, 3])])


def polymer_stress(liquid: Polymer, c: Array) -> Array:
    """tau = (1 - xi)/De (F c - I) at nodes, (n, 4) -> (n, 4)."""
    F = polymer.spring(liquid.name, c[:, 0] + c[:, 2] + c[:, 3], liquid.L2)
    return np.asarray((1 - liquid.xi) / liquid.De * ((F * c.T).T - [1.0, 0.0, 1.0, 1.0]))


@dataclass(frozen=True)
class Health:
    """What to watch in a conformation field.

    Attributes:
        c_max, z, r: Largest trace of c, and where it is.
        c_min: Smallest eigenvalue of c.
        s_jump: Largest change of s across one cell: of order one means a mesh too coarse for it.
    """

    c_max: float
    z: float
    r: float
    c_min: float
    s_jump: float


def health(s: Array, positions: Array, mesh: QuadraticMesh) -> Health:
    """Look at s at all nodes, (n, 4), that are at `positions`."""
    c = exponential(s)
    trace = c[:, 0] + c[:, 2] + c[:, 3]
    top = int(np.argmax(trace))
    x = np.hypot((s[:, 0] - s[:, 2]) / 2, s[:, 1])
    smallest = np.minimum((s[:, 0] + s[:, 2]) / 2 - x, s[:, 3])
    by_cell = s[mesh.cells]
    return Health(
        float(trace[top]),
        float(positions[top, 0]),
        float(positions[top, 1]),
        float(np.exp(smallest.min())),
        float(np.ptp(by_cell, axis=1).max()),
    )


def interpolate(mesh: QuadraticMesh, positions: Array, values: Array, wanted: Array) -> Array:
    """Quadratic nodal values at other points.

    Args:
        mesh: Cells.
        positions: Where their nodes are, (n, 2).
        values: Values at the nodes, (n, k).
        wanted: Points, (m, 2); one just outside a curved boundary is taken from the nearest cell.

    Returns:
        Values at the points, (m, k).
    """
    parts = mesh.cells[:, _PARTS].reshape(-1, 3)
    finder = Triangulation(positions[:, 0], positions[:, 1], parts).get_trifinder()
    found = np.asarray(finder(wanted[:, 0], wanted[:, 1]), dtype=np.int64)
    cell = found // len(_PARTS)
    lost = np.flatnonzero(found < 0)
    if lost.size:
        nearest = cKDTree(positions[mesh.cells].mean(axis=1)).query(wanted[lost])[1]
        cell[lost] = nearest
    nodes = mesh.cells[cell]
    local = np.full((len(wanted), 2), 1 / 3)
    for _ in range(8):
        miss = wanted - np.einsum("ma,mai->mi", shape_values(local), positions[nodes])
        dx = np.einsum("mak,mai->mik", shape_gradients(local), positions[nodes])
        local = np.clip(local + np.linalg.solve(dx, miss[..., None])[..., 0], -0.2, 1.2)
    return np.asarray(np.einsum("ma,mak->mk", shape_values(local), values[nodes]))
