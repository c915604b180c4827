"""Particles of a row or stream that touch: equal and opposite forces keep them at the distance of contact."""

from __future__ import annotations

import numpy as np
import scipy

from pairsim.runtime.arrays import Array

TOUCHING = 1e-9  # distance beyond that of contact at which particles touch, which is rounding [D_c]


def without_overlap(U: Array, gaps: Array, contact: float) -> Array:
    """Velocities at which no particles that touch move into each other, shape (N,) [U_av].

    Particles that touch push each other apart, but do not pull. If these forces move all particles equally easily, the
    velocities are the nearest ones that do not decrease along each row of particles that touch: an isotonic regression.

    Args:
        U: Velocities without these forces [U_av], shape (N,).
        gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).
        contact: Distance at which particles touch [D_c].
    """
    rows = np.append(0, np.cumsum(gaps > contact + TOUCHING))  # of particles that touch each other
    if rows[-1] == len(gaps):
        return U
    offset = (np.ptp(U) + 1.0) * rows  # so that those of different rows are never out of order
    return np.asarray(scipy.optimize.isotonic_regression(U + offset).x - offset)
