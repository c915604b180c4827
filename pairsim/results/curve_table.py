"""dU of a table curve.csv as a function of the distance."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import scipy

from pairsim.runtime.arrays import Array
from pairsim.solvers.curves.interpolant import CurveInterpolant, Peak, Region

ROUNDING = 1e-9  # |dU| that is rounding error, as of equal rigid spheres [U_av]


def curve_of(table: Mapping[str, Array], gap: str = "") -> CurveInterpolant | None:
    """dU of a gap as a function of d; None unless there are two points over a distance that all gaps have.

    Args:
        table: Columns of curve.csv, of shape (points,), in ascending distance.
        gap: The suffix of its columns.
    """
    if f"slope{gap}" not in table or len(table[f"dU{gap}"]) < 2:
        return None
    d, dU, differentiated, slope, errors = (
        table[f"{name}{gap}"] for name in ("d", "dU", "dU_discrete", "slope", "dU_error")
    )
    return CurveInterpolant(d, dU, differentiated, slope, errors)


def stretch_of(table: Mapping[str, Array]) -> Callable[[Array | float], Array]:
    """Derivative of the distance between the centres by d, as a function of log d."""
    return scipy.interpolate.PchipInterpolator(np.log(table["d"]), table["stretch"])


def peak_of(table: Mapping[str, Array], gap: str = "") -> Peak:
    """The largest |dU| of a gap: that of the curve, or of points that have none, whose place is not interpolated."""
    if (curve := curve_of(table, gap)) is not None:
        return curve.peak
    d, dU, error = (table[f"{name}{gap}"] for name in ("d", "dU", "dU_error"))
    largest = int(np.argmax(np.abs(dU)))
    return Peak(float(d[largest]), float(dU[largest]), float(error[largest]), 0.0)


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
