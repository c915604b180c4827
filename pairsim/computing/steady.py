"""Quasi-steady solutions of a command: their branch, rows of tables, and what run.json says of them at the end."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import takewhile
from typing import Any, Self

import numpy as np

from pairsim.cases.case import SceneCase
from pairsim.computing.events import Event, Outcome, Summary, Table
from pairsim.computing.warnings import ErrorAt, above, common_warnings, large_errors, moves_on
from pairsim.quantities.kinds import LENGTH
from pairsim.results.column import names_of
from pairsim.results.columns import POLYMER_HEALTH, STEADY_HEALTH, WAY_COLUMNS, YIELD_HEALTH
from pairsim.results.entries import END_OF_BRANCH, FACTORISATIONS, MESH_COUNT, NEWTON_ITERATIONS, SIZE, Entries
from pairsim.results.rows import way_row
from pairsim.runtime.message import Message, Text
from pairsim.solvers.curves.adaptation import AdaptiveBranch
from pairsim.solvers.curves.branch import Branch, Point
from pairsim.solvers.curves.interpolant import NEGLIGIBLE_DU
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
        ended: The continuation that has ended the computation; None where all was solved.
        way: The solutions on the way to parameters that were not reached.
    """

    def __init__(self, case: SceneCase) -> None:
        self.case, self.points = case, list[Point]()
        self.ended: Ended | None = None
        self.way: Sequence[Passed] = ()
        self.branch: AdaptiveBranch | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, failure: BaseException | None, *_: object) -> None:
        if isinstance(failure, SpentOnTheWay):
            self.way = failure.way
        if self.branch is not None:
            self.branch.close()

    def outcome_of(self, ended: Ended) -> Outcome:
        """The outcome where a continuation has ended before all was solved: that there is no steady state, if proven.

        Raises:
            NoSteadyState: It is not.
        """
        self.ended, self.way = ended, ended.way
        if not ended.proven:
            raise ended.failure
        return Outcome("finished", ended.failure.reason, ended.failure.message)

    def begin(
        self,
        problem: SteadyProblem,
        first: Parameters,
        *,
        places: Sequence[tuple[float, ...]] = (),
        sensitivities: Collection[str] = (),
        zeros_only: bool = False,
    ) -> AdaptiveBranch | Ended:
        """Solve at the first parameters, from which others follow on the branch.

        Its mesh is adapted to `accuracy` where several particles move freely, as dU is then asked for.

        Args:
            problem: The problem of the case.
            first: The first parameters.
            places: Distances of the case, see `AdaptiveBranch`.
            sensitivities: Parameters by which dU is differentiated.
            zeros_only: Whether the mesh is adapted at zeros of dU alone.

        Returns:
            The branch, or why the first parameters were not reached.

        Raises:
            NoSteadyState: No solution was found.
            MeshFailure: A mesh could not be generated.
        """
        wanted = self.case.error_wanted if self.case.n > 1 and self.case.drive.free else np.inf
        scene = first_scene(problem, first)
        if isinstance(scene, Ended) and scene.kind and not first.gaps:
            scene = scene_past_end(problem, first, scene)
        if isinstance(scene, Ended):
            return scene
        self.branch = AdaptiveBranch(
            scene, places=places, wanted=wanted, held=self.case.held, sensitivities=sensitivities, zeros_only=zeros_only
        )
        return self.branch

    def last_events(self, entries: Entries, warnings: Sequence[Text] = ()) -> Iterator[Event]:
        """The last events: what run.json says, and the solutions on the way to parameters that were not reached."""
        yield self.summary(entries, warnings)
        if self.way:
            yield Table("way", WAY_COLUMNS.named(self.case.n), [*map(way_row, self.way)])

    def summary(self, entries: Entries, warnings: Sequence[Text] = ()) -> Summary:
        """What run.json says at the end.

        Args:
            entries: Entries of the question, to which the costs and the end of the branch are added.
            warnings: Warnings of the question, to which those that all questions share are added.
        """
        case, (counts, phases) = self.case, _costs(self.branch)
        seen = [c.s_jump for p in self.points if (c := p.observation.conformation) is not None]
        common = common_warnings(case, max(seen, default=0.0), case.cluster)
        end = self.ended if self.ended is not None and self.ended.proven else None
        place: Entries = {} if end is None else {END_OF_BRANCH: {"kind": end.kind, **end.at}}
        return Summary({**entries, **counts, **place}, [*warnings, *common], phases)


def health_columns(case: SceneCase) -> list[str]:
    """Diagnostic columns in a table of quasi-steady solutions."""
    liquid = case.liquid_model
    of_liquid = [*(POLYMER_HEALTH if liquid.modes else ()), *(YIELD_HEALTH if liquid.regularisation else ())]
    return names_of(case.n, *STEADY_HEALTH, *of_liquid)


