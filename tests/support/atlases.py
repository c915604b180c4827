"""Atlases of invented curves: they vanish at De = Ca_e = 0, change sign over d, and bend in De, as dU does."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from pairsim.atlas import fit
from pairsim.atlas.atlas import Atlas, Curves
from pairsim.atlas.unequal import Beads, UnequalCurves
from pairsim.atlas.unequal_fit import with_unequal
from pairsim.sweeps.atlas_file import AtlasFile
from pairsim.sweeps.unequal_building import pairs_at

BOX = {"beta": [0.3, 0.5], "De": [0.0, 1.0], "Ca_e": [0.0, 0.1], "d": [0.02, 2.0]}
D = np.geomspace(*BOX["d"], 41)
RATIOS = {"diameters": (0.9, 1.1), "moduli": (0.5, 2.0)}
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


def alone(beta: np.ndarray, De: np.ndarray, Ca_e: np.ndarray) -> np.ndarray:
    """The velocity of a bead on its own, whose derivative by beta is that of `exact_by_difference` far apart."""
    return 2 - beta**2 / (1 + De) + 0.3 * Ca_e


def exact_of_unequal(beads: Beads) -> np.ndarray:
    """dU of pairs that differ at the distances D, shape (pairs, distances)."""
    means = [each[:, None] for each in beads.means.T]
    difference, softness = (each[:, None] for each in beads.differences.T)
    beta, De, _ = means
    far = (alone(*beads.alone(1).T) - alone(*beads.alone(0).T))[:, None]
    of_sizes = 0.6 * difference * (1 + difference) * np.exp(-D / 0.3) / (1 + De)
    return exact(*means, D) + far + beta**2 * (of_sizes + softness * (1 + beta) * np.exp(-D / 0.2))


def random_pairs(count: int, seed: int) -> Beads:
    """Pairs in the box and the ratios."""
    file = AtlasFile.model_validate({**BOX, "curves": 1, "start": "a.npz"})
    pairs = pairs_at(np.random.default_rng(seed).random((count, 5)), file, *RATIOS.values())
    return Beads(*(np.array(each, dtype=float) for each in zip(*(pair.values() for pair in pairs), strict=True)))


def unequal_curves_at(beads: Beads) -> UnequalCurves:
    """Curves of pairs that differ, with derivatives."""

    def moved(which: int, step: float) -> np.ndarray:
        (beta, De, Ca_e), (difference, softness) = beads.means.T, beads.differences.T
        x = [beta, De, Ca_e, difference, softness]
        x[which] = x[which] + step
        half, apart = x[3] / 2, x[4] / 2
        betas = np.stack([x[0] * (1 - half), x[0] * (1 + half)], axis=1)
        return exact_of_unequal(Beads(betas, x[1], np.stack([x[2] - apart, x[2] + apart], axis=1)))

    gradients = np.stack([(moved(i, 1e-6) - moved(i, -1e-6)) / 2e-6 for i in range(5)], axis=1)
    dU = exact_of_unequal(beads)
    ends = np.stack([alone(*beads.alone(i).T) for i in (0, 1)], axis=1)
    errors = 1e-3 * np.abs(dU).max(axis=1, keepdims=True) + 0 * dU
    return UnequalCurves(*beads, np.ones(len(dU), dtype=bool), dU, errors, gradients, ends)


@cache
def make_unequal_atlas(count: int = 24) -> Atlas:
    """An atlas of random curves, of equal and of unequal pairs."""
    equal = make_atlas()
    velocities = alone(*equal.curves.places.T)[:, None] + 0 * D
    others = np.stack([velocities, *equal.curves.others.swapaxes(0, 1)[1:]], axis=1)
    equal = replace(equal, curves=replace(equal.curves, others=others))
    places = random_places(12, 8)
    return with_unequal(equal, unequal_curves_at(random_pairs(count, 7)), (places, alone(*places.T)), RATIOS)


def random_places(count: int, seed: int) -> np.ndarray:
    """Places in the box, shape (count, 3)."""
    return np.array([0.3, 0.0, 0.0]) + np.random.default_rng(seed).random((count, 3)) * [0.2, 1.0, 0.1]


@cache
def make_atlas(count: int = 24) -> Atlas:
    """An atlas of random curves."""
    return fit.fit(curves_at(random_places(count, 1)), D, BOX, {"case": CASE})
