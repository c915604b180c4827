"""How far a pair moves before its start is forgotten, by its master curve."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import scipy

from pairsim.results.curve_table import curve_of, stretch_of
from pairsim.runtime.arrays import Array

FORGOTTEN = 3.0  # decay times after which a start is forgotten; chosen: exp(-3) = .05
STEPS = 400  # parts of the way for the integral; chosen


def forgotten_at(table: Mapping[str, Array], start: float) -> float | None:
    """The distance from which on a pair moves as the curve says, `FORGOTTEN` decay times after its start.

    Args:
        table: Columns of curve.csv of a pair, in ascending distance.
        start: Distance at the start [D_c].

    Returns:
        The distance; infinite if the pair leaves the curve before, None if the decay times are not known.
    """
    curve = curve_of(table)
    if curve is None or not np.isfinite(t_relax := table["t_relax"]).all():
        return None
    away = float(curve.values(start)) > 0
    way = np.geomspace(start, curve.d[-1] if away else curve.d[0], STEPS)
    speed = curve.values(way) * (1 if away else -1)
    way, speed = (each[: STEPS if (speed > 0).all() else int(np.argmin(speed > 0))] for each in (way, speed))
    x = np.log(way)
    with np.errstate(divide="ignore"):
        rate = stretch_of(table)(x) * way / speed / np.interp(x, np.log(curve.d), t_relax)
    passed = np.abs(scipy.integrate.cumulative_trapezoid(rate, x, initial=0.0))
    if len(way) and passed[-1] >= FORGOTTEN:
        return float(way[int(np.argmax(passed >= FORGOTTEN))])
    return float(way[-1]) if 0 < len(way) < STEPS else np.inf  # at rest, it has all the time
