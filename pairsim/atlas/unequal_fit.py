"""Add curves of pairs whose beads differ to an atlas of equal pairs, with half-widths from curves left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from pairsim.atlas.atlas import Atlas
from pairsim.atlas.fit import COVERED, NEIGHBOURS, most_probable
from pairsim.atlas.single_beads import SingleBeads
from pairsim.atlas.unequal import POWER_OF_REST, Unequal, UnequalAtlas, UnequalCurves
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

CLOSE = 0.01  # tolerance of the logarithms of settings, and of what is minimised; chosen
LEAST = 4  # least number of curves with which half-widths can follow from those left out; chosen
FIRST = (3.0, 1.0, 3.0, 5.0, 5.0, 3e-3, 5e-2, 0.5)
"""First guess of the settings of `Unequal`."""
FIRST_OF_BEADS = (4.0, 0.4, 2.0, 1e-5, 3e-2)
"""First guess of the settings of the kriging of `SingleBeads`."""


def with_unequal(
    atlas: Atlas, curves: UnequalCurves, singles: tuple[Array, Array], ratios: Mapping[str, Sequence[float]]
) -> Atlas:
    """An atlas to which unequal pairs are added.

    Correlation lengths and errors are those that make unequal curves, left out, most probable, as in `fit.fit`.

    Args:
        atlas: That of equal pairs.
        curves: Unequal curves in its box, at least `LEAST`.
        singles: beta, De and Ca_e of single beads, (beads, 3), and their velocities [U_av], (beads,).
        ratios: As in `Unequal`.

    Raises:
        InputError: The curves are too few, or the atlas has no derivatives by the difference of the diameters.
    """
    if len(curves.De) < LEAST:
        raise InputError("atlas", "curves", len(curves.De), f"must be at least {LEAST} curves of unequal pairs")
    if not np.isfinite(atlas.curves.differences).all(axis=1).any():
        raise InputError(
            "atlas", "start", None, "must have curves with derivatives with respect to the difference of the diameters"
        )
    beads = _beads(atlas, curves, singles)
    model = UnequalAtlas(atlas, Unequal(ratios, np.array(FIRST), np.ones(len(atlas.d)), curves, beads))
    places, data = model.data_of(curves)
    inner = data[:, :, :-1]  # at the largest distance the rest is zero
    settings = most_probable(FIRST, lambda those: _left_out(model, places, inner, those), tolerance=CLOSE)
    widths = widths_by(*_left_out(model, places, data, settings))
    return replace(atlas, unequal=Unequal(ratios, settings, widths, curves, beads))


def widths_by(residuals: Array, spreads: Array) -> Array:
    """Half-widths over standard deviations, (distances,), from curves left out: the `widths` of `Unequal`.

    At each distance they are a quantile over the curves, of the largest ratio of each there and at its neighbours: that
    for one more curve (conformal prediction), which is the maximum of fewer than 20.

    Args:
        residuals: Errors of curves left out, shape (curves, distances).
        spreads: Standard deviations of the kriging without them, shape (curves,).
    """
    ratios = np.abs(residuals) / spreads[:, None]
    near = [slice(max(k - NEIGHBOURS, 0), k + NEIGHBOURS + 1) for k in range(ratios.shape[1])]
    largest = np.array([ratios[:, each].max(axis=1) for each in near])
    return np.asarray(np.quantile(largest, min(COVERED * (len(ratios) + 1) / len(ratios), 1.0), axis=1))


def _beads(atlas: Atlas, curves: UnequalCurves, singles: tuple[Array, Array]) -> SingleBeads:
    """Single beads, together with those of equal and unequal pairs at the largest distance."""
    equal, pairs = atlas.curves, curves.beads
    by_beta = equal.differences[:, -1] / equal.places[:, 0]  # far apart a difference has no other effect
    places = np.concatenate([equal.places, pairs.alone(0), pairs.alone(1), singles[0]])
    velocities = np.concatenate([equal.others[:, 0, -1], *curves.ends.T, singles[1]])
    slopes = np.concatenate([by_beta, np.full(len(places) - len(by_beta), np.nan)])
    alone = np.arange(len(places)) >= len(places) - len(singles[1])
    first = SingleBeads(atlas.box, places, velocities, slopes, alone, np.array(FIRST_OF_BEADS))
    settings = most_probable(FIRST_OF_BEADS, lambda those: first.kriging_by(those).left_out(), tolerance=CLOSE)
    return replace(first, settings=settings)


def left_out(atlas: UnequalAtlas) -> Array:
    """Errors of the atlas for each unequal curve, without this curve, over its peak, shape (curves, distances)."""
    curves = atlas.unequal.curves
    residuals, _ = _left_out(atlas, *atlas.data_of(curves), atlas.unequal.settings)
    size = curves.betas.mean(axis=1)[:, None] ** POWER_OF_REST
    return np.asarray(residuals * size / np.abs(curves.dU).max(axis=1, keepdims=True))


def _left_out(model: UnequalAtlas, places: Array, data: Array, settings: Array) -> tuple[Array, Array]:
    """Residuals of the rest of unequal curves left out, (curves, distances), and standard deviations, (curves,)."""
    count = len(model.equal.curves.places)
    return model.kriging(places, data, settings).left_out(range(count, len(places)))
