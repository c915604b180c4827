"""Velocity of the mesh in quasi-steady scenes, as a weighted mean of the particles' velocities."""

from __future__ import annotations

import numpy as np

from pairsim.fem.meshes.geometry import Reference
from pairsim.runtime.arrays import Array

# Central fraction of a gap in which the velocity of the mesh changes from that of one particle to that of the next.
TRANSITION = 0.5


def shares(reference: Reference, z: Array, periodic: bool) -> Array:
    """Weights of the particles in the axial velocity w of the mesh, w(z) = sum_i shares_i(z) U_i; they sum to 1.

    The mesh moves with each particle up to a quarter of the way across the gap; in the central half of the gap w
    changes to the velocity of the next particle, with a continuous derivative. The liquid's memory of a particle is
    thus carried along with that particle, so that the motion of the particles changes dU little; and w depends on
    positions alone, not on cells, so that solutions converge under mesh refinement. In a periodic tube the last
    particle is followed by the first one of the next period; otherwise the mesh moves with the first and the last
    particle up to the ends.

    Args:
        reference: Reference domain.
        z: Axial positions in it [D_c], shape (n,).
        periodic: Whether the ends of the tube are periodic.

    Returns:
        Shares, shape (N, n).
    """
    count, length = len(reference.positions), reference.geometry.length
    result = np.zeros((count, len(z)))
    behind = np.ones(len(z))  # share of this particle and all downstream of it
    for i in range(count - 1):
        ahead = _transition(z, reference.positions[i][0, 0], reference.positions[i + 1][-1, 0])
        result[i] = behind - ahead
        behind = ahead
    if count:
        result[-1] += behind
    if count > 1 and periodic:
        first, last = reference.positions[0][-1, 0], reference.positions[-1][0, 0]
        over = _transition(z, last, first + length) - (1 - _transition(z, last - length, first))
        result[-1] -= over
        result[0] += over
    return result


def _transition(z: Array, start: float, end: float) -> Array:
    """Smooth step from 0 to 1 over the central fraction `TRANSITION` of an interval, with the shape of z."""
    t = np.clip(((z - start) / (end - start) - 0.5) / TRANSITION + 0.5, 0.0, 1.0)
    step: Array = t * t * (3 - 2 * t)
    return step
