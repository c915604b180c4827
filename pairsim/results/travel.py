"""How long, and how much tube, a pair needs from one distance to another, by its quasi-steady curve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from pairsim.results.output import read_series
from pairsim.runtime.errors import InputError

Array = NDArray[np.float64]
COLUMNS = ("d", "dU", "slope", "U_L", "U_T", "drift")
TOLERANCE = 1e-10


@dataclass(frozen=True)
class Travel:
    """The way of a pair between two distances.

    Attributes:
        time: Integral of dd/dU [D_c/U_av].
        length: Integral of U/dU dd with U the mean velocity of the pair, how far it moves meanwhile [D_c].
        drift: What the terms that a quasi-steady solution leaves out change in the time, as a part of it; None where
            they turn the pair round.
    """

    time: float
    length: float
    drift: float | None


def travel(table: dict[str, Array], start: float, stop: float, source: str) -> Travel:
    """Integrate a curve from one distance to another.

    Args:
        table: Columns of curve.csv, in ascending d.
        start, stop: Distances [D_c].
        source: What messages name.

    Raises:
        InputError: The curve is not that of a pair, does not reach one of the distances, passes a zero of dU on the
            way, or leads the other way.
    """
    if any(name not in table for name in COLUMNS) or len(table["d"]) < 2:
        raise InputError(source, "", None, "must be the curve of a pair with two points or more")
    d = table["d"]
    for option, distance in (("--from", start), ("--to", stop)):
        if not d[0] <= distance <= d[-1]:
            raise InputError(source, option, distance, f"must be on the curve, between d = {d[0]:g} and {d[-1]:g}")
    if start == stop:
        raise InputError(source, "--to", stop, "must differ from --from")
    x = np.log(d)
    curve = CubicHermiteSpline(x, table["dU"], table["slope"] * d)
    low, high = sorted((float(np.log(start)), float(np.log(stop))))
    roots = [float(root) for root in curve.roots(extrapolate=False) if low <= root <= high]
    if roots:
        zeros = ", ".join(f"{np.exp(root):.4g}" for root in roots)
        raise InputError(source, "--to", stop, f"is never reached from d = {start:g}: dU = 0 at d = {zeros} on the way")
    if (curve(0.5 * (low + high)) > 0) != (stop > start):
        away = "separates" if stop < start else "approaches"
        raise InputError(source, "--to", stop, f"must be on the other side of {start:g}: the pair {away} there")
    drift, mean = PchipInterpolator(x, table["drift"]), PchipInterpolator(x, (table["U_L"] + table["U_T"]) / 2)
    places = [low, *(float(value) for value in x if low < value < high), high]

    def integral(rate: Callable[[float], float]) -> float:
        parts = [quad(rate, a, b, epsrel=TOLERANCE, epsabs=0)[0] for a, b in pairwise(places)]
        return float(abs(sum(parts)))

    time = integral(lambda at: np.exp(at) / curve(at))
    length = integral(lambda at: np.exp(at) * mean(at) / curve(at))
    fine = np.linspace(low, high, 200 * len(places))
    turned = np.any((curve(fine) + drift(fine)) * curve(fine) <= 0)
    drifted = None if turned else integral(lambda at: np.exp(at) / (curve(at) + drift(at))) / time - 1
    return Travel(time, length, drifted)


def travel_in(directory: Path, start: float, stop: float) -> Travel:
    """As `travel`, of the curve in a folder."""
    return travel(read_series(directory / "curve.csv"), start, stop, str(directory))
