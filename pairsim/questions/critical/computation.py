"""The computation of critical distances: the search for zeros of dU, and their continuation over a parameter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from pairsim.analysis.rows_of_points import point_row
from pairsim.computing import events
from pairsim.computing.accuracy import error_at
from pairsim.computing.branch_report import BranchReport
from pairsim.computing.problems import steady_problem
from pairsim.computing.steady import Solutions, health_columns, told
from pairsim.computing.warnings import ErrorAt, large_errors
from pairsim.computing.workers import Desk, FoundAt, Shared, Workers
from pairsim.quantities.kinds import LENGTH, VELOCITY
from pairsim.questions.critical import CRITICAL_COLUMNS, ENDS, QUESTION, CriticalCase, EndOfBranch, U
from pairsim.record.columns import (
    BRANCH,
    CA_E,
    D_CR,
    D_ERROR,
    DE,
    DU_ERROR,
    FOLLOWED,
    KIND,
    PARAMETER_ERROR,
    SLOPE,
    STABLE,
)
from pairsim.record.columns import U as U_EACH
from pairsim.runtime.message import Message, Text
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.curves.adaptation import AdaptiveBranch
from pairsim.solvers.curves.critical import find_all, follow_all
from pairsim.solvers.curves.curve import Distances
from pairsim.solvers.curves.equilibrium_lines import Critical, EndOfLine, Followed, Missed, Region
from pairsim.solvers.curves.point import Point
from pairsim.solvers.goals import CRITICAL
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.ends import Ended

WITH_COLUMN = {CA_E.name, DE.name}
"""Followed keys whose values have a column of their own in critical.csv; those of others are in `FOLLOWED`."""


def computation(case: CriticalCase, monitor: Monitor, workers: Workers) -> events.Events:
    """Find the critical distances, and follow them over the parameter of the case."""
    least, most = case.d
    region: Region | None = None  # of parameters and distances in which zeros are followed
    if (followed := case.followed) is not None:
        region = Region(Followed(followed.materials), followed.values, least, most)
    start = start_of(case, None if region is None else region.values[0])
    count = len(region.values) if region is not None else 1
    # Expected results: a zero at each value, and those of other lines, which a last search at the last value may find.
    goal = Message("zeros of dU from d = {} to d = {}", LENGTH(least, "g"), LENGTH(most, "g"))
    yield events.Begin(goal, count + 1)
    found = Solutions(case, (CRITICAL,))
    search = Search(case, count, found)

    shared: list[Shared[Distances, Point | Ended]] = []

    def others_at(value: float | None) -> Shared[Distances, Point | Ended]:
        shared.append(Shared(workers, monitor, partial(solve_part, case, value), found.hear))
        return shared[-1]

    try:
        with found:
            own = QUESTION.tables["critical"].own.named(2)
            yield events.Table("critical", [*CRITICAL_COLUMNS.named(2), *health_columns(case), *own, *search.further])
            # Meshes are adapted to the zeros asked for, not to those between them.
            branch = found.begin(steady_problem(case, least, monitor), start)
            if isinstance(branch, Ended):
                return found.outcome_of(branch)
            if isinstance(first := branch.at(start), Ended):
                return found.outcome_of(first)
            findings = (
                find_all(branch, least, most, others_at(None))
                if region is None
                else follow_all(branch, region, others_at)
            )
            for each in findings:
                for others in shared:
                    yield from told(others)
                match each:
                    case Point():
                        yield search.progress_of(each)
                    case Critical():
                        yield from search.events_of_zero(each)
                    case EndOfLine():
                        yield from search.events_of_end(each)
                    case Missed():
                        search.warnings.append(each.message)
                    case Ended():
                        return found.outcome_of(each)
            counts = f"critical distances: {len(found.points)}, branches: {max(search.branches, default=0)}"
            return events.Outcome("finished", "end", counts)
    finally:
        of_fold = "the error of a parameter at which two zeros meet"
        warnings = [*search.warnings, *large_errors(case, of_fold, "itself", search.errors)]
        yield from found.last_events({ENDS: search.ends}, warnings)


def start_of(case: CriticalCase, value: float | None) -> Parameters:
    """The parameters at the largest distance, and at a value of the followed key; None without such a key."""
    start = Parameters((case.d[1],), case.solid_models, case.liquid_model)
    if (followed := case.followed) is None or value is None:
        return start
    return Followed(followed.materials).at(value, start)


def solve_part(
    case: CriticalCase, value: float | None, places: Sequence[Distances], desk: Desk
) -> Iterator[FoundAt[Distances, Point] | tuple[str, BranchReport]]:
    """Solve for points of a curve that is searched for zeros, in the process of a worker.

    `value` is that of the followed key; None without such a key.
    """
    found, start = desk.kept(partial(Solutions, case, (CRITICAL,))), start_of(case, value)
    problem = steady_problem(case, case.d[0], desk.monitor)

    def at(branch: AdaptiveBranch, place: Distances) -> Point | Ended:
        return branch.at(replace(start, gaps=place))

    begin = partial(found.begin, problem, replace(start, gaps=places[0]))
    return found.in_part(begin, places, at, desk.name)


class Search:
    """The state of a search for critical distances, which turns what the solver finds into events.

    Attributes:
        wanted: Solutions at requested values.
        further: The name of the column `FOLLOWED`, if the values of the followed key have no column of their own.
        branches: Numbers of the branches.
        errors: Relative errors of the parameter at folds, where two zeros meet.
        ends: Where branches end.
        warnings: Warnings about the results.
    """

    def __init__(self, case: CriticalCase, count: int, found: Solutions) -> None:
        self._followed, self._count, self._solutions, self._solved = case.followed, count, found, 0
        self.wanted: list[Point] = []
        found.judged = self.wanted
        has_column = self._followed is None or self._followed.key in WITH_COLUMN
        self.further = [] if has_column else [FOLLOWED.name]
        self.branches = set[int]()
        self.errors: list[ErrorAt] = []
        self.ends: list[EndOfBranch] = []
        self.warnings: list[Text] = []

    def progress_of(self, point: Point) -> events.Event:
        """The progress at a solution on the way to a zero."""
        d, dU = LENGTH(point.d, ".5f"), VELOCITY(point.dU, "+.4e")
        return self._progress(Message("search: d = {}  dU = {}", d, dU))

    def events_of_zero(self, critical: Critical) -> Iterator[events.Event]:
        """Record a critical distance; yields its row and the progress."""

        point, place = critical.point, critical.point.parameters
        self.branches.add(critical.branch)
        self._solutions.points.append(point)
        self.wanted += [point] if critical.kind == "wanted" else []
        if critical.by_parameter is not None and self._followed is not None:
            size = abs(critical.by_parameter) * place.followed
            self.errors += filter(None, [error_at(point, CRITICAL, size)])
        own = QUESTION.tables["critical"].own.own_row(2, critical)
        yield events.Row("critical", {**critical_row(critical), **own, FOLLOWED.name: place.followed})
        where = f"Ca_e = {max(place.Ca_es):.5g}  De = {place.De:.5g}"
        if self.further and self._followed is not None:
            where += f"  {self._followed.key} = {place.followed:.5g} {self._followed.unit}".rstrip()
        yield self._progress(Message("{}  d_cr = {}  {}", where, LENGTH(point.d, ".5f"), critical.kind))

    def events_of_end(self, end: EndOfLine) -> Iterator[events.Event]:
        """Record the end of a branch; yields a note on it, unless the branch has reached the last value."""
        self.ends.append({"branch": end.branch, "reason": end.reason, "message": end.message})
        if end.reason != "range":
            yield events.Note(Message("the critical distances of branch {} end: {}", end.branch, end.message))

    def _progress(self, text: Text) -> events.Event:
        self._solved += 1
        return events.Progress(min(len(self.wanted), self._count), text, self._solved)


def critical_row(critical: Critical) -> dict[str, float | str | None]:
    """The row of a critical distance. At a fold the slope vanishes, and the error is that of the parameter."""
    point, of_point = critical.point, point_row(critical.point)
    place, slope, change = point.parameters, point.slope_at_rest, critical.by_parameter
    return {
        **of_point,
        CA_E.name: max(place.Ca_es),
        DE.name: place.De,
        D_CR.name: point.d,
        U.name: of_point[U_EACH.with_suffix("_T").name],
        SLOPE.name: slope,
        KIND.name: critical.kind,
        BRANCH.name: critical.branch,
        STABLE.name: slope < 0,
        D_ERROR.name: point.zero_error if change is None else None,
        PARAMETER_ERROR.name: of_point[DU_ERROR.name] / abs(change) if change is not None else None,
    }
