"""Master curves dU(d): quasi-steady solutions at many distances, adaptive refinement, and zeros."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.runtime.others import NOBODY, Others, found_by_all
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.curves.distances import between
from pairsim.solvers.curves.interpolant import NEGLIGIBLE_DU, CurveInterpolant
from pairsim.solvers.curves.point import Point
from pairsim.solvers.steady.ends import Ended
from pairsim.solvers.steady.scene import Snapshot

# All constants were chosen.
HALVINGS = 5  # bisections of an interval with a change of sign in which Newton's method finds no zero
CLOSE = 0.1  # difference of log d below which no point is added between two others: differences of meshes would show

type Distances = tuple[float, ...]
"""Distances of a point [D_c], N-1 values."""


@dataclass(frozen=True)
class Zero:
    """A distance at which dU vanishes.

    Attributes:
        point: A point at the zero or close to it.
        snapshot: The solution at this point.
        d: The distance of the zero [D_c].
    """

    point: Point
    snapshot: Snapshot
    d: float


@dataclass(frozen=True)
class Equilibrium:
    """An equilibrium distance, at which both particles have the same velocity.

    Attributes:
        d: The distance [D_c].
        slope: d(dU)/dd there; negative for a stable equilibrium.
        peak: Largest |dU| between this zero and the next larger one, or the last point, over that of the whole curve.
        d_error: Half-width of the interval of d [D_c].
        certain: Whether |dU| exceeds its half-width somewhere on both sides, between this zero and the next ones.
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


def interpolants(points: Sequence[Point]) -> list[CurveInterpolant]:
    """dU of each gap as a function of d, from at least two points in ascending d."""
    d = np.array([p.d for p in points])
    columns = [
        np.array(values).T
        for values in zip(*((p.dUs, p.discrete.dU, p.slopes, p.dU_errors) for p in points), strict=True)
    ]
    return [CurveInterpolant(d, *values) for values in zip(*columns, strict=True)]


def _unresolved(points: list[Point], tol: float) -> list[tuple[Point, Point]]:
    """Neighbouring points between which a point should be added.

    The half-width between them exceeds both `tol` times the largest |dU| and twice the half-width at the points, for
    some gap.
    """
    if len(points) < 2:
        return []
    wanted = max(tol * max(float(np.abs(p.dUs).max()) for p in points), NEGLIGIBLE_DU)
    errors = np.array([curve.errors for curve in interpolants(points)]).T
    known = [np.maximum(a.dU_errors, b.dU_errors) for a, b in pairwise(points)]
    return [
        (a, b)
        for (a, b), error, at_points in zip(pairwise(points), errors, known, strict=True)
        if np.any(error > np.maximum(wanted - at_points, at_points))
        and (np.log(b.d / a.d) > CLOSE or np.isinf(error).any())
    ]


def trace(
    branch: Branch,
    places: Sequence[Distances],
    tol: float,
    max_points: int,
    others: Others[Distances, Point | Ended] = NOBODY,
    early: EarlyZeros | None = None,
) -> Iterator[tuple[Point, bool] | Ended]:
    """Compute a curve at given distances, and add others if all gaps of each point are equal, or a single one varies.

    Points are added until no neighbours are more than a factor `WIDEST` apart, and the half-width of dU between them is
    small enough, or no more than twice that at the points. The places of added points follow from the points of all
    processes.

    Args:
        branch: The branch, at any solution.
        places: Requested distances of each point, in the order in which they are solved; ascending or descending if all
            gaps of each point are equal, or a single one varies.
        tol: Half-width of dU between the points, relative to the largest |dU|.
        max_points: Largest number of points, unless more are requested.
        others: Other processes, which solve for some of the points.
        early: Collects zeros that are found while other processes are at work; None to look for none.

    Yields:
        Every point as it is computed, and whether it was requested; at last, if a continuation has stopped, the reason.

    Raises:
        RunFailure: A point could not be computed.
    """
    parameters, requested = branch.solver.parameters, set(places)
    curve = parameters.varied is not None or all(place and len(set(place)) == 1 for place in places)
    points = list[Point]()
    filled = between(places, max_points) if curve else places

    def meanwhile(missing: Collection[Distances]) -> bool:
        return early is not None and curve and early.search(branch, points, [place[at] for place in missing])

    at = parameters.varied or 0

    def solve(place: Distances) -> Point | Ended:
        return branch.at(replace(parameters, gaps=place))

    for place, point in found_by_all(filled, solve, others, meanwhile, in_order=not curve):
        if isinstance(point, Ended):
            yield point
            return
        points.append(point)
        yield point, place in requested
    if not curve:
        return
    points.sort(key=lambda p: p.d)
    while new := _unresolved(points, tol)[: max(max_points - len(points), 0)]:
        here = branch.solver.parameters.gaps[at]
        if abs(here - new[-1][1].d) < abs(here - new[0][0].d):
            new.reverse()  # start with the interval nearest to the present solution
        added = [parameters.with_gap(float(np.sqrt(a.d * b.d))).gaps for a, b in new]
        for _, point in found_by_all(added, solve, others, meanwhile):
            if isinstance(point, Ended):
                yield point
                return
            points.append(point)
            yield point, False
        points.sort(key=lambda p: p.d)


