"""Time and length of tube in which a pair moves from one distance to another, from its master curve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from pairsim.results.output import read_series
from pairsim.runtime.errors import InputError
from pairsim.solvers.curve_interpolant import curve_interpolant

Array = NDArray[np.float64]
COLUMNS = ("d", "dU", "dU_held", "slope", "U_L", "U_T")
TOLERANCE = 1e-10


@dataclass(frozen=True)
class Travel:
    """Time and length of tube for the motion of a pair between two distances.

    Attributes:
        time: Integral of dd/dU [D_c/U_av].
        length: Integral of U/dU dd with the mean velocity U of the pair: how far it travels along the tube [D_c].
        drift: Relative change of `time` due to the terms neglected in a quasi-steady solution; None if with them dU
            changes its sign between the two distances.
    """

    time: float
    length: float
    drift: float | None


def travel(table: dict[str, Array], start: float, stop: float, source: str) -> Travel:
    """Integrate a master curve from one distance to another.

    Args:
        table: Columns of curve.csv in ascending d, each of shape (points,).
        start: First distance [D_c].
        stop: Last distance [D_c].
        source: Name of the folder for messages.

    Raises:
        InputError: The curve is not that of a pair, a distance is outside the curve, there is a zero of dU between the
            distances, or the pair moves in the other direction.
    """
    if any(name not in table for name in COLUMNS) or len(table["d"]) < 2:
        raise InputError(source, "", None, "must be the curve of a pair with at least two points")
    d = table["d"]
    for option, distance in (("--from", start), ("--to", stop)):
        if not d[0] <= distance <= d[-1]:
            raise InputError(source, option, distance, f"must be between {d[0]:g} and {d[-1]:g}, the ends of the curve")
    if start == stop:
        raise InputError(source, "--to", stop, "must differ from --from")
    x = np.log(d)
    curve = curve_interpolant(d, table["dU_held"], table["slope"])
    low, high = sorted((float(np.log(start)), float(np.log(stop))))
    roots = [float(root) for root in curve.roots(extrapolate=False) if low <= root <= high]
    if roots:
        zeros = ", ".join(f"{np.exp(root):.4g}" for root in roots)
        raise InputError(
            source, "--to", stop, f"must be on the same side of the zeros of dU as {start:g}: dU = 0 at d = {zeros}"
        )
    if (curve(0.5 * (low + high)) > 0) != (stop > start):
        side, motion = ("above", "separates") if stop < start else ("below", "approaches")
        raise InputError(source, "--to", stop, f"must be {side} {start:g}: the pair {motion} there")
    drift, mean = (
        scipy.interpolate.PchipInterpolator(x, table["dU"] - table["dU_held"]),
        scipy.interpolate.PchipInterpolator(x, (table["U_L"] + table["U_T"]) / 2),
    )
    places = [low, *(float(value) for value in x if low < value < high), high]

    def integral(rate: Callable[[float], float]) -> float:
        parts = [scipy.integrate.quad(rate, a, b, epsrel=TOLERANCE, epsabs=0)[0] for a, b in pairwise(places)]
        return float(abs(sum(parts)))

    time = integral(lambda at: np.exp(at) / curve(at))
    length = integral(lambda at: np.exp(at) * mean(at) / curve(at))
    fine = np.linspace(low, high, 200 * len(places))
    turned = np.any((curve(fine) + drift(fine)) * curve(fine) <= 0)
    drifted = None if turned else integral(lambda at: np.exp(at) / (curve(at) + drift(at))) / time - 1
    return Travel(time, length, drifted)


def travel_in(directory: Path, start: float, stop: float) -> Travel:
    """As `travel`, for the curve in a folder."""
    return travel(read_series(directory / "curve.csv"), start, stop, str(directory))
