"""Lines of zeros of dU(d) as a parameter varies, by pseudo-arclength continuation through folds.

In the plane of log d and the logarithm of the parameter, dU = 0 is a curve. The predictor follows its tangent; the
corrector moves at right angles to the tangent, and the zero on this line is solved for together with the scene.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy

from pairsim.physics.liquids import Liquid
from pairsim.physics.solids import Solid
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.runtime.message import Message, Text
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.curves.curve import Zero
from pairsim.solvers.curves.point import Point
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.continuation import prepared, reach, where
from pairsim.solvers.steady.scene import Snapshot

Kind = Literal["wanted", "added", "vanishes", "edge"]

# Steps of the arc length; chosen.
FIRST = 0.1
LONGEST = 0.4
SHORTEST = 1e-3
FEW_ITERATIONS = 3  # Newton iterations up to which the step grows; chosen
MOST_STEPS = 400  # on one line of zeros; chosen


@dataclass(frozen=True)
class Followed:
    """The parameter over which zeros are followed: a positive number on which liquid and solids depend.

    Attributes:
        materials: Returns the liquid and the particles' solids at a value of the parameter.
    """

    materials: Callable[[float], tuple[Liquid, tuple[Solid | None, ...]]]

    def at(self, value: float, parameters: Parameters) -> Parameters:
        """Parameters with the materials at a value."""
        liquid, solids = self.materials(value)
        return replace(parameters, liquid=liquid, solids=solids, followed=value)


@dataclass(frozen=True)
class Region:
    """Range of parameter and distance in which critical distances are computed.

    Attributes:
        parameter: The parameter that varies.
        values: Values of the parameter at which critical distances are requested, ascending.
        least: Smallest distance [D_c].
        most: Largest distance [D_c].
    """

    parameter: Followed
    values: tuple[float, ...]
    least: float
    most: float


@dataclass(frozen=True)
class Critical:
    """A critical distance.

    Attributes:
        point: The solution.
        branch: Number of the line of zeros.
        kind: "wanted": at a requested value; "added": between requested values; "vanishes": at a fold, where a stable
            and an unstable zero meet and end; "edge": at the smallest or largest distance.
        by_parameter: At a fold, the derivative of dU with respect to the parameter, from which the error of the
            parameter follows; None elsewhere.
    """

    point: Point
    branch: int
    kind: Kind
    by_parameter: float | None = None


@dataclass(frozen=True)
class EndOfLine:
    """The end of a line of critical distances.

    Attributes:
        branch: Number of the line.
        reason: "range": the last requested value of the parameter is passed; "edge": as for `Critical`; "met": it has
            reached a zero of a line that was followed before; "lost": no further zero was found.
        message: Description for log and results.
    """

    branch: int
    reason: str
    message: Message


@dataclass(frozen=True)
class Missed:
    """A critical distance that must exist but was not found; the message is for log and results."""

    message: Message


@dataclass(frozen=True)
class _Pose:
    """A point on a line of zeros in the plane of x = log d and q, the logarithm of the parameter.

    Attributes:
        here: Coordinates x and q, shape (2,).
        tangent: Unit tangent of the line, shape (2,).
        rows: Derivatives dy/dx and dy/dq, shape (2, n_y).
        snapshot: The solution.
    """

    here: Array
    tangent: Array
    rows: Array
    snapshot: Snapshot


class Follower:
    """Continuation of zeros of dU in one parameter.

    Args:
        branch: The branch, at any solution.
        region: Range of parameter and distance.
    """

    def __init__(self, branch: Branch, region: Region) -> None:
        self.branch, self.parameter, self.values = branch, region.parameter, np.log(region.values)
        self._exact = dict(zip(self.values.tolist(), region.values, strict=True))
        self.least, self.most = np.log(region.least), np.log(region.most)

    def _place(self, x: float, q: float) -> Parameters:
        value = self._exact.get(float(q), float(np.exp(q)))
        return self.parameter.at(value, self.branch.solver.parameters.with_gap(float(np.exp(x))))

    def _line(self, at: Array, direction: Array) -> Callable[[float], Parameters]:
        return lambda tau: self._place(*(at + tau * direction))

    def _here(self) -> Array:
        parameters = self.branch.solver.parameters
        return np.log([parameters.gaps[0], parameters.followed])

    def _pose(self, onwards: Array) -> _Pose:
        """The present zero, with the tangent oriented along `onwards`, shape (2,): their product is not negative."""
        scene = self.branch.solver
        at, here = scene.linearise(), self._here()
        rows = np.array([at.tangent(self._line(here, direction)) for direction in np.eye(2)])
        gradient = rows @ scene.velocity_row()
        tangent = np.array([gradient[1], -gradient[0]]) / np.linalg.norm(gradient)
        return _Pose(here, -tangent if tangent @ onwards < 0 else tangent, rows, self.branch.solver.snapshot)

    def follow(self, number: int, start: Zero, forward: float) -> Iterator[Critical | Missed | EndOfLine]:
        """Follow one zero until it leaves the range of the parameter or of the distance.

        Args:
            number: Number of this line of zeros.
            start: The zero to start from.
            forward: 1 towards larger values of the parameter, -1 towards smaller ones.

        Yields:
            Critical distances, those that were missed, and at last the end of the line.

        Raises:
            NoSteadyState: The matrix is singular at a zero.
        """
        self.branch.return_to(start.point, start.snapshot)
        yield Critical(start.point, number, "wanted")
        pose, step = self._pose(np.array([0.0, forward])), FIRST
        for _ in range(MOST_STEPS):
            change, scene = pose.tangent @ pose.rows, self.branch.solver
            step = min(step, reach(scene, change, np.array([scene.parameters.gaps[0] * pose.tangent[0]])))
            taken = self._step(number, pose, change, step)
            if isinstance(taken, EndOfLine):
                yield taken
                return
            point, kind, step = taken
            try:
                before, pose = pose, self._pose(pose.tangent)
            except NoSteadyState:
                yield Critical(point, number, kind)
                raise
            if pose.tangent[1] * before.tangent[1] < 0:
                yield from self._fold(number, before, pose)
            if kind == "wanted" and (better := self.branch.improved(point)) is not point:
                point, pose = better, self._pose(pose.tangent)
            yield Critical(point, number, kind)
            if kind == "edge":
                message = Message("the smallest or largest distance is reached at {}", where(scene.parameters))
                yield EndOfLine(number, "edge", message)
                return
        last = where(self.branch.solver.parameters)
        message = Message("the line of zeros has not ended after {} steps, at {}", MOST_STEPS, last)
        yield EndOfLine(number, "lost", message)

    def _step(self, number: int, pose: _Pose, change: Array, step: float) -> EndOfLine | tuple[Point, Kind, float]:
        """Take one step from a zero, with `change` the derivative of y along the tangent, shape (n_y,).

        Returns:
            The end of the line, or the new point with its kind and the length of the next step.
        """
        branch, scene, here, tangent = self.branch, self.branch.solver, pose.here, pose.tangent
        ahead = self.values[(self.values - here[1]) * np.sign(tangent[1]) > 1e-9]
        if not len(ahead):
            return EndOfLine(number, "range", Message("the last value is reached at {}", where(scene.parameters)))
        wanted = ahead[np.argmin(np.abs(ahead - here[1]))]
        edge = self.most if tangent[0] > 0 else self.least
        kind: Kind
        while True:
            length, line, kind, q = step, np.array([-tangent[1], tangent[0]]), "added", None
            if abs(tangent[1]) > 0.2 and abs(wanted - here[1]) <= 1.2 * length * abs(tangent[1]):
                length, line, kind, q = (wanted - here[1]) / tangent[1], np.array([1.0, 0.0]), "wanted", wanted
            if abs(tangent[0]) > 1e-3 and (edge - here[0]) / tangent[0] < length:
                length, line, kind, q = (edge - here[0]) / tangent[0], np.array([0.0, 1.0]), "edge", None
            at = here + length * tangent
            at[1] = at[1] if q is None else q
            why: Text = "Newton's method found no zero"
            before, iterations = branch.solver.snapshot, scene.iterations
            try:
                guess = prepared(scene, self._place(*at), scene.y + length * change)
                point = branch.zero_on(self._line(at, line), 0.0, guess, settled=kind == "wanted")
            except (MeshFailure, NoSteadyState) as failure:
                point, why = None, failure.message
            if point is not None and np.linalg.norm(self._here() - at) < max(length, 0.02):
                if kind != "wanted" and (landed := self._landed(here, change, before)) is not None:
                    point, kind = landed, "wanted"
                easy = scene.iterations - iterations <= FEW_ITERATIONS
                return point, kind, min(LONGEST, step * 1.5) if easy else step
            branch.recall(before)
            step = length / 3
            if step < SHORTEST:
                message = Message("the zero was not found beyond {}: {}", where(scene.parameters), why)
                return EndOfLine(number, "lost", message)

    def _landed(self, here: Array, change: Array, before: Snapshot) -> Point | None:
        """The critical distance at the first requested value that a step from `here` has passed; None if there is none.

        It is needed where the distance changes much faster than the parameter, as steps do not end at requested values
        there.
        """
        there, onwards = self._here(), self.branch.solver.snapshot
        passed = self.values[(self.values - here[1]) * (there[1] - self.values) > 0]
        passed = passed[np.abs(passed - here[1]) > 1e-9]
        if not len(passed):
            return None
        wanted = passed[np.argmin(np.abs(passed - here[1]))]
        part = float((wanted - here[1]) / (there[1] - here[1]))
        at, length = here + part * (there - here), float(np.linalg.norm(there - here))
        at[1] = wanted
        point = self._from(before, part * length * change, at, "wanted")
        if point is None or abs(self._here()[0] - at[0]) > max(length, 0.02):
            self.branch.recall(onwards)
            return None
        return point

    def _fold(self, number: int, before: _Pose, after: _Pose) -> Iterator[Critical | Missed]:
        """Critical distances between two points on opposite sides of a fold, in the order of the line.

        These are the fold itself, at which two zeros meet, and the zeros at requested values between the points and the
        fold: the line passes each of these values twice.
        """
        length, sign = float(np.linalg.norm(after.here - before.here)), np.sign(before.tangent[1])
        way = scipy.interpolate.CubicHermiteSpline(
            [0.0, length], [before.here, after.here], [before.tangent, after.tangent]
        )
        along = np.linspace(0, length, 401)
        q = way(along)[:, 1] * sign
        top = int(np.argmax(q))
        fold = way(along[top])
        vanishes = self._beside(after, fold, "vanishes", length)
        by_parameter = None if vanishes is None else self._by_parameter()
        sides = (before, slice(top + 1)), (after, slice(None, top - 1 if top else None, -1))
        if vanishes is None:
            near = where(self._place(*fold))
            yield Missed(Message("the fold at which two zeros meet, near {}, was not found", near))
        ahead: list[Critical] = []
        back = [] if vanishes is None else [Critical(vanishes, number, "vanishes", by_parameter)]
        for found, (start, part) in zip((ahead, back), sides, strict=True):
            for value in sorted(self.values, key=lambda v: v * sign, reverse=found is back):
                if not q[part][0] + 1e-9 < value * sign < q[top]:
                    continue
                at = np.array([way(float(np.interp(value * sign, q[part], along[part])))[0], value])
                point = self._beside(start, at, "wanted", length)
                # Newton's method may converge to the zero on the other side of the fold.
                if point is not None and (np.log(point.d) - fold[0]) * (at[0] - fold[0]) > 0:
                    found.append(Critical(point, number, "wanted"))
                else:
                    there = where(self._place(*at))
                    yield Missed(Message("d_cr at {}, next to the fold of two zeros, was not found", there))
        self.branch.recall(after.snapshot)
        yield from (*ahead, *back)

    def _by_parameter(self) -> float:
        """Derivative of dU with respect to the parameter at the present zero."""
        scene, here = self.branch.solver, self._here()
        change = scene.linearise().tangent(self._line(here, np.array([0.0, 1.0])))
        return float(change @ scene.velocity_row() / np.exp(here[1]))

    def _beside(self, start: _Pose, at: Array, kind: Kind, most: float) -> Point | None:
        """The zero near `at`, found from the zero `start`; None if none is found within a distance `most` from `at`."""
        point = self._from(start.snapshot, (at - start.here) @ start.rows, at, kind)
        return point if point is not None and np.linalg.norm(self._here() - at) < max(most, 0.02) else None

    def _from(self, snapshot: Snapshot, change: Array, at: Array, kind: Kind) -> Point | None:
        """The zero at the parameter of `at` or, for a fold, at its distance, found from a stored solution.

        Args:
            snapshot: The stored solution.
            change: Change of its free unknowns for a first guess, shape (n_y,).
            at: Logarithms of distance and parameter near the zero, shape (2,).
            kind: The kind of critical distance.

        Returns:
            The zero; None if it is not found.
        """
        self.branch.recall(snapshot)
        line = np.array([1.0, 0.0] if kind == "wanted" else [0.0, 1.0])
        with suppress(MeshFailure, NoSteadyState):
            guess = prepared(self.branch.solver, self._place(*at), self.branch.solver.y + change)
            return self.branch.zero_on(self._line(at, line), 0.0, guess, settled=kind == "wanted")
        return None
