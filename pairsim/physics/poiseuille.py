"""Developed flow of a Newtonian liquid in the tube."""

from __future__ import annotations

import numpy as np

from pairsim.quantities.scales import TUBE_RADIUS
from pairsim.runtime.arrays import Array


def poiseuille(points: Array) -> Array:
    """Fully developed Newtonian flow of unit mean velocity at points (z, r), shape (n, 2); returns shape (n, 2)."""
    return np.column_stack([2 * (1 - (points[:, 1] / TUBE_RADIUS) ** 2), np.zeros(len(points))])
