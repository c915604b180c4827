"""Make an atlas of master curves, with half-widths from curves left out, and say where further curves help most."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import scipy.optimize

from pairsim.atlas.atlas import PARAMETERS, POWER, Atlas, Curves, Provenance
from pairsim.runtime.arrays import Array

COVERED = 0.95  # fraction of all errors that intervals hold
ENOUGH = 20  # curves at random places with which half-widths follow from these alone; the quantile needs 19
NEIGHBOURS = 2  # distances on either side of a distance whose errors count for the half-width there
FIRST = (1.0, 1.0, 1.0, 3e-3, 0.4, 2e-2, 2e-2)
"""First guess of the settings.

Derivatives by beta are the least accurate: they lack the estimate of the error of dU, which changes with the mesh.
"""
CLOSE = 1e-4  # tolerance of the logarithms of settings, and of what is minimised; that of scipy
FURTHEST = 4.0  # largest difference of settings from the first guess, in logarithms; chosen


def fit(curves: Curves, d: Array, box: Mapping[str, Sequence[float]], provenance: Provenance) -> Atlas:
    """Make an atlas.

    Correlation lengths and errors are those that make each curve, left out, most probable by the others (Rasmussen and
    Williams 2006, section 5.4.2; errors are taken to have a Laplace distribution whose width depends on the distance).

    Args:
        curves: At least four.
        d: Their distances, shape (distances,).
        box: Least and largest beta, De, Ca_e and d.
        provenance: Their origin.
    """
    settings = most_probable(FIRST, lambda those: curves.kriging(box, those).left_out(), tolerance=CLOSE)
    return Atlas(box, provenance, d, settings, widths_of(curves, box, settings), curves)


def most_probable(
    first: Sequence[float], left_out: Callable[[Array], tuple[Array, Array]], *, tolerance: float
) -> Array:
    """The settings that make data, left out one place at a time, most probable.

    Args:
        first: The first guess, shape (settings,).
        left_out: Returns residuals, shape (places, functions), and standard deviations, (places,), for some settings.
        tolerance: Of the logarithms of the settings, and of what is minimised.
    """

    def badness(logs: Array) -> float:
        if np.abs(logs - np.log(first)).max() > FURTHEST:
            return float("inf")
        with np.errstate(all="ignore"):
            try:
                residuals, spreads = left_out(np.exp(logs))
            except np.linalg.LinAlgError:  # lengths so long that all places are one to rounding
                return float("inf")
            widths = np.mean(np.abs(residuals) / spreads[:, None], axis=0)
            return float(np.mean(np.log(widths)) + np.mean(np.log(spreads)))

    start = np.log(first) + np.concatenate([np.zeros((1, len(first))), np.eye(len(first))])
    options = {"initial_simplex": start, "xatol": tolerance, "fatol": tolerance}
    return np.exp(scipy.optimize.minimize(badness, start[0], method="Nelder-Mead", options=options).x)


def widths_of(curves: Curves, box: Mapping[str, Sequence[float]], settings: Array) -> Array:
    """Half-widths that hold the fraction `COVERED` of all errors, over the standard deviation of the kriging.

    The errors are those of curves that are left out. Their quantile is that for one more curve (conformal prediction).
    It is taken over curves at random places if there are `ENOUGH`: a further random place is to them as each of them is
    to the others, whereas curves at the edges are extrapolated when they are left out.

    Returns:
        Factors, shape (distances,).
    """
    residuals, spreads = curves.kriging(box, settings).left_out()
    alike = curves.random if curves.random.sum() >= ENOUGH else np.ones_like(curves.random)
    ratios = (np.abs(residuals) / spreads[:, None])[alike]
    near = [slice(max(k - NEIGHBOURS, 0), k + NEIGHBOURS + 1) for k in range(ratios.shape[1])]
    scales = np.array([ratios[:, each].mean() for each in near])
    return np.asarray(scales * np.quantile(ratios / scales, min(COVERED * (len(ratios) + 1) / len(ratios), 1.0)))


def left_out(atlas: Atlas) -> Array:
    """Errors of the atlas at the place of each curve, without this curve, over its peak, (curves, distances)."""
    return atlas.dU.left_out()[0] * atlas.curves.places[:, :1] ** POWER / atlas.curves.peaks


def least_sure(atlas: Atlas, candidates: Array, count: int) -> Array:
    """The candidates with the largest half-width over the peak, each chosen as if the ones before were known.

    Candidates are beta, De and Ca_e, shape (candidates, 3); the result has the shape (count, 3).
    """
    curves = atlas.curves
    for _ in range(count):
        dU, half_width = replace(atlas, curves=curves).velocities(candidates)
        place = candidates[[np.argmax(half_width.mean(axis=1) / np.abs(dU).max(axis=1))]]
        found = atlas.at(*place[0])
        by = np.array([[found.sensitivities[name] for name in PARAMETERS]])
        curves += Curves(place, np.array([False]), found.dU[None], 0 * found.dU[None], by, 0 * by, by[:, 0])
    return curves.places[-count:]
