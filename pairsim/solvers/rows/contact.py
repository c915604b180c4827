"""Particles of a row or stream that touch: equal and opposite forces keep them at the distance of contact."""

from __future__ import annotations

import numpy as np
import scipy

from pairsim.runtime.arrays import Array

TOUCHING = 1e-9  # distance beyond that of contact up to which particles touch, for rounding errors [D_c]


def without_overlap(U: Array, gaps: Array, contact: float) -> Array:
    """Velocities at which no touching particles move into each other [U_av], shape (N,).

    Particles that touch push each other apart, but do not pull. If all particles have the same mobility, the velocities
    are the closest ones, in the sense of least squares, that do not decrease in the downstream direction within each
    group of touching particles: an isotonic regression.

    Args:
        U: Velocities without these forces [U_av], shape (N,).
        gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).
        contact: Distance at which particles touch [D_c].
    """
    rows = np.append(0, np.cumsum(gaps > contact + TOUCHING))  # number of the group of touching particles
    if rows[-1] == len(gaps):
        return U
    offset = (np.ptp(U) + 1.0) * rows  # so that velocities of different groups are never out of order
    return np.asarray(scipy.optimize.isotonic_regression(U + offset).x - offset)
