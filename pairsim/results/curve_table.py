"""What tables of curves say: dU as a function of the distance, its zeros, and from where on a start is forgotten."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from pairsim.runtime.arrays import Array
from pairsim.solvers.curves.interpolant import CurveInterpolant, Peak, Region

ROUNDING = 1e-9  # |dU| that is rounding error, as of equal rigid spheres [U_av]
FORGOTTEN = 3.0  # decay times after which a start is forgotten; chosen: exp(-3) = .05
STEPS = 400  # parts of the way for the integral; chosen


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


@dataclass(frozen=True)
class Zero:
    """A distance at which dU vanishes, with its error where it is known, and whether it is stable."""

    d: float
    stable: bool
    error: float | None = None

    @property
    def kind(self) -> str:
        """Stable or unstable."""
        return "stable" if self.stable else "unstable"


def zeros_in(table: Mapping[str, Any], name: str = "d") -> list[Zero]:
    """The zeros in a table, whose distances are in the column `name`."""
    errors = [float(each) if math.isfinite(each) else None for each in table.get("d_error", ())]
    found = table.get(name, ()), table.get("stable", ()), errors or [None] * len(table.get(name, ()))
    return [Zero(float(d), bool(stable), error) for d, stable, error in zip(*found, strict=True)]
