"""The numbers of particles in the drops into which the liquid of a stream is cut."""

from __future__ import annotations

import math

import numpy as np

from pairsim.runtime.arrays import Array

MOST = 3  # drops with this number of particles, or more, count as one kind
PHASES = 16  # places of the first cut within the length of a drop, over which shares are averaged; chosen
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
    """The same shares where particles arrive independently, by their mean number per drop, shape (KINDS,)."""
    each = np.array([math.exp(-mean) * mean**k / math.factorial(k) for k in range(MOST)])
    return np.append(each, 1 - each.sum())
