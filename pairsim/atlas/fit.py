"""Make an atlas of master curves, with half-widths from curves left out, and say where further curves tell most."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.optimize

from pairsim.atlas.atlas import POWER, Atlas, scaled
from pairsim.atlas.kriging import Kriging
from pairsim.runtime.arrays import Array

COVERED = 0.95  # part of all places that intervals hold
NEIGHBOURS = 2  # distances on either side whose errors count for the half-width at one
FIRST = (1.0, 1.0, 1.0, 3e-3, 0.4, 2e-2, 2e-2)
"""First guess: lengths, errors of values (of a curve's peak), and of derivatives by beta, De and Ca_e.

Those by beta are the least accurate: they lack the estimate of the error of dU, which changes with the mesh.
"""
FURTHEST = 4.0  # from the first guess, in logarithms; chosen
UNSURE = 0.1  # half-width of a curve over its peak, from which on somewhere its derivatives are not used; chosen
SMOOTH = np.array([1.5, 1.0, 1.5])  # lengths of what a curve has beside dU; chosen
ROUNDING = 1e-4  # error of it, relative; chosen


@dataclass(frozen=True)
class Curves:
    """Master curves at the same distances.

    Attributes:
        places: beta, De and Ca_e, shape (curves, 3).
        dU: dU on the slow manifold [U_av], shape (curves, distances).
        errors: Half-widths of its intervals, of the same shape.
        gradients: Its derivatives by beta, De and Ca_e, nan where not known, shape (3, curves, distances).
        others: Those of `OTHERS`, shape (3, curves, distances).
    """

    places: Array
    dU: Array
    errors: Array
    gradients: Array
    others: Array


def interpolant(curves: Curves, box: Mapping[str, tuple[float, float]], settings: Array) -> Kriging:
    """dU over beta ** POWER, with lengths and errors of values and derivatives as `FIRST`."""
    beta = curves.places[:, :1]
    values, gradients = curves.dU / beta**POWER, curves.gradients / beta**POWER
    gradients[0] -= POWER / beta * values
    x, slopes = scaled(box, curves.places)
    gradients = gradients / slopes.T[:, :, None]
    peaks = np.abs(curves.dU).max(axis=1, keepdims=True)
    gradients[:, (curves.errors > UNSURE * peaks).any(axis=1)] = np.nan
    sizes = np.abs(values).max(axis=1)
    relative = sizes / np.median(sizes / np.hypot(x[:, 1], x[:, 2]))
    lengths, of_values, of_gradients = np.split(settings, (3, 4))
    errors = np.stack([of_values * relative, *(np.full_like(sizes, each) for each in of_gradients)])
    return Kriging.of(x, np.concatenate([values[None], gradients]), errors, lengths, True)


def fit(
    curves: Curves, d: Array, box: Mapping[str, tuple[float, float]], provenance: Mapping[str, Any]
) -> tuple[Atlas, Array]:
    """Make an atlas.

    Lengths and errors are those with which curves left out are most probable by the others (Rasmussen and Williams
    2006, section 5.4.2; errors are taken to have a Laplace distribution, of a width that depends on the distance).
    Half-widths hold `COVERED` of errors of curves left out, over the deviations of the kriging; the quantile is that
    for one more curve than these.

    Args:
        curves: At least four.
        d: Their distances, shape (distances,).
        box: Least and largest beta, De, Ca_e and d.
        provenance: What is known of them.

    Returns:
        The atlas, and by how much the others are wrong about each curve, over its peak, shape (curves, distances).
    """

    def made(logs: Array) -> Kriging:
        return interpolant(curves, box, np.exp(logs))

    def badness(logs: Array) -> float:
        if np.abs(logs - np.log(FIRST)).max() > FURTHEST:
            return float("inf")
        with np.errstate(all="ignore"):
            residuals, spreads = made(logs).left_out()
            widths = np.mean(np.abs(residuals) / spreads[:, None], axis=0)
            return float(np.mean(np.log(widths)) + np.mean(np.log(spreads)))

    start = np.log(FIRST) + np.concatenate([np.zeros((1, len(FIRST))), np.eye(len(FIRST))])
    best = scipy.optimize.minimize(badness, start[0], method="Nelder-Mead", options={"initial_simplex": start})
    dU = made(best.x)
    residuals, spreads = dU.left_out()
    ratios, count = np.abs(residuals) / spreads[:, None], len(d)
    rank = min(COVERED * (len(ratios) + 1) / len(ratios), 1.0)
    near = [slice(max(k - NEIGHBOURS, 0), k + NEIGHBOURS + 1) for k in range(count)]
    scales = np.array([ratios[:, each].mean() for each in near])
    widths = scales * np.quantile(ratios / scales, rank)
    peaks = np.abs(curves.dU).max(axis=1, keepdims=True)
    own = np.maximum(curves.errors / peaks, 1e-9)
    values = np.concatenate(list(curves.others), axis=1)
    means, sizes = values.mean(axis=0), values.std(axis=0).max() or 1.0
    data = np.full((4, *values.shape), np.nan)
    data[0] = values - means
    others = Kriging.of(dU.places, data, np.full(data.shape[:2], ROUNDING * sizes), SMOOTH, False)
    atlas = Atlas(box, d, dU, others, means, widths, own, provenance)
    return atlas, residuals * curves.places[:, :1] ** POWER / peaks


def farthest(known: Array, errors: Array, candidates: Array, count: int) -> list[int]:
    """Candidates that are far from what is known, in coordinates of `scaled`, and near curves with large errors.

    Args:
        known: Places of the curves, shape (curves, 3); none before the first ones.
        errors: How large the error is near each, shape (curves,).
        candidates: Shape (candidates, 3).
        count: How many are wanted.

    Returns:
        Their indices, each chosen as if the ones before were known.
    """
    apart = np.linalg.norm(candidates[:, None] - known, axis=2)
    size = errors[apart.argmin(axis=1)] if len(known) else np.ones(len(candidates))
    near = apart.min(axis=1) if len(known) else 1 / (1 + np.linalg.norm(candidates - 0.5, axis=1))
    found: list[int] = []
    for _ in range(count):
        found.append(int((size * near).argmax()))
        to_last = np.linalg.norm(candidates - candidates[found[-1]], axis=1)
        near = np.minimum(near, to_last) if len(known) or len(found) > 1 else to_last
    return found
