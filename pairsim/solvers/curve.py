"""Master curves dU(d): quasi-steady solutions at many distances, adaptive refinement, and zeros."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy

from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.solvers.branch import Branch, Point
from pairsim.solvers.curve_interpolant import curve_interpolant
from pairsim.solvers.snapshot import Snapshot

# All constants were chosen.
HALVINGS = 5  # bisections of an interval with a change of sign in which Newton's method finds no zero
ROUNDING = 1e-10  # |dU| up to which dU and its slopes are rounding error, as for equal rigid spheres [U_av]
ALMOST = 0.05  # |dU| at an interpolated zero, relative to that at the neighbouring points, up to which it is accepted
JUMP = 3.0  # a change of dU larger than that expected from the slopes by this factor is a jump between two meshes
CLOSE = 0.1  # difference of log d below which no point is added between two others


@dataclass(frozen=True)
class Zero:
    """A point at which dU vanishes, with snapshots of the solutions on all meshes."""

    point: Point
    snapshots: tuple[Snapshot, ...]


@dataclass(frozen=True)
class Jump:
    """A change of sign without a zero: between two points dU jumps because the mesh changes."""

    left: Point
    right: Point

    @property
    def message(self) -> str:
        """Description for log and results."""
        a, b = self.left, self.right
        return (
            f"dU jumps from {a.dU:.2g} to {b.dU:.2g} between d = {a.d:.5g} and {b.d:.5g}, where the mesh changes: "
            "the sign of dU is uncertain by the mesh error there; a larger mesh.Np resolves it"
        )


@dataclass(frozen=True)
class Equilibrium:
    """An equilibrium distance, at which both particles have the same velocity.

    Attributes:
        d: The distance.
        slope: d(dU)/dd there; negative is stable.
        peak: Largest |dU| between this zero and the next one or the end, over that of the whole curve.
        d_error: Discretisation error of d.
        certain: Whether |dU| exceeds its error somewhere between this zero and the next ones, on both sides.
    """

    d: float
    slope: float
    peak: float
    d_error: float
    certain: bool

    @property
    def stable(self) -> bool:
        """Whether the pair returns to this distance after a small displacement."""
        return self.slope < 0


def interpolant(points: list[Point]) -> scipy.interpolate.CubicHermiteSpline:
    """Hermite interpolant of dU in log d from points in ascending d; scalar for a pair, otherwise one value per gap."""
    d = np.array([p.d for p in points])
    values, slopes = np.array([p.dUs for p in points]), np.array([p.slopes for p in points])
    if values.shape[1] == 1:
        values, slopes = values[:, 0], slopes[:, 0]
    return curve_interpolant(d, values, slopes)


def _bend(a: Point, b: Point) -> Array:
    """Estimated interpolation error of each dU between two points, shape (N-1,).

    It is half the difference at the mid-point of two parabolas in log d, each with the slope at one of the points.
    """
    width = np.log(b.d / a.d)
    return np.abs((a.slopes * a.d + b.slopes * b.d) * width / 4 - (b.dUs - a.dUs) / 2) / 2


def _wanted(points: list[Point], tol: float) -> float:
    """Tolerance of dU: tol times the largest |dU| of all points and gaps."""
    return max(tol * max(float(np.abs(p.dUs).max()) for p in points), ROUNDING)


def _excess(a: Point, b: Point, wanted: float) -> np.ndarray:
    """Gaps whose interpolation error exceeds the tolerance `wanted` and the error of dU, boolean, shape (N-1,)."""
    return np.asarray(_bend(a, b) > np.maximum(wanted, np.maximum(a.dU_errors, b.dU_errors)))


def _unresolved(points: list[Point], tol: float) -> list[tuple[Point, Point]]:
    """Neighbouring points between which a point should be added."""
    wanted = _wanted(points, tol)
    return [(a, b) for a, b in pairwise(points) if np.log(b.d / a.d) > CLOSE and _excess(a, b, wanted).any()]


def trace(
    branch: Branch, places: Sequence[tuple[float, ...]], tol: float, max_points: int
) -> Iterator[tuple[Point, bool]]:
    """Compute a curve at given distances, and refine it if all gaps of each point are equal.

    Args:
        branch: The branch, at any solution.
        places: Requested distances of each point, in the order in which they are solved.
        tol: Tolerance of dU between the points, relative to the largest |dU|.
        max_points: Largest number of points.

    Yields:
        Every point as it is computed, and whether it was requested.

    Raises:
        RunFailure: The branch could not be followed.
    """
    parameters = branch.fine.parameters
    points = []
    for place in places:
        points.append(branch.at(replace(parameters, gaps=place)))
        yield points[-1], True
    if not all(place and len(set(place)) == 1 for place in places):
        return
    points.sort(key=lambda p: p.d)
    known: set[tuple[float, float]] = set()
    while len(points) < max_points:
        new = [(a, b) for a, b in _unresolved(points, tol) if (a.d, b.d) not in known]
        if not new:
            break
        curve, wanted = interpolant(points), _wanted(points, tol)
        new = new[: max_points - len(points)]
        if abs(branch.fine.parameters.gaps[0] - new[-1][1].d) < abs(branch.fine.parameters.gaps[0] - new[0][0].d):
            new.reverse()  # start with the interval nearest to the present solution
        for a, b in new:
            d = float(np.sqrt(a.d * b.d))
            point = branch.at(parameters.with_gap(d))
            yield point, False
            # For a smooth curve halving an interval divides its error estimate by eight; if not, the estimate is
            # dominated by the difference between meshes, and refinement does not help.
            rough = np.maximum(_bend(a, point), _bend(point, b)) > _bend(a, b) / 2
            if rough[_excess(a, b, wanted)].all() or np.abs(point.dUs - curve(np.log(d))).max() < wanted:
                known |= {(a.d, d), (d, b.d)}
            points.append(point)
        points.sort(key=lambda p: p.d)


def find_zeros(branch: Branch, points: list[Point]) -> Iterator[Zero | Jump]:
    """Find the zeros and jumps at all changes of sign of dU between the points of a curve, in ascending d.

    Args:
        branch: The branch, at any solution.
        points: Points in ascending d.

    Raises:
        NoSteadyState: dU changes its sign smoothly but the zero was not found.
    """
    for a, b in pairwise(points):
        if a.dU * b.dU < 0 and max(abs(a.dU), abs(b.dU)) > ROUNDING:
            yield _zero_between(branch, a, b)


def _zero_between(branch: Branch, a: Point, b: Point) -> Zero | Jump:
    """The zero or the jump between two points at which dU has different signs.

    Raises:
        NoSteadyState: dU changes its sign smoothly but the zero was not found.
    """
    for _ in range(HALVINGS):
        roots = interpolant([a, b]).solve(0.0, extrapolate=False)
        middle = float(np.sqrt(a.d * b.d))
        with suppress(NoSteadyState, MeshFailure):
            return Zero(branch.zero(a.d, b.d, float(np.exp(roots[0])) if len(roots) else middle), branch.snapshots)
        point = branch.at(a.parameters.with_gap(middle))
        a, b = (a, point) if a.dU * point.dU < 0 else (point, b)
    if abs(b.dU - a.dU) < JUMP * max(abs(a.slopes[0]), abs(b.slopes[0])) * (b.d - a.d):
        # If the slope is close to rounding error (say 1e-9), Newton's method does not converge in d; the zero of the
        # interpolant is then accepted if |dU| is small there.
        roots = interpolant([a, b]).solve(0.0, extrapolate=False)
        point = branch.at(a.parameters.with_gap(float(np.exp(roots[0])) if len(roots) else middle))
        if abs(point.dU) < ALMOST * max(abs(a.dU), abs(b.dU)):
            return Zero(point, branch.snapshots)
        raise NoSteadyState(f"the zero of dU between d = {a.d:.5g} and {b.d:.5g} was not found")
    return Jump(a, b)


def equilibria(zeros: list[Zero], points: list[Point]) -> list[Equilibrium]:
    """Summary of the zeros of a curve.

    Args:
        zeros: Zeros in ascending d.
        points: Points of the curve in ascending d.
    """
    if not zeros:
        return []
    curve = interpolant(points)
    ends = [points[0].d, *(z.point.d for z in zeros), points[-1].d]
    peaks = []
    for a, b in pairwise(ends):
        between = np.abs(curve(np.linspace(np.log(a), np.log(b), 50)))  # may be larger than at any point
        peaks.append(max([float(between.max()), *(abs(p.dU) for p in points if a <= p.d <= b)]))
    result = []
    for before, zero, end, peak in zip(ends, (z.point for z in zeros), ends[2:], peaks[1:], strict=False):
        left, right = ([p for p in points if a <= p.d <= b] for a, b in ((before, zero.d), (zero.d, end)))
        slope = zero.slope_at_rest
        error = float(zero.dU_errors[0]) / abs(slope)
        certain = all(any(abs(p.dU) > p.dU_errors[0] for p in side) for side in (left, right))
        result.append(Equilibrium(zero.d, slope, peak / max(peaks), error, certain))
    return result
