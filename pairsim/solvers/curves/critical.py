"""Critical distances: the zeros of dU(d), at one value of a parameter or followed over many."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator

import numpy as np

from pairsim.runtime.message import Message
from pairsim.runtime.others import NOBODY, Others
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.curves.curve import Distances, EarlyZeros, Zero, find_zeros, trace
from pairsim.solvers.curves.equilibrium_lines import Critical, EndOfLine, Follower, Missed, Region
from pairsim.solvers.curves.point import Point
from pairsim.solvers.steady.continuation import where
from pairsim.solvers.steady.ends import Ended

# All constants were chosen.
SCAN_POINTS = 9  # of the curve dU(d) that is searched for zeros
SCAN_TOL = 0.02  # its tolerance relative to the largest |dU|
# Relative difference of distances below which two zeros with slopes of the same sign are taken to be one zero that was
# found on two meshes: between two different zeros with slopes of one sign there is one with the opposite sign.
SAME = 0.1

type Finding = Point | Critical | Missed | EndOfLine | Ended
"""Results of a search for critical distances. A `Point` belongs to a curve that is searched for zeros; an `Ended` is
the last result, and gives the reason why there are no more."""


type Helpers = Others[Distances, Point | Ended]
"""Other processes that solve for points of a curve that is searched for zeros."""


def search(
    branch: Branch, least: float, most: float, others: Helpers = NOBODY
) -> Generator[Point, None, list[Zero] | Ended]:
    """Find all zeros of dU between two distances at the present values of the other parameters.

    Args:
        branch: The branch, at any distance.
        least: Smallest distance [D_c].
        most: Largest distance [D_c].
        others: Other processes, which solve for some points of the curve.

    Yields:
        Every point of the curve.

    Returns:
        The zeros in ascending d, or the reason why a continuation has stopped.

    Raises:
        RunFailure: The curve could not be computed.
    """
    places = [(float(d),) for d in np.geomspace(most, least, SCAN_POINTS)]
    points, early = list[Point](), EarlyZeros()
    for traced in trace(branch, places, SCAN_TOL, 10 * SCAN_POINTS, others, early):
        if isinstance(traced, Ended):
            return traced
        points.append(traced[0])
        yield traced[0]
    zeros: list[Zero] = []
    for zero in find_zeros(branch, sorted(points, key=lambda p: p.d), early):
        if isinstance(zero, Ended):
            return zero
        zeros.append(zero)
    return zeros


def find_all(branch: Branch, least: float, most: float, others: Helpers = NOBODY) -> Iterator[Finding]:
    """Find all critical distances between two distances at the present parameters; arguments as for `search`.

    Raises:
        RunFailure: The curve that is searched for zeros could not be computed.
    """
    zeros = yield from search(branch, least, most, others)
    if isinstance(zeros, Ended):
        yield zeros
        return
    for number, zero in enumerate(zeros, start=1):
        yield Critical(zero.point, number, "wanted")


def follow_all(
    branch: Branch, region: Region, others_at: Callable[[float], Helpers] = lambda _: NOBODY
) -> Iterator[Finding]:
    """Follow all lines of critical distances that contain a zero at the first or the last value of the parameter.

    Args:
        branch: The branch, at the first value of the parameter and the largest distance.
        region: Range of parameter and distance.
        others_at: Returns the other processes that solve for some points of the curve at a value of the parameter.

    Raises:
        RunFailure: A curve that is searched for zeros could not be computed.
    """
    seen: list[Critical] = []
    follower = Follower(branch, region)
    count = 0
    for value, forward in ((region.values[0], 1.0), (region.values[-1], -1.0)):
        first = branch.at(region.parameter.at(value, branch.solver.parameters.with_gap(region.most)))
        if isinstance(first, Ended):
            yield first
            return
        zeros = yield from search(branch, region.least, region.most, others_at(value))
        if isinstance(zeros, Ended):
            yield zeros
            return
        for zero in zeros:
            if any(same_zero(zero.point, c.point) for c in seen):
                continue
            count += 1
            for found in follower.follow(count, zero, forward):
                if isinstance(found, Critical):
                    met = next((c for c in seen if c.branch != count and same_zero(found.point, c.point)), None)
                    if met is not None:
                        message = Message("branch {} is met at {}", met.branch, where(met.point.parameters))
                        yield EndOfLine(count, "met", message)
                        break
                    seen.append(found)
                yield found
        if len(region.values) == 1:
            break


def same_zero(a: Point, b: Point) -> bool:
    """Whether two points are the same zero of dU, possibly found on different meshes."""
    p, q = a.parameters, b.parameters
    return (
        abs(a.d / b.d - 1) < SAME
        and a.slopes[0] * b.slopes[0] > 0
        and bool(np.isclose(p.followed, q.followed, rtol=1e-6))
    )
