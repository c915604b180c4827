"""Whether the goals of a case were computed to its `accuracy`: the entry of run.json, and warnings if not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import Self

import numpy as np

from pairsim.cases.case import SceneCase
from pairsim.computing.branch_report import BranchReport
from pairsim.computing.warnings import ErrorAt, above
from pairsim.quantities.text import in_unit
from pairsim.runtime.arrays import Array
from pairsim.runtime.message import Message, Said, Text
from pairsim.solvers.curves.interpolant import NEGLIGIBLE_DU
from pairsim.solvers.curves.point import Point
from pairsim.solvers.goals import Goal, Scale
from pairsim.solvers.steady.continuation import each_of

MOST_NAMED = 5  # largest number of places that a warning names


def adaptation_report(
    case: SceneCase,
    goals: Sequence[Goal],
    report: BranchReport,
    points: Sequence[Point],
    largest: Mapping[Goal, float],
) -> tuple[dict[str, Said], list[Text]]:
    """The entry of run.json, and for each goal a warning of the points whose errors are larger than wanted.

    Args:
        case: The case.
        goals: The goals of the case.
        report: The report of its branch, with the largest values of goals.
        points: The points that must meet `accuracy`.
        largest: Largest values of goals that are known better than those in the report, and replace them.
    """
    known = [goal for goal in goals if all(point.estimate[goal].half_width.size for point in points)]
    found = [_Accuracy.of(case, report, goal, points, largest.get(goal)) for goal in known]
    reached = {each.goal.name: each.reached for each in found}
    worst = max(reached.values(), default=0.0)
    arrested = [Message.joined(", ", at.where) for each in found for at in each.arrested]
    entry: dict[str, Said] = {
        "wanted": case.error_wanted,
        **({"reached": worst, "kept": worst <= case.error_wanted} if points else {}),
        **({"reached_by": reached} if points and len(found) > 1 else {}),
        **({"held_together": arrested} if arrested else {}),
        "meshes": [
            {**_mesh_is_for(place, case), "unknowns": n, "rounds": report.rounds.get(place, 0)}
            for place, n in sorted(report.unknowns.items())
        ],
        **{f"reference_{each.goal.name}": each.size for each in found if points and each.size is not None},
    }
    return entry, [warning for each in found for warning in each.warnings(case)]


def _mesh_is_for(place: Sequence[float], case: SceneCase) -> dict[str, float | list[float]]:
    """Entry for a mesh: the distances that it is made for, or the Ca_e of a single particle."""
    return {"d" if case.n > 1 else "Ca_e": place[0] if len(set(place)) == 1 else list(place)}


@dataclass(frozen=True)
class _Accuracy:
    """How well a goal meets the accuracy.

    Attributes:
        goal: The goal.
        size: The value that errors are relative to if it is the same for all points, else None.
        what: What errors are relative to, in words.
        errors: The largest error of the goal at each point that is not in `arrested`.
        arrested: The same at points where unyielded liquid arrests the particles and the goal is creep: no mesh makes
            it more exact, and the answer says what it is.
    """

    goal: Goal
    size: float | None
    what: str
    errors: list[ErrorAt]
    arrested: list[ErrorAt]

    @classmethod
    def of(
        cls, case: SceneCase, report: BranchReport, goal: Goal, points: Sequence[Point], largest: float | None
    ) -> Self:
        """The accuracy of a goal at points."""
        size = None
        match goal.scale:
            case Scale.DISTANCE:
                sizes = [np.asarray(abs(point.slope_at_rest) * point.d) for point in points]
                what = "itself, that of a critical distance"
            case Scale.ITSELF:
                sizes, what = [np.abs(point.values[goal]) for point in points], goal.name
            case Scale.LARGEST:
                size = report.largest[goal] if largest is None else largest
                sizes = [np.asarray(size)] * len(points)
                looked_for = goal.looked_for_with(case.fixed_cells)
                whole = f"the largest |{goal.name}|" if looked_for or len(points) > 1 else f"|{goal.name}|"
                what = f"{whole} ({in_unit(case.scales, goal.kind, size, digits=3)})"
        known = [(point, error_at(point, goal, each)) for point, each in zip(points, sizes, strict=True)]
        errors, arrested = (
            [at for point, at in known if at is not None and (goal.creeps and point.arrested) == is_arrested]
            for is_arrested in (False, True)
        )
        return cls(goal, size, what, errors, arrested)

    @property
    def reached(self) -> float:
        """The largest error, relative to the size of the goal."""
        return max((each.relative for each in (*self.errors, *self.arrested)), default=0.0)

    def warnings(self, case: SceneCase) -> Iterator[Message]:
        """Yield a warning of the points whose errors are larger than `accuracy`."""
        missed = [each.where for each in self.errors if each.relative > case.error_wanted]
        if not missed:
            return
        widest = max(self.errors, key=lambda each: each.relative)
        more = f" and {len(missed) - MOST_NAMED} more" if len(missed) > MOST_NAMED else ""
        at = Message(" at {}{}", listed(missed[:MOST_NAMED]), more) if any(missed) else ""
        fixed = " and ".join(f"mesh.{name}" for name in sorted(case.fixed_cells))
        other = widest.no_mesh_helps(case)
        advice = f"; use {other}" if other else f"; leave out {fixed}" if fixed else ""
        percent = above(100 * widest.relative, 100 * case.error_wanted)
        said = "accuracy: {} was not kept{}: {} is up to {} % of {}{}"
        yield Message(said, case.accuracy, at, self.goal.error_column, percent, self.what, advice)


def error_at(point: Point, goal: Goal, size: Array | float) -> ErrorAt | None:
    """The largest estimated error of a goal at a point, relative to a size; None where the size is no more than 0."""
    estimate, sizes = point.estimate[goal], np.broadcast_to(size, point.estimate[goal].half_width.shape)
    parts = np.divide(estimate.half_width, sizes, out=np.full(sizes.shape, -1.0), where=sizes > NEGLIGIBLE_DU)
    if not (parts >= 0).any():
        return None
    at = int(parts.argmax())
    parts_by = (float(each[at] / sizes[at]) for each in (estimate.ends_error, estimate.regularisation_error))
    return ErrorAt(float(parts[at]), each_of(point.parameters), *parts_by)


def listed(places: Sequence[Sequence[Text]]) -> Message:
    """Places in words, such as "De = 1, d = 0.1; d = 0.2".

    The leading parameters that all places have in common are named at the first place only.

    Args:
        places: The parameters of each, such as "De = 1" and "d = 0.1".
    """
    same = sum(1 for _ in takewhile(lambda each: len(set(each)) == 1, zip(*places, strict=False)))
    first, *others = places
    return Message.joined("; ", (Message.joined(", ", place) for place in (first, *(each[same:] for each in others))))