def find_zeros(branch: Branch, points: list[Point], known: Sequence[Zero] = ()) -> Iterator[Zero | Ended]:
    """Find a zero wherever dU changes its sign between two neighbouring points of a curve, in ascending d.

    There may be none where the signs of both points are uncertain.

    Args:
        branch: The branch, at any solution.
        points: Points in ascending d.
        known: Zeros that were found before, such as `EarlyZeros`.

    Yields:
        The zeros; at last, if a continuation has stopped, the reason.
    """
    for a, b in pairwise(points):
        if _changes_sign(a, b):
            found = next((zero for zero in known if a.d <= zero.d <= b.d), None) or _zero_between(branch, a, b)
            if found is not None:
                yield found
            if isinstance(found, Ended):
                return


class EarlyZeros(list[Zero]):
    """Zeros found before all points of a curve are known, each between two points that will stay neighbours."""

    def __init__(self) -> None:
        self._searched = set[tuple[float, float]]()

    def search(self, branch: Branch, points: Sequence[Point], missing: Sequence[float]) -> bool:
        """Look for one zero; returns whether there were two points between which to look.

        Args:
            branch: The branch, at any solution.
            points: Points so far.
            missing: Distances of points that are still to come [D_c].
        """
        for a, b in pairwise(sorted(points, key=lambda point: point.d)):
            new = (a.d, b.d) not in self._searched and not any(a.d < d < b.d for d in missing)
            if new and _changes_sign(a, b):
                self._searched.add((a.d, b.d))
                found = _zero_between(branch, a, b)
                if isinstance(found, Zero):
                    self.append(found)
                return True
        return False


def _changes_sign(a: Point, b: Point) -> bool:
    return a.dU * b.dU < 0 and max(abs(a.dU), abs(b.dU)) > NEGLIGIBLE_DU


def _zero_between(branch: Branch, a: Point, b: Point) -> Zero | Ended | None:
    """The zero between two points at which dU has different signs.

    Newton's method finds none where dU jumps between two meshes, or where the slope of dU is mere rounding error. The
    zero is then taken at the point whose interval of dU contains 0 or comes nearest to it. It is None where the
    intervals of both points contain 0.
    """
    secant = (b.dU - a.dU) / (b.d - a.d)
    for _ in range(HALVINGS):
        with suppress(NoSteadyState, MeshFailure):
            if (zero := branch.zero(a.d, b.d, _guess(a, b))) is not None:
                d = zero.d - float(zero.held_dUs[0]) / float(zero.slopes[0])
                return Zero(zero, branch.solver.snapshot, d)
        certain = [abs(point.dU) >= point.dU_errors[0] for point in (a, b)]
        if not any(certain):
            return None
        if not all(certain):
            break
        with suppress(NoSteadyState, MeshFailure):
            point = branch.at(a.parameters.with_gap(float(np.sqrt(a.d * b.d))))
            if not isinstance(point, Ended):
                a, b = (a, point) if a.dU * point.dU < 0 else (point, b)
    candidates = [a, b]
    with suppress(NoSteadyState, MeshFailure):
        point = branch.at(a.parameters.with_gap(_guess(a, b)))
        candidates += [] if isinstance(point, Ended) else [point]
    nearest = min(candidates, key=lambda point: abs(point.dU) - point.dU_errors[0])
    if nearest is not candidates[-1]:
        again = branch.at(nearest.parameters)
        if isinstance(again, Ended):
            return again
        nearest = again
    if nearest.slope_at_rest * secant < 0:
        nearest = replace(nearest, slopes=np.array([secant]))
    return Zero(nearest, branch.solver.snapshot, nearest.d)


def _guess(a: Point, b: Point) -> float:
    """The zero of the interpolant between two points at which dU has different signs."""
    return interpolants([a, b])[0].zero(a.d, b.d)


def equilibria(zeros: list[Zero], points: list[Point]) -> list[Equilibrium]:
    """Summary of the zeros of a curve.

    Args:
        zeros: Zeros in ascending d.
        points: Points of the curve in ascending d.
    """
    if not zeros:
        return []
    d, dU, half = interpolants(points)[0].samples
    ends = [points[0].d, *(zero.d for zero in zeros), points[-1].d]
    sides = [(a <= d) & (d <= b) for a, b in pairwise(ends)]
    peaks = [float(np.abs(dU[side]).max(initial=0.0)) for side in sides]
    decided = [bool((np.abs(dU) > half)[side].any()) for side in sides]
    result = []
    for i, zero in enumerate(zeros):
        slope, error = zero.point.slope_at_rest, zero.point.zero_error
        certain = decided[i] and decided[i + 1]
        result.append(Equilibrium(zero.d, slope, peaks[i + 1] / max(peaks), error, certain))
    return result