def error_at(point: Point, gap: int, size: float) -> ErrorAt:
    """The estimated error of dU over a gap of a point, and its parts, relative to a velocity `size` [U_av]."""
    estimate = point.estimate
    ends, regularisation = float(estimate.ends_error[gap]) / size, float(estimate.regularisation_error[gap]) / size
    return ErrorAt(float(estimate.dU_error[gap]) / size, each_of(point.parameters), ends, regularisation)


def large_value_errors(case: SceneCase, rows: Sequence[Mapping[str, float]], errors: Mapping[str, str]) -> list[Text]:
    """Warnings of columns with a half-width of more than `accuracy` of the largest value in the column.

    Args:
        case: The case.
        rows: The rows of the table; where there are several, each has its Ca_e.
        errors: Names of the columns, each with that of the column of its half-widths.
    """
    found: list[Text] = []
    for name, error in errors.items():
        size = max((abs(row[name]) for row in rows), default=0.0)
        places = [(f"Ca_e = {row['Ca_e']:.4g}",) if "Ca_e" in row else () for row in rows]
        parts = [row[error] / size for row in rows] if size > NEGLIGIBLE_DU else []
        at = [ErrorAt(part, place, 0.0, 0.0) for part, place in zip(parts, places, strict=False)]
        found += large_errors(case, f"the error of {name}", f"the largest |{name}|" if len(rows) > 1 else "it", at)
    return found


def moving_errors(case: SceneCase, points: Sequence[Point], size: float) -> list[Text]:
    """Warnings of points at which particles move on before they have forgotten their start.

    The error of dU that this leaves is compared with `accuracy` times a velocity `size` [U_av].
    """
    parts = {
        Message("d = {}", LENGTH(dict.fromkeys(point.gaps))): float(point.motion.remainder.max()) / size
        for point in points
    }
    far = [place for place, part in parts.items() if part > case.error_wanted]
    return moves_on(case, far, max(parts.values()))


def _costs(branch: Branch | None) -> tuple[Entries, dict[str, float]]:
    """Cost of a branch: counts, and the wall time of each phase [s]."""
    if branch is None:
        return {}, {}
    counts = {
        NEWTON_ITERATIONS: branch.solver.iterations,
        FACTORISATIONS: branch.solver.factorisations,
        MESH_COUNT: branch.solver.meshes,
        SIZE: branch.solver.constraints.size,
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
    case: SceneCase, branch: AdaptiveBranch, points: Sequence[Point], sizes: Sequence[float], what: str
) -> tuple[dict[str, Any], list[Text]]:
    """The entry `adaptation` of run.json, and a warning of the points whose error exceeds `accuracy`.

    Where unyielded liquid holds particles together dU is creep, which no cells make more exact. No warning is given of
    such points, as the answer says what their dU is.

    Args:
        case: The case.
        branch: The branch with the meshes that were made.
        points: The points.
        sizes: A velocity for each point, relative to which its error of dU is taken [U_av].
        what: These velocities in words, such as "the largest |dU|".
    """
    wanted = case.error_wanted
    known = [
        (point.held_together, error_at(point, int(np.argmax(point.estimate.dU_error)), size))
        for point, size in zip(points, sizes, strict=True)
        if size > NEGLIGIBLE_DU
    ]
    errors, held = ([each for locked, each in known if locked == is_held] for is_held in (False, True))
    missed = [each.where for each in errors if each.relative > wanted]
    widest = max(errors, key=lambda each: each.relative, default=None)
    reached = max((each.relative for _, each in known), default=0.0)
    entry = {
        "wanted": wanted,
        **({"reached": reached, "kept": reached <= wanted} if points else {}),
        **({"held_together": [Message.joined(", ", each.where) for each in held]} if held else {}),
        "meshes": [
            {"d": gaps[0] if len(set(gaps)) == 1 else list(gaps), "unknowns": n, "rounds": branch.rounds[gaps]}
            for gaps, n in sorted(branch.unknowns.items())
        ],
    }
    if not missed or widest is None:
        return entry, []
    worst = widest.relative
    more = f" and {len(missed) - MOST_NAMED} more" if len(missed) > MOST_NAMED else ""
    fixed = " and ".join(f"mesh.{name}" for name in sorted(case.held))
    other = widest.no_mesh_helps(case)
    advice = f"; use {other}" if other else f"; leave out {fixed}" if fixed else ""
    said = "accuracy: {} was not kept at {}{}: dU_error is up to {} % of {}{}"
    percent = above(100 * worst, 100 * wanted)
    return entry, [Message(said, case.accuracy, listed(missed[:MOST_NAMED]), more, percent, what, advice)]
