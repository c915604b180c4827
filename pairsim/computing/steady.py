"""Quasi-steady solutions of a command: their branch, rows of tables, and what run.json says of them at the end."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, Self

import numpy as np

from pairsim.cases.case import SceneCase
from pairsim.computing.accuracy import adaptation_report
from pairsim.computing.events import Event, Outcome, Summary, Table
from pairsim.computing.warnings import common_warnings, moves_on
from pairsim.quantities.kinds import LENGTH
from pairsim.results.columns import CURVE_HEALTH, POLYMER_HEALTH, YIELD_HEALTH, names_of, observed, table_row
from pairsim.runtime.message import Message, Text
from pairsim.solvers.curves.adaptation import AdaptiveBranch
from pairsim.solvers.curves.branch import Branch, Point
from pairsim.solvers.errors.estimate import ErrorEstimate
from pairsim.solvers.goals import Goal, dU
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.ends import Ended, Passed, SpentOnTheWay
from pairsim.solvers.steady.first_solution import first_scene, scene_past_end


class Solutions:
    """The quasi-steady solutions of a case, on a branch that is closed at the end of the context.

    The errors of its goals are kept below `accuracy`, or it is said which ones are not.

    Args:
        case: The case.
        goals: What it is computed for.

    Attributes:
        points: The solutions that are results.
        judged: Those for which `accuracy` counts: all, unless a question has a list of its own.
        largest: The largest values of goals, where a question knows them better than from these points.
        branch: The branch; None until `begin`.
        ended: The continuation that has ended the computation; None where all was solved. If it is proven that there is
            no steady state, the context ends without an exception: `outcome` is the answer.
        way: The solutions on the way to parameters that were not reached.
    """

    def __init__(self, case: SceneCase, goals: Sequence[Goal]) -> None:
        self.case, self.goals, self.points = case, goals, list[Point]()
        self.judged, self.largest = self.points, dict[Goal, float]()
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
        places: Sequence[tuple[float, ...]] = (),
        sensitivities: Collection[str] = (),
    ) -> AdaptiveBranch:
        """Solve at the first parameters; returns the branch, on which other parameters follow.

        Its meshes are adapted until the errors of the goals are below `accuracy`.

        Args:
            problem: The problem of the case.
            first: The first parameters.
            places: Distances of the case, see `AdaptiveBranch`.
            sensitivities: Parameters by which dU is differentiated.

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
        self.branch = AdaptiveBranch(scene, sensitivities, goals=self.goals, wanted=wanted, places=places, held=held)
        return self.branch

    def last_events(self, entries: Mapping[str, Any], warnings: Sequence[Text] = ()) -> Iterator[Event]:
        """The last events: what run.json says, and the solutions on the way to parameters that were not reached."""
        yield self.summary(entries, warnings)
        if self.way:
            yield Table("way", ["De", "Ca_e", *names_of(self.case.n, "d", "U", "dU", "D")], [*map(way_row, self.way)])

    def summary(self, entries: Mapping[str, Any], warnings: Sequence[Text] = ()) -> Summary:
        """What run.json says at the end.

        Args:
            entries: Entries of the question, to which the costs, the end of the branch, and whether the accuracy was
                kept are added.
            warnings: Warnings of the question, to which those of accuracy and those that all questions share are added.
        """
        case, (counts, phases) = self.case, _costs(self.branch)
        seen = [c.s_jump for p in self.points if (c := p.observation.conformation) is not None]
        common = common_warnings(case, self.goals[0].name, max(seen, default=0.0), case.cluster)
        end = self.ended if self.ended is not None and self.ended.proven else None
        place = {} if end is None else {"end_of_branch": {"kind": end.kind, **end.at}}
        kept, missed = dict[str, Any](), list[Text]()
        if self.branch is not None:
            kept["adaptation"], missed = adaptation_report(case, self.branch, self.judged, self.largest)
        return Summary({**entries, **kept, **counts, **place}, [*missed, *warnings, *common], phases)


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
    """The row of way.csv for a solution on the way to others; velocities are those at held distances."""
    place, U = passed.parameters, passed.U
    parameters = {"De": place.De, "Ca_e": max(place.Ca_es, default=0.0), "d": place.gaps}
    return table_row(len(U), **parameters, U=U, dU=np.diff(U), D=passed.D)


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
