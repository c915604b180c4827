"""The master curve between its points."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from pairsim.runtime.arrays import Array


def curve_interpolant(d: Array, values: Array, slopes: Array) -> CubicHermiteSpline:
    """The cubic Hermite interpolant over log d.

    Args:
        d: Distances, ascending, shape (n,).
        values: Values there, shape (n,) or (n, k).
        slopes: Their derivatives by d, of the same shape.

    Returns:
        A function of log d.
    """
    factors = d if values.ndim == 1 else d[:, None]
    return CubicHermiteSpline(np.log(d), values, slopes * factors)
