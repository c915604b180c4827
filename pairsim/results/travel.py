"""Time and length of tube in which a pair moves from one distance to another, from its master curve."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import scipy

from pairsim.results.curve_table import curve_of, stretch_at
from pairsim.results.memory import forgotten_at
from pairsim.results.output import read_series
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

TOLERANCE = 1e-10  # relative, of the integrals
SAME = 1e-9  # relative difference of a distance from an end of the curve that is due to rounding


@dataclass(frozen=True)
class Travel:
    """Time and length of tube for the motion of a pair between two distances, with half-widths of their intervals.

    Attributes:
        time: Integral of dz/dU over the distance z of the centres of volume [D_c/U_av].
        length: Integral of U/dU dz with the mean velocity U of the pair: how far it travels along the tube [D_c].
        time_error: Half-width of the time: with dU on either end of its interval everywhere.
        length_error: Half-width of the length, in the same way.
        forgotten: Distance from which on a pair that starts at the first one moves so; see `forgotten_at`.
    """

    time: float
    length: float
    time_error: float
    length_error: float
    forgotten: float | None


def travel(table: Mapping[str, Array], start: float, stop: float, source: str) -> Travel:
    """Integrate a master curve from one distance to another.

    Args:
        table: Columns of curve.csv in ascending d, each of shape (points,).
        start: First distance [D_c].
        stop: Last distance [D_c].
        source: Name of the folder for messages.

    Raises:
        InputError: The curve is not that of a pair, a distance is outside the curve, there is a zero of dU between the
            distances or there may be one, or the pair moves in the other direction.
    """
    curve = curve_of(table) if "U_L" in table and "U_T" in table else None
    if curve is None:
        raise InputError(source, "", None, "must be the curve of a pair with at least two points")
    start, stop = (_inside(curve.d, option, d, source) for option, d in (("--from", start), ("--to", stop)))
    if start == stop:
        raise InputError(source, "--to", stop, "must differ from --from")
    low, high = sorted((start, stop))
    if zeros := [zero for zero in curve.zeros if low <= zero <= high]:
        listed = ", ".join(f"{zero:.4g}" for zero in zeros)
        raise InputError(
            source, "--to", stop, f"must be on the same side of the zeros of dU as {start:g}: dU = 0 at d = {listed}"
        )
    if (curve.values(np.sqrt(low * high)) > 0) != (stop > start):
        side, motion = ("above", "separates") if stop < start else ("below", "approaches")
        raise InputError(source, "--to", stop, f"must be {side} {start:g}: the pair {motion} there")
    samples = curve.samples[0]
    inside = np.array([low, *samples[(low < samples) & (samples < high)], high])
    unsure = inside[np.abs(curve.values(inside)) <= curve.half_widths(inside)]
    if unsure.size:
        raise InputError(
            source, "--to", stop, f"must be reached without a distance at which dU may vanish, as at {unsure[0]:.4g}"
        )
    mean = scipy.interpolate.PchipInterpolator(np.log(curve.d), (table["U_L"] + table["U_T"]) / 2)
    places = np.log([low, *curve.d[(low < curve.d) & (curve.d < high)], high])

    def integral(velocity: Callable[[float], float], part: int) -> float:
        """The integral of velocity/|dU| over the distance of the centres, `part` half-widths added to |dU|."""

        def rate(x: float) -> float:
            d = np.exp(x)
            return float(velocity(x) * stretch_at(table, x) * d / (abs(curve.values(d)) + part * curve.half_widths(d)))

        return sum(scipy.integrate.quad(rate, a, b, epsrel=TOLERANCE, epsabs=0)[0] for a, b in pairwise(places))

    def with_half_width(velocity: Callable[[float], float]) -> tuple[float, float]:
        value, least, most = (integral(velocity, part) for part in (0, 1, -1))
        return value, max(value - least, most - value)

    (time, time_error), (length, length_error) = with_half_width(lambda x: 1.0), with_half_width(mean)
    return Travel(time, length, time_error, length_error, forgotten_at(table, start))


def _inside(ends: Array, option: str, d: float, source: str) -> float:
    """A distance on a curve, the end of the curve where it differs from it by rounding.

    Raises:
        InputError: The distance is outside the curve.
    """
    for end in (float(ends[0]), float(ends[-1])):
        if abs(d - end) < SAME * end:
            return end
    if not ends[0] <= d <= ends[-1]:
        allowed = f"must be between {ends[0]:g} and {ends[-1]:g}, the ends of the curve"
        raise InputError(source, option, d, allowed)
    return d


def travel_in(directory: Path, start: float, stop: float) -> Travel:
    """As `travel`, for the curve in a folder."""
    return travel(read_series(directory / "curve.csv"), start, stop, str(directory))
