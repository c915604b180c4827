"""How many particles of a stream each drop gets, into which its liquid is cut."""

from __future__ import annotations

import math

import numpy as np

from pairsim.runtime.arrays import Array

MOST = 3  # particles from which on drops count as one kind
PHASES = 16  # first drops, one after the other within the length of a drop, over which shares are means; chosen
KINDS = MOST + 1


def shares(places: Array, drop: float) -> Array:
    """Shares of drops with 0, 1, 2, and with 3 or more particles, shape (KINDS,); nan where no drop is within the row.

    Args:
        places: Positions of the particles along the tube, ascending, shape (N,).
        drop: Length of the row from which a drop takes its particles.
    """
    found = np.zeros(KINDS)
    for phase in np.arange(PHASES) / PHASES:
        inside = (places - places[0]) / drop - phase
        whole = math.floor(inside[-1])
        if whole > 0:
            first = inside[(inside >= 0) & (inside < whole)].astype(int)
            counts = np.minimum(np.bincount(first, minlength=whole), MOST)
            found += np.bincount(counts, minlength=KINDS)
    total = found.sum()
    return found / total if total else np.full(KINDS, np.nan)


def poisson(mean: float) -> Array:
    """Shares of drops with each number of particles where these arrive independently, from their mean number a drop."""
    each = np.array([math.exp(-mean) * mean**k / math.factorial(k) for k in range(MOST)])
    return np.append(each, 1 - each.sum())
