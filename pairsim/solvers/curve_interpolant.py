"""Interpolation of a master curve between its points."""

from __future__ import annotations

import numpy as np
import scipy

from pairsim.runtime.arrays import Array


def curve_interpolant(d: Array, values: Array, slopes: Array) -> scipy.interpolate.CubicHermiteSpline:
    """Cubic Hermite interpolant in log d.

    Args:
        d: Distances, ascending, shape (n,).
        values: Values at these distances, shape (n,) or (n, k).
        slopes: Derivatives with respect to d, of the same shape.

    Returns:
        The interpolant as a function of log d.
    """
    factors = d if values.ndim == 1 else d[:, None]
    return scipy.interpolate.CubicHermiteSpline(np.log(d), values, slopes * factors)
