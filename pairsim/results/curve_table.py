"""dU of a table curve.csv as a function of the distance."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import scipy

from pairsim.results.columns import error_column
from pairsim.runtime.arrays import Array
from pairsim.solvers.curves.interpolant import CurveInterpolant, Peak, Region

ROUNDING = 1e-9  # |dU| that is rounding error, as of equal rigid spheres [U_av]


def curve_of(table: Mapping[str, Array], gap: str = "") -> CurveInterpolant | None:
    """dU of a gap as a function of d; None unless there are two points over a distance that all gaps have.

    Tables of earlier versions have uncorrected values, or one dU, that with the distance held, and need not have an
    error of it.

    Args:
        table: Columns of curve.csv, of shape (points,), in ascending distance.
        gap: What the names of the columns of the gap end with.
    """
    slope, dU, error = table.get(f"slope{gap}"), table.get(f"dU{gap}"), error_column(table, gap)
    if slope is None or dU is None or len(dU) < 2:
        return None
    errors = np.zeros_like(dU) if error is None else table[error]
    differentiated = table.get(f"dU_discrete{gap}", table.get(f"dU_held{gap}", dU))
    return CurveInterpolant(table[f"d{gap}"], dU, differentiated, slope, errors)


def stretch_of(table: Mapping[str, Array]) -> Callable[[Array | float], Array]:
    """Derivative of the distance between the centres by d, as a function of log d; 1 in tables that do not have it."""
    points = np.log(table["d"])
    return scipy.interpolate.PchipInterpolator(points, table.get("stretch", np.ones_like(points)))


def peak_of(table: Mapping[str, Array], gap: str = "") -> Peak:
    """The largest |dU| of a gap: that of the curve, or of points that have none, whose place is not interpolated."""
    if (curve := curve_of(table, gap)) is not None:
        return curve.peak
    dU, error = table[f"dU{gap}"], error_column(table, gap)
    largest = int(np.argmax(np.abs(dU)))
    half_width = float(table[error][largest]) if error is not None else 0.0
    return Peak(float(table[f"d{gap}"][largest]), float(dU[largest]), half_width, 0.0)


def regions_of(table: Mapping[str, Array], zeros: Sequence[float]) -> list[Region]:
    """Where a pair separates, comes closer, or may do either; none if dU vanishes at every distance.

    Args:
        table: Columns of curve.csv of a pair.
        zeros: Known zeros of dU.
    """
    peak, curve = peak_of(table), curve_of(table)
    if abs(peak.dU) < ROUNDING:
        return []
    if curve is None:
        return [Region(peak.d, peak.d, int(np.sign(peak.dU)) if abs(peak.dU) > peak.error else 0)]
    return curve.regions(zeros)
