"""What tables of curves say: dU as a function of the distance, its zeros, and from where on a start is forgotten."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from pairsim.results.columns import suffixes_in
from pairsim.runtime.arrays import Array
from pairsim.solvers.curves.interpolant import NEGLIGIBLE_DU, CurveInterpolant, Peak, Region, hermite, slopes_of

FORGOTTEN = 3.0  # decay times after which a start is forgotten; chosen: exp(-3) = .05
CLOSE = 1e-9  # relative difference of distances that is rounding; chosen
STEPS = 400  # parts of the way for the integral; chosen
NODES = 512  # distances of a curve, between which rates of its motion are interpolated linearly; chosen
TINY = 1e-12  # slope of a rate that does not change; rounding


def over(table: Mapping[str, Array], gap: str = "") -> str:
    """The column of the distance over which dU of a gap is a curve: its own, or the one that alone varies."""
    varied = [name for each in suffixes_in(table, "d") if np.ptp(table[name := f"d{each}"]) > 0]
    return varied[0] if len(varied) == 1 else f"d{gap}"


def curve_of(table: Mapping[str, Array], gap: str = "") -> CurveInterpolant | None:
    """dU of a gap as a function of d; None unless there are two points over a distance that all gaps have.

    The table is curve.csv, of shape (points,), in ascending distance. A curve from rest has no slopes of its own.
    """
    if not {f"slope{gap}", f"dU_half{gap}"} & table.keys() or len(table[f"dU{gap}"]) < 2:
        return None
    d, dU, errors = (table[name] for name in (over(table, gap), f"dU{gap}", f"dU_error{gap}"))
    differentiated, slope = (table.get(f"{name}{gap}", np.zeros_like(d)) for name in ("dU_discrete", "slope"))
    return _interpolant(*(np.asarray(each, dtype=float).tobytes() for each in (d, dU, differentiated, slope, errors)))


@lru_cache(maxsize=4)
def _interpolant(*columns: bytes) -> CurveInterpolant:
    """That of columns; kept, since each sentence of an answer asks for it."""
    return CurveInterpolant(*map(np.frombuffer, columns))


OfDistance = Callable[[Array | float], Array]


@dataclass(frozen=True)
class Motion:
    """How a pair moves at each distance."""

    curve: CurveInterpolant  # dU with its interval [U_av]
    velocity: OfDistance  # mean velocity of both particles [U_av]
    stretch: OfDistance  # derivative of the distance between the centres by that between the surfaces
    t_relax: OfDistance | None = None  # decay time of the slowest disturbance [D_c/U_av], None where it is not known
    from_rest: OfDistance | None = None  # bound on what a start from rest there shifts the centres by [D_c], if known

    @staticmethod
    def of(table: Mapping[str, Array]) -> Motion | None:
        """That of a pair, by its curve.csv in ascending distance; None unless there are two points."""
        curve = curve_of(table) if table.keys() >= {"U_L", "U_T", "stretch"} else None
        if curve is None:
            return None
        x = np.log(curve.d)
        smooth = (table["U_L"] + table["U_T"]) / 2, table["stretch"]
        mean, stretch = (hermite(x, values, slopes_of(values, x)) for values in smooth)
        times = table["t_relax"]
        t_relax = (lambda d: np.interp(np.log(d), x, times)) if np.isfinite(times).all() else None
        shifts = table.get("from_rest")
        from_rest = None if shifts is None else (lambda d: np.interp(np.log(d), x, shifts))
        return Motion(curve, lambda d: mean(np.log(d)), lambda d: stretch(np.log(d)), t_relax, from_rest)

    @cached_property
    def rates(self) -> tuple[Array, Array]:
        """Logarithms of distances of the curve, ascending, and their rates of change in time, shape (NODES,) each."""
        d = np.geomspace(self.curve.d[0], self.curve.d[-1], NODES)
        return np.log(d), self.curve.values(d) / self.stretch(d) / d

    def path(self, start: float, times: Array) -> Array:
        """Distances of the pair [D_c] at times [D_c/U_av], up to the ends of the curve, shape (times,).

        It is at `start` [D_c] at the time 0.
        """
        return path_by(*self.rates, start, times)


def path_by(x: Array, rate: Array, start: float, times: Array) -> Array:
    """Distances [D_c] at times [D_c/U_av] by the rates of their logarithms x, shape (times,); see `Motion.path`.

    Between two nodes, where rates are linear, the motion is an exponential function of time.
    """
    begin = np.log(start)
    first = np.interp(begin, x, rate)
    order = slice(None, None, 1 if first > 0 else -1)
    ahead = (x[order] - begin) * first > 0
    if not ahead.any():
        return np.full(times.shape, start)
    x, rate = np.append(begin, x[order][ahead]), np.append(first, rate[order][ahead])
    slope = np.diff(rate) / np.diff(x)
    slope[slope == 0] = TINY
    with np.errstate(all="ignore"):  # not a number beyond a zero, which it never reaches
        passed = np.append(0.0, np.cumsum(np.log1p(np.diff(rate) / rate[:-1]) / slope))
        left = np.minimum(np.searchsorted(passed[1:], times, side="right"), len(slope) - 1)
        way = rate[left] * np.expm1(slope[left] * (times - passed[left])) / slope[left]
    return np.asarray(np.exp(np.clip(x[left] + way, *sorted(x[[0, -1]]))))


def peak_of(table: Mapping[str, Array], gap: str = "") -> Peak:
    """The largest |dU| of a gap: that of the curve, or of points that have none, whose place is not interpolated."""
    if (curve := curve_of(table, gap)) is not None:
        return curve.peak
    d, dU, error = (table[name] for name in (over(table, gap), f"dU{gap}", f"dU_error{gap}"))
    largest = int(np.argmax(np.abs(dU)))
    return Peak(float(d[largest]), float(dU[largest]), float(error[largest]), 0.0)


def regions_of(table: Mapping[str, Array], zeros: Sequence[float]) -> list[Region]:
    """Where a pair separates, comes closer, or may do either; none if dU vanishes at every distance.

    The table is its curve.csv; zeros of dU are known ones.
    """
    peak, curve = peak_of(table), curve_of(table)
    if abs(peak.dU) < NEGLIGIBLE_DU:
        return []
    if curve is None:
        return [Region(peak.d, peak.d, int(np.sign(peak.dU)) if abs(peak.dU) > peak.error else 0)]
    return curve.regions(zeros)


def held_regions(table: Mapping[str, Array], regions: Sequence[Region]) -> list[Region]:
    """Those of the regions of a pair in which unyielded liquid holds it together at every point of its table."""
    if "creep" not in table:
        return []
    from pairsim.solvers.curves.locked import held_together  # loads FEniCSx

    d, held = table["d"], held_together(*(table[name] for name in ("dU", "dU_error", "bridge", "creep")))
    inside = [(each.start * (1 - CLOSE) <= d) & (d <= each.stop * (1 + CLOSE)) for each in regions]
    return [
        each for each, here in zip(regions, inside, strict=True) if not each.sign and here.any() and held[here].all()
    ]


@dataclass(frozen=True)
class Memory:
    """How a pair forgets its start while it moves along a curve."""

    d: Array  # distances that it passes, from the start on [D_c], shape (n,)
    decays: Array  # decay times that have passed when it gets there, shape (n,)
    ends: bool  # whether it leaves the curve; else it comes to rest beyond the last distance

    @classmethod
    def after(cls, motion: Motion, start: float) -> Memory | None:
        """That after a start at a distance [D_c], of a pair that moves so; None if decay times are not known."""
        if motion.t_relax is None:
            return None
        curve = motion.curve
        away = float(curve.values(start)) > 0
        way = np.geomspace(start, curve.ends[1] if away else curve.ends[0], STEPS)
        speed = curve.values(way) * (1 if away else -1)
        way, speed = (each[: STEPS if (speed > 0).all() else int(np.argmin(speed > 0))] for each in (way, speed))
        x = np.log(way)
        with np.errstate(divide="ignore"):
            rate = motion.stretch(way) * way / speed / motion.t_relax(way)
        steps = np.diff(x) * (rate[1:] + rate[:-1]) / 2  # scipy's running integral takes .3 s to import
        passed = np.abs(np.concatenate([[0.0], np.cumsum(steps)]))[: len(x)]
        return cls(way, passed, len(way) == STEPS)

    @property
    def forgotten(self) -> float:
        """Distance from which on the pair moves as the curve says, `FORGOTTEN` decay times after its start [D_c].

        Infinite if it leaves the curve before.
        """
        if len(self.d) and self.decays[-1] >= FORGOTTEN:
            return float(self.d[int(np.argmax(self.decays >= FORGOTTEN))])
        return np.inf if self.ends or not len(self.d) else float(self.d[-1])  # at rest, it has all the time


def forgotten_at(table: Mapping[str, Array], start: float) -> float | None:
    """The distance of `Memory.forgotten`, None if the decay times are not known."""
    motion = Motion.of(table)
    memory = None if motion is None else Memory.after(motion, start)
    return memory.forgotten if memory is not None else None


@dataclass(frozen=True)
class Zero:
    """A distance at which dU vanishes, with its error where it is known, and whether it is stable."""

    d: float
    stable: bool
    error: float | None = None

    @property
    def kind(self) -> str:
        return "stable" if self.stable else "unstable"


def zeros_of(table: Mapping[str, Array]) -> dict[str, Array]:
    """The zeros of the interpolant of a curve with their half-widths, as in equilibria.csv."""
    curve = curve_of(table)
    d = np.array(curve.zeros if curve is not None else [])
    slope = np.interp(d, table["d"], table["slope"] if "slope" in table else np.gradient(table["dU"], table["d"]))
    half = curve.half_widths(d) if curve is not None else d
    return {"d": d, "stable": slope < 0, "slope": slope, "d_error": half / np.abs(slope)}


def zeros_in(table: Mapping[str, Any], name: str = "d") -> list[Zero]:
    """The zeros in a table, whose distances are in the column `name`."""
    errors = [float(each) if math.isfinite(each) else None for each in table.get("d_error", ())]
    found = table.get(name, ()), table.get("stable", ()), errors or [None] * len(table.get(name, ()))
    return [Zero(float(d), bool(stable), error) for d, stable, error in zip(*found, strict=True)]
