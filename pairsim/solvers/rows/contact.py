"""Particles of a row or stream that touch: equal and opposite forces keep them at the distance of contact."""

from __future__ import annotations

import numpy as np
import scipy

from pairsim.runtime.arrays import Array

TOUCHING = 1e-9  # distance beyond that of contact at which particles touch, which is rounding [D_c]


def without_overlap(U: Array, gaps: Array, contact: float) -> Array:
    """The nearest velocities at which no distance of contact shrinks [U_av], shape (N,).

    They are those with the forces between particles that touch, which push but do not pull, if these move all particles
    equally easily: an isotonic regression of the velocities of each row of particles that touch.

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
