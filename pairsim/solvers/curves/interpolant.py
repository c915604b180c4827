"""A master curve as a function: dU at any distance between its points, and the half-width of its interval."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.curves.distances import WIDEST

ORDER = 2.5  # power of its width in log d with which the error of an interval falls; 4 for smooth curves. Measured
NEGLIGIBLE_DU = 1e-10  # |dU| up to which it counts as zero [U_av]; up to 5e-15 was measured for equal rigid spheres
FINE = 64  # number of parts of an interval in the search for extrema and signs; chosen
HALVINGS = 50  # bisections of such a part, which find a zero to rounding error


@dataclass(frozen=True)
class Peak:
    """The largest |dU| of a curve.

    Attributes:
        d: Its distance [D_c].
        dU: dU there [U_av].
        error: Half-width of the interval of the largest |dU| [U_av].
        d_error: Half-width of the interval around d that contains all distances at which |dU| may be largest [D_c].
    """

    d: float
    dU: float
    error: float
    d_error: float


@dataclass(frozen=True)
class Region:
    """A range of distances in which dU has one sign, or a sign that is not known.

    Attributes:
        start: Smallest distance [D_c].
        stop: Largest distance [D_c].
        sign: 1 where the pair separates, -1 where it comes closer, 0 where the interval of dU contains 0.
    """

    start: float
    stop: float
    sign: int


class CurveInterpolant:
    """Cubic Hermite interpolant of one dU in log d, with half-widths between the points as well.

    The slope of the discrete dU at held distances is exact. That of the rest of dU, due to motion and error estimates,
    is the slope of parabolas through neighbouring points.

    The interpolation error is judged by leaving points out: it is the difference between this interpolant and that
    through all other points, between the two neighbours of the point that is left out. This difference is scaled from
    the distance of these neighbours in log d to the width of an interval, with the power `ORDER`; the largest one
    counts of the four points that are nearest to the interval, two on each side.

    Args:
        d: Distances, ascending [D_c], shape (n,), n >= 2.
        dU: Relative velocities [U_av], shape (n,).
        discrete: Discrete relative velocities at held distances, without corrections [U_av], shape (n,).
        slope: Derivatives of `discrete` with respect to d, shape (n,).
        dU_error: Half-widths of the intervals of `dU` at the points [U_av], shape (n,).

    Attributes:
        d: Distances of the points [D_c], shape (n,).
        dU_error: Half-widths of the intervals at the points [U_av], shape (n,).
    """

    def __init__(self, d: Array, dU: Array, discrete: Array, slope: Array, dU_error: Array) -> None:
        self.d, self.dU_error = d, dU_error
        self._points = np.log(d), dU, discrete, slope * d
        self._x = self._points[0]
        self._curve = self._through(*self._points)

    @staticmethod
    def _through(x: Array, dU: Array, discrete: Array, slope: Array) -> Callable[[Array | float], Array]:
        """The interpolant over x = log d, where `slope` has the derivatives of `discrete` with respect to x."""
        return hermite(x, dU, slope + slopes_of(dU - discrete, x))

    @cached_property
    def errors(self) -> Array:
        """Largest interpolation error in each interval between neighbours [U_av], shape (n-1,); infinite if n = 2."""
        x, n = self._x, len(self._x)
        if n == 2:
            return np.array([np.inf])
        scaled = np.zeros(n)  # largest change by each inner point, over the distance of its neighbours ** ORDER
        for i in range(1, n - 1):
            others = [j for j in range(max(i - 2, 0), min(i + 3, n)) if j != i]
            at = np.linspace(x[i - 1], x[i + 1], FINE)
            without = self._through(*(each[others] for each in self._points))
            scaled[i] = np.abs(self._curve(at) - without(at)).max() / (x[i + 1] - x[i - 1]) ** ORDER
        near = np.lib.stride_tricks.sliding_window_view(np.pad(scaled, 1), 4)  # two on either side of an interval
        return np.asarray(near.max(axis=1) * np.diff(x) ** ORDER)

    def values(self, d: Array | float) -> Array:
        """dU [U_av] at distances between the first and the last one [D_c], of the shape of `d`."""
        return np.asarray(self._curve(np.log(d)))

    def half_widths(self, d: Array | float) -> Array:
        """Half-widths of the intervals of `values` [U_av], of the shape of `d`."""
        x = np.log(d)
        left = np.clip(np.searchsorted(self._x, x, side="right") - 1, 0, len(self._x) - 2)
        part = (x - self._x[left]) / (self._x[left + 1] - self._x[left])
        bump = 4 * part * (1 - part)
        between = np.multiply(bump, self.errors[left], out=np.zeros_like(bump), where=bump > 0)
        return np.asarray(np.interp(x, self._x, self.dU_error) + between)

    @cached_property
    def samples(self) -> tuple[Array, Array, Array]:
        """Distances dense enough to show all extrema and signs, with values and half-widths there, (m,) each."""
        d = np.concatenate([*(np.geomspace(a, b, FINE, endpoint=False) for a, b in pairwise(self.d)), self.d[-1:]])
        return d, self.values(d), self.half_widths(d)

    @property
    def zeros(self) -> list[float]:
        """Distances at which `values` vanishes, ascending."""
        d, dU, _ = self.samples
        left = np.flatnonzero((dU[1:] < 0) != (dU[:-1] < 0))
        low, high = np.log(d[left]), np.log(d[left + 1])
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            before = (self._curve(middle) < 0) == (dU[left] < 0)
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        return np.exp(high).tolist()

    @property
    def ends(self) -> tuple[float, float]:
        """The first and the last distance."""
        d = self.samples[0]
        return float(d[0]), float(d[-1])

    @property
    def peak(self) -> Peak:
        """The largest |dU|."""
        d, dU, half = self.samples
        top, size = int(np.abs(dU).argmax()), np.abs(dU)
        least, most = max(float((size - half).max()), 0.0), float((size + half).max())
        places = d[size + half >= least]
        error = max(most - float(size[top]), float(size[top]) - least)
        return Peak(float(d[top]), float(dU[top]), error, float(max(places[-1] - d[top], d[top] - places[0])))

    def regions(self, zeros: Sequence[float] = ()) -> list[Region]:
        """Ranges in which dU is positive, negative, or of unknown sign, in ascending distance.

        Two regions of opposite signs meet at a zero, unless the range between them in which the sign is not known spans
        more than a factor `WIDEST` in distance.

        Args:
            zeros: Known zeros [D_c]; where there is none, the zero is that of the interpolant.
        """
        d, dU, half = self.samples
        signs = np.where(np.abs(dU) > half, np.sign(dU), 0).astype(int)
        starts = [0, *(np.flatnonzero(np.diff(signs)) + 1).tolist(), len(d)]
        runs = [slice(a, b) for a, b in pairwise(starts)]

        def at_a_zero(run: slice) -> bool:
            inside = run.start > 0 and run.stop < len(d)
            near = d[run][-1] < WIDEST * d[run][0] and bool(np.isfinite(half[run]).all())
            return signs[run.start] == 0 and inside and near and signs[run.start - 1] * signs[run.stop] < 0

        runs = [run for run in runs if not at_a_zero(run)]
        edges = [float(d[0])]
        for a, b in pairwise(runs):
            left, right = float(d[a][-1]), float(d[b][0])
            opposite = signs[a.start] * signs[b.start] < 0
            edges.append(self.zero(left, right, zeros) if opposite else left if signs[a.start] else right)
        return [
            Region(*ends, int(signs[run.start]))
            for run, ends in zip(runs, pairwise([*edges, float(d[-1])]), strict=True)
        ]

    def zero(self, low: float, high: float, known: Sequence[float] = ()) -> float:
        """A zero between two distances at which dU has different signs: a known one, or that of the interpolant."""
        inside = [zero for zero in known if low <= zero <= high]
        inside = inside or [zero for zero in self.zeros if low <= zero <= high]
        return inside[len(inside) // 2] if inside else float(np.sqrt(low * high))


def hermite(x: Array, values: Array, slopes: Array) -> Callable[[Array | float], Array]:
    """The cubic Hermite interpolant over x, without scipy, whose import takes longer than an answer of an atlas."""
    width, step = np.diff(x), np.diff(values)
    first, last = width * slopes[:-1], width * slopes[1:]
    powers = np.stack([first + last - 2 * step, 3 * step - 2 * first - last, first, values[:-1]])

    def value(at: Array | float) -> Array:
        left = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(width) - 1)
        return np.asarray(np.polyval(powers[:, left], (at - x[left]) / width[left]))

    return value


def slopes_of(values: Array, x: Array) -> Array:
    """Slopes at the points x of parabolas through neighbouring points; of straight lines if there are only two."""
    return np.asarray(np.gradient(values, x, edge_order=2 if len(x) > 2 else 1))
