"""Common parts of the questions about a single particle over Ca_e: their keys and the steady states."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from pydantic import Field

from pairsim.cases.case import SceneCase
from pairsim.cases.estimate import Estimate, steady_estimate
from pairsim.cases.mistakes import Mistake
from pairsim.cases.values import Values, Whole
from pairsim.computing import events
from pairsim.computing.found import Found
from pairsim.computing.warnings import finer
from pairsim.computing.workers import Desk, FoundAt, Shared, Workers
from pairsim.quantities.text import softness
from pairsim.record.column import Columns
from pairsim.record.columns import CA_E
from pairsim.record.run_entries import POINTS
from pairsim.runtime.message import Message
from pairsim.runtime.others import found_by_all
from pairsim.runtime.text import counted
from pairsim.solvers.parameters import Parameters

if TYPE_CHECKING:
    from pairsim.computing.branch_report import BranchReport
    from pairsim.computing.steady import Solutions
    from pairsim.runtime.monitor import Monitor
    from pairsim.solvers.curves.adaptation import AdaptiveBranch
    from pairsim.solvers.curves.point import Point
    from pairsim.solvers.goals import Goal
    from pairsim.solvers.steady.ends import Ended

WRINKLED = 2.0  # roughness above which a surface has waves as long as cells (`pairsim.fem.surface.roughness`)


class AlongCase(SceneCase):
    """The case of one particle, which is solved at its Ca_e or at several."""

    particles: Whole = Field(1, ge=1, le=1, description="1: the particle is on its own")
    along: Values | None = Field(
        None, description="elastic capillary numbers in place of Ca_e: a list or a range; default: Ca_e alone"
    )

    @property
    def series(self) -> tuple[float, ...]:
        """The elastic capillary numbers, ascending."""
        return tuple(sorted(set(self.along or self.Ca_es)))


def check_along(case: AlongCase) -> Iterator[Mistake]:
    """Yield a mistake if the particle is rigid."""
    if case.Ca_e == 0:
        why = "a rigid particle keeps its shape; pairsim curve has its velocity and pressure drop"
        yield Mistake("Ca_e", case.Ca_e, f"must be above 0{', as along replaces it' if case.along else f': {why}'}")


def estimate_along(case: AlongCase) -> Estimate:
    """Estimate of the size and duration of the computation."""
    return steady_estimate(case, len(case.series))


def solve_along(
    case: AlongCase, monitor: Monitor, workers: Workers, columns: Columns, shown: str, goals: Sequence[Goal]
) -> events.Events:
    """Solve the steady states in ascending Ca_e.

    Args:
        case: The case.
        monitor: The monitor of the computation.
        workers: The processes that share the work.
        columns: The first columns of the table, which has the name of the question; the `value` of a column that only
            this question has takes a `Found`.
        shown: Name of the column that progress shows.
        goals: The goals that must meet `accuracy`; a warning says where they do not.
    """
    from pairsim.computing.steady import Solutions, health_columns, told
    from pairsim.solvers.steady.ends import Ended

    what = f"{counted(len(case.series), 'value')} of Ca_e"
    yield events.Begin(what, len(case.series))
    names = [*columns.named(case.n), *health_columns(case)]
    yield events.Table(case.kind, names, ascending=workers.count > 1)
    found, rough = Solutions(case, goals), list[float]()
    others = Shared[float, Steady | Ended](workers, monitor, partial(solve_part, case, columns, goals), found.hear)
    try:
        with found:

            def find(Ca_e: float) -> Steady | Ended:
                branch = found.branch or begun(case, found, Ca_e, monitor)
                return branch if isinstance(branch, Ended) else steady_at(case, columns, branch, Ca_e)

            for count, (Ca_e, steady) in enumerate(found_by_all(case.series, find, others), 1):
                if isinstance(steady, Ended):
                    return found.outcome_of(steady)
                found.points.append(steady.point)
                found.points.sort(key=lambda point: point.parameters.Ca_es)
                yield events.Row(case.kind, steady.row)
                if steady.rough:
                    rough.append(Ca_e)
                value = columns.column(shown).unit(steady.row[shown], ".6g")
                text = Message("{}  {} = {}", softness(Ca_e, case.scales), shown, value)
                yield events.Progress(count, text, count)
                yield from told(others)
            return events.Outcome("finished", "end", what)
    finally:
        warning = (
            f"at Ca_e = {', '.join(f'{Ca_e:.4g}' for Ca_e in sorted(rough))} the surface has waves as long as its "
            "cells, on this mesh alone: D and deformation may be off by more than their errors; compare with "
            f"{finer(case)}"
        )
        yield from found.last_events({POINTS: len(found.points)}, [warning] if rough else [])


@dataclass(frozen=True)
class Steady:
    """A steady state.

    Attributes:
        point: The solution.
        row: Its row of the table.
        rough: Whether its surface has waves as long as its cells.
    """

    point: Point
    row: dict[str, Any]
    rough: bool


def begun(case: AlongCase, found: Solutions, first: float, monitor: Monitor) -> AdaptiveBranch | Ended:
    """The branch of steady states, solved at its first Ca_e, or where it ended before."""
    from pairsim.computing.problems import steady_problem

    start = Parameters((), case.solid_models, case.liquid_model).with_Ca_e(first)
    return found.begin(steady_problem(case, 1.0, monitor), start)


def steady_at(case: AlongCase, columns: Columns, branch: AdaptiveBranch, Ca_e: float) -> Steady | Ended:
    """The steady state at a Ca_e, or where the branch ended before it."""
    from pairsim.analysis.rows_of_points import point_row
    from pairsim.fem.surface import roughness
    from pairsim.solvers.steady.ends import Ended

    point = branch.at(Parameters((), case.solid_models, case.liquid_model).with_Ca_e(Ca_e))
    if isinstance(point, Ended):
        return point
    row = point_row(point) | {CA_E.name: Ca_e} | columns.own_row(case.n, Found(point, branch.solver))
    rough = roughness(branch.solver.bodies[0], branch.solver.state()[0]) > WRINKLED
    return Steady(point, row, rough)


def solve_part(
    case: AlongCase, columns: Columns, goals: Sequence[Goal], values: Sequence[float], desk: Desk
) -> Iterator[FoundAt[float, Steady] | tuple[str, BranchReport]]:
    """Solve the steady states at some values of Ca_e, in the process of a worker."""
    from pairsim.computing.steady import Solutions

    found = desk.kept(partial(Solutions, case, goals))
    begin = partial(begun, case, found, values[0], desk.monitor)
    return found.in_part(begin, values, partial(steady_at, case, columns), desk.name)
