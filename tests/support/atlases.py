"""Atlases of invented curves: they vanish at De = Ca_e = 0, change sign over d, and bend in De, as dU does."""

from __future__ import annotations

from functools import cache

import numpy as np

from pairsim.atlas import fit
from pairsim.atlas.atlas import Atlas, Curves

BOX = {"beta": [0.3, 0.5], "De": [0.0, 1.0], "Ca_e": [0.0, 0.1], "d": [0.02, 2.0]}
D = np.geomspace(*BOX["d"], 41)
CASE = {"particles": 2, "ends": "developed", "length": "auto", "xi": 0.09, "liquid": {"law": "giesekus", "alpha": 0.2}}


def exact(beta: np.ndarray, De: np.ndarray, Ca_e: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Their dU."""
    return beta**4 * (Ca_e * np.exp(-3 * d) * (1 + beta) + De / (1 + De) * (d - 0.2) * np.exp(-d / 0.3) * (1 - Ca_e))


def exact_by_difference(beta: np.ndarray, De: np.ndarray, d: np.ndarray) -> np.ndarray:
    """The derivative of their dU by the difference of the diameters over their mean."""
    return -2 * beta**2 * (1 - 0.3 * np.exp(-d / 0.3)) / (1 + De)


def values_at(places: np.ndarray) -> np.ndarray:
    """`exact` at the distances D of many curves, shape (places, distances)."""
    return exact(*places.T[:, :, None], D)


def curves_at(places: np.ndarray) -> Curves:
    """Curves at beta, De and Ca_e, shape (curves, 3)."""
    steps = 1e-6 * np.eye(3)
    gradients = np.stack([(values_at(places + s) - values_at(places - s)) / 2e-6 for s in steps], axis=1)
    values, random = values_at(places), np.ones(len(places), dtype=bool)
    others = np.stack([2 - places[:, :1] + 0 * D, 1 + places[:, 2:] * np.exp(-D), places[:, 1:2] + 0 * D], axis=1)
    errors = 1e-3 * np.abs(values).max(axis=1, keepdims=True) + 0 * values
    differences = exact_by_difference(places[:, :1], places[:, 1:2], D)
    return Curves(places, random, values, errors, gradients, others, differences)


def random_places(count: int, seed: int) -> np.ndarray:
    """Places in the box, shape (count, 3)."""
    return np.array([0.3, 0.0, 0.0]) + np.random.default_rng(seed).random((count, 3)) * [0.2, 1.0, 0.1]


@cache
def make_atlas(count: int = 24) -> Atlas:
    """An atlas of random curves."""
    return fit.fit(curves_at(random_places(count, 1)), D, BOX, {"case": CASE})
