"""Quasi-steady solutions of a command: their branch, rows of tables, and what run.json says of them at the end."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import Any, Self

import numpy as np

from pairsim.cases.case import SceneCase
from pairsim.computing.events import Event, Outcome, Summary, Table
from pairsim.computing.warnings import ErrorAt, above, common_warnings, moves_on
from pairsim.quantities.kinds import LENGTH
from pairsim.quantities.text import in_unit
from pairsim.results.columns import CURVE_HEALTH, POLYMER_HEALTH, YIELD_HEALTH, names_of, observed, table_row
from pairsim.runtime.arrays import Array
from pairsim.runtime.message import Message, Text
from pairsim.solvers.curves.adaptation import AdaptiveBranch
from pairsim.solvers.curves.branch import Branch, Point
from pairsim.solvers.curves.curve import ROUNDING
from pairsim.solvers.errors.estimate import ErrorEstimate
from pairsim.solvers.goals import Goal, Scale, dU
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.continuation import each_of
from pairsim.solvers.steady.ends import Ended, Passed, SpentOnTheWay
from pairsim.solvers.steady.first_solution import first_scene, scene_past_end

MOST_NAMED = 5  # distances that a warning names


class Solutions:
    """The quasi-steady solutions of a case, on a branch that is closed at the end of the context.

    Attributes:
        points: The solutions that are results.
        branch: The branch; None until `begin`.
        ended: The continuation that has ended the computation; None where all was solved. If it is proven that there is
            no steady state, the context ends without an exception: `outcome` is the answer.
        way: The solutions on the way to parameters that were not reached.
    """

    def __init__(self, case: SceneCase) -> None:
        self.case, self.points = case, list[Point]()
        self.ended: Ended | None = None
        self.way: Sequence[Passed] = ()
        self.branch: AdaptiveBranch | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, failure: BaseException | None, *_: object) -> bool:
        ended = self.branch.ended if self.branch is not None else self.ended
        self.ended = ended if ended is not None and ended.failure is failure else None
        if self.ended is not None:
            self.way = self.ended.way
        elif isinstance(failure, SpentOnTheWay):
            self.way = failure.way
        if self.branch is not None:
            self.branch.close()
        return self.ended is not None and self.ended.proven

    @property
    def outcome(self) -> Outcome:
        """The outcome where it is proven that there is no steady state."""
        assert self.ended is not None, "a branch has ended"
        return Outcome("finished", self.ended.failure.reason, self.ended.failure.message)

    def begin(
        self,
        problem: SteadyProblem,
        first: Parameters,
        *,
        goals: Sequence[Goal],
        places: Sequence[tuple[float, ...]] = (),
        sensitivities: Collection[str] = (),
    ) -> AdaptiveBranch:
        """Solve at the first parameters, with cells that follow from the `accuracy` of the goals.

        Keywords are those of `AdaptiveBranch`.

        Raises:
            NoSteadyState: No solution was found.
            MeshFailure: A mesh could not be generated.
        """
        scene = first_scene(problem, first)
        if isinstance(scene, Ended) and scene.kind and not first.gaps:
            scene = scene_past_end(problem, first, scene)
        if isinstance(scene, Ended):
            self.ended = scene
            raise scene.failure
        wanted, held = self.case.error_wanted, self.case.held
        self.branch = AdaptiveBranch(scene, sensitivities, goals=goals, wanted=wanted, places=places, held=held)
        return self.branch

    def last_events(self, entries: Mapping[str, Any], warnings: Sequence[Text] = ()) -> Iterator[Event]:
        """What run.json says, and a table of the way to parameters that were not reached."""
        yield self.summary(entries, warnings)
        if self.way:
            yield Table("way", ["De", "Ca_e", *names_of(self.case.n, "d", "U", "dU", "D")], [*map(way_row, self.way)])

    def summary(self, entries: Mapping[str, Any], warnings: Sequence[Text] = ()) -> Summary:
        """What run.json says: `entries` with the costs, and `warnings` with those of mesh, stresses and tube."""
        case, (counts, phases) = self.case, _costs(self.branch)
        seen = [c.s_jump for p in self.points if (c := p.observation.conformation) is not None]
        common = common_warnings(case, max(seen, default=0.0), case.cluster)
        end = self.ended if self.ended is not None and self.ended.proven else None
        place = {} if end is None else {"end_of_branch": {"kind": end.kind, **end.at}}
        return Summary({**entries, **counts, **place}, [*warnings, *common], phases)


def health_columns(case: SceneCase) -> list[str]:
    """Diagnostic columns in a table of quasi-steady solutions."""
    liquid = case.liquid_model
    of_liquid = [*(POLYMER_HEALTH if liquid.modes else ()), *(YIELD_HEALTH if liquid.regularisation else ())]
    return names_of(case.n, *CURVE_HEALTH, *of_liquid)


def point_row(point: Point) -> dict[str, float]:
    """All values of a quasi-steady solution by the names of their columns."""
    o, estimate = point.observation, point.estimate
    values: dict[str, Any] = {
        "d": point.gaps,
        "U": o.U,
        "dU": o.dU,
        "D": o.D,
        "F": o.F,
        "dp": o.dp,
        "dp_plus": o.dp_plus,
        "newton": point.newton,
        "dU_held": point.held_dUs,
        "stretch": point.motion.stretch,
        "from_rest": point.motion.from_rest,
        "dU_discrete": point.discrete.dU,
        "ends_error": estimate[dU].ends_error,
        "regularisation_error": estimate[dU].regularisation_error,
        "bridge": point.hold.bridge,
        "creep": point.hold.creep,
        "plug": point.hold.plug,
        "slope": point.slopes,
        **{f"by_{name}": change for name, change in point.sensitivities.items()},
        **dict(_errors(estimate)),
        "dU_error": point.dU_errors,
        "corrected": estimate.trusted,
        "t_relax": point.t_relax if np.isfinite(point.t_relax) else np.nan,
        "meshes": point.meshes,
        **observed(o),
        "distortion": point.distortion,
    }
    return table_row(
        o.U.size, **{name: value for name, value in values.items() if value is not None and np.size(value)}
    )


def _errors(estimate: ErrorEstimate) -> Iterator[tuple[str, Any]]:
    """The half-widths of all goals, and the corrections of those that are corrected, by quantity."""
    for goal, found in estimate.items():
        if found.correction.size:
            columns = {goal.error_column: found.half_width}
            if goal.added:
                columns[f"{goal.name}_correction"] = found.correction
            for name, each in columns.items():
                yield name, each if goal.per else float(each[0])


def slope_rows(point: Point) -> Iterator[dict[str, float]]:
    """The rows of slopes.csv for a quasi-steady solution, one for each distance."""
    slopes = zip(point.velocity_slopes.T, point.held_slopes.T, strict=True)
    for gap, (moving, held) in enumerate(slopes, 1):
        yield table_row(len(moving), d=point.gaps, gap=gap, U_slope=moving, U_slope_held=held)


def way_row(passed: Passed) -> dict[str, float]:
    """The values of a solution on the way to others; velocities are those at held distances."""
    place, U = passed.parameters, passed.U
    parameters = {"De": place.De, "Ca_e": max(place.Ca_es, default=0.0), "d": place.gaps}
    return table_row(len(U), **parameters, U=U, dU=np.diff(U), D=passed.D)


def error_at(point: Point, goal: Goal, size: Array | float) -> ErrorAt | None:
    """The largest estimated error of a goal at a point, relative to a size; None where the size is no more than 0."""
    estimate, sizes = point.estimate[goal], np.broadcast_to(size, point.estimate[goal].half_width.shape)
    parts = np.divide(estimate.half_width, sizes, out=np.full(sizes.shape, -1.0), where=sizes > ROUNDING)
    if not (parts >= 0).any():
        return None
    at = int(parts.argmax())
    parts_by = (float(each[at] / sizes[at]) for each in (estimate.ends_error, estimate.regularisation_error))
    return ErrorAt(float(parts[at]), each_of(point.parameters), *parts_by)


def moving_errors(case: SceneCase, points: Sequence[Point], size: float) -> list[Text]:
    """Warnings of points at which particles move on too fast for a curve, relative to a velocity."""
    parts = {
        Message("d = {}", LENGTH(dict.fromkeys(point.gaps))): float(point.motion.remainder.max()) / size
        for point in points
    }
    far = [place for place, part in parts.items() if part > case.error_wanted]
    return moves_on(case, far, max(parts.values()))


def _costs(branch: Branch | None) -> tuple[dict[str, Any], dict[str, float]]:
    """Cost of a branch: counts, and the wall time of each phase [s]."""
    if branch is None:
        return {}, {}
    counts = {
        "newton_iterations": branch.solver.iterations,
        "factorisations": branch.solver.factorisations,
        "meshes": branch.solver.meshes,
        "unknowns": branch.solver.constraints.size,
    }
    return counts, dict(branch.solver.clock.seconds)


def listed(places: Sequence[Sequence[Text]]) -> Message:
    """Places in words, such as "De = 1, d = 0.1; d = 0.2".

    What is the same at all of them, from the first parameter on, is said at the first one alone.

    Args:
        places: The parameters of each, such as "De = 1" and "d = 0.1".
    """
    same = sum(1 for _ in takewhile(lambda each: len(set(each)) == 1, zip(*places, strict=False)))
    first, *others = places
    return Message.joined("; ", (Message.joined(", ", place) for place in (first, *(each[same:] for each in others))))


def adaptation_report(
    case: SceneCase, branch: AdaptiveBranch, points: Sequence[Point], largest: Mapping[Goal, float] | None = None
) -> tuple[dict[str, Any], list[Text]]:
    """The entry of run.json, and a warning of the points whose errors are larger than wanted, for each goal.

    Args:
        case: The case.
        branch: The branch, with its goals.
        points: Its points for which `accuracy` counts.
        largest: Values of goals that are known to be larger than those of the branch.
    """
    known = [goal for goal in branch.goals if all(point.estimate[goal].half_width.size for point in points)]
    found = [_Accuracy.of(case, branch, goal, points, (largest or {}).get(goal)) for goal in known]
    reached = {each.goal.name: each.reached for each in found}
    worst = max(reached.values(), default=0.0)
    held = [Message.joined(", ", at.where) for each in found for at in each.held]
    entry = {
        "wanted": case.error_wanted,
        **({"reached": worst, "kept": worst <= case.error_wanted} if points else {}),
        **({"reached_by": reached} if points and len(found) > 1 else {}),
        **({"held_together": held} if held else {}),
        "meshes": [
            {**_mesh_is_for(place, case), "unknowns": n, "rounds": branch.rounds[place]}
            for place, n in sorted(branch.unknowns.items())
        ],
        **{f"reference_{each.goal.name}": each.size for each in found if each.size is not None},
    }
    return entry, [warning for each in found for warning in each.warnings(case)]


def _mesh_is_for(place: Sequence[float], case: SceneCase) -> dict[str, float | list[float]]:
    """The distances that a mesh is made for, or the softness of a particle on its own."""
    return {"d" if case.n > 1 else "Ca_e": place[0] if len(set(place)) == 1 else list(place)}


@dataclass(frozen=True)
class _Accuracy:
    """How well the accuracy of a goal was kept.

    Attributes:
        goal: The goal.
        size: The value that errors are relative to, if it is that of all points.
        what: What they are relative to, in words.
        errors: The largest error of each point.
        held: Those where unyielded liquid holds particles together, if the goal is creep there: no cells make it more
            exact, and the answer says what it is.
    """

    goal: Goal
    size: float | None
    what: str
    errors: list[ErrorAt]
    held: list[ErrorAt]

    @classmethod
    def of(
        cls, case: SceneCase, branch: AdaptiveBranch, goal: Goal, points: Sequence[Point], largest: float | None
    ) -> Self:
        """That of a goal at points."""
        size = None
        match goal.scale:
            case Scale.DISTANCE:
                sizes = [np.asarray(abs(point.slope_at_rest) * point.d) for point in points]
                what = "itself, that of a critical distance"
            case Scale.ITSELF:
                sizes, what = [np.abs(point.values[goal]) for point in points], goal.name
            case Scale.LARGEST:
                size = branch.largest[goal] if largest is None else largest
                sizes = [np.asarray(size)] * len(points)
                whole = f"the largest |{goal.name}|" if goal.scouted or len(points) > 1 else f"|{goal.name}|"
                what = f"{whole} ({in_unit(case.scales, goal.kind, size, digits=3)})"
        known = [(point, error_at(point, goal, each)) for point, each in zip(points, sizes, strict=True)]
        errors, held = (
            [at for point, at in known if at is not None and (goal.creeps and point.held_together) == is_held]
            for is_held in (False, True)
        )
        return cls(goal, size, what, errors, held)

    @property
    def reached(self) -> float:
        """The largest error, relative to the size of the goal."""
        return max((each.relative for each in (*self.errors, *self.held)), default=0.0)

    def warnings(self, case: SceneCase) -> Iterator[Message]:
        """A warning of the points where more than `accuracy` is left."""
        missed = [each.where for each in self.errors if each.relative > case.error_wanted]
        if not missed:
            return
        widest = max(self.errors, key=lambda each: each.relative)
        more = f" and {len(missed) - MOST_NAMED} more" if len(missed) > MOST_NAMED else ""
        at = Message(" at {}{}", listed(missed[:MOST_NAMED]), more) if any(missed) else ""
        fixed = " and ".join(f"mesh.{name}" for name in sorted(case.held))
        other = widest.no_mesh_helps(case)
        advice = f"; use {other}" if other else f"; leave out {fixed}" if fixed else ""
        percent = above(100 * widest.relative, 100 * case.error_wanted)
        said = "accuracy: {} was not kept{}: {} is up to {} % of {}{}"
        yield Message(said, case.accuracy, at, self.goal.error_column, percent, self.what, advice)
