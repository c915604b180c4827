"""Compression of the surfaces of soft particles, and waves on them.

Waves on the surface of an incompressible neo-Hookean or Mooney-Rivlin solid are neutral, whatever their length and
the pressure on the surface, where the ratio of the stretch along the wave to that normal to the surface is x = 0.2956,
the root of x^3 + x^2 + 3 x = 1 (Biot, Appl. Sci. Res. A 12, 168, 1963). A surface that is compressed more has no smooth
steady shape: it wrinkles, in waves as short as the cells allow. With the stretches l_m along the meridian and l_h
around the axis, the ratio for waves along the meridian is l_m^2 l_h.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pairsim.fem.body import Body
from pairsim.runtime.arrays import Array

UNSTABLE = 0.2956
"""Compression l_m^2 l_h of a surface at which it wrinkles."""


def compression(body: Body, h: Array) -> Array:
    """l_m^2 l_h between neighbouring nodes of the outline of a soft particle, 1 in a sphere at rest, shape (2 k,)."""
    before, after = body.outline.nodes, body.outline_points(h)
    along = np.hypot(*np.diff(after, axis=0).T) / np.hypot(*np.diff(before, axis=0).T)
    around = (after[1:, 1] + after[:-1, 1]) / (before[1:, 1] + before[:-1, 1])
    return np.asarray(along**2 * around)


def least_compression(bodies: Sequence[Body], h: Array) -> float:
    """The smallest l_m^2 l_h of all soft particles; 1 without any."""
    return min((float(compression(body, h).min()) for body in bodies if body.phase is not None), default=1.0)


def roughness(body: Body, h: Array) -> float:
    """Largest ratio, or its inverse, of `compression` to the geometric mean of its two neighbours; 1 at rest.

    It is up to 1.6 for smooth shapes on the verge of wrinkling, and at least 2.4 for shapes with waves as long as cells
    (seven shapes at beta .5 to .65, with 28 to 56 cells on a half-circle).
    """
    log = np.log(compression(body, h))
    return float(np.exp(np.abs(log[1:-1] - (log[2:] + log[:-2]) / 2).max()))
