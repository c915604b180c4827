"""What questions about one particle over Ca_e share: their keys and the steady states."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from pydantic import Field

from pairsim.cases.case import SceneCase
from pairsim.cases.estimate import Estimate, steady_estimate
from pairsim.cases.mistakes import Mistake
from pairsim.cases.values import Values
from pairsim.computing import events
from pairsim.computing.found import Found
from pairsim.computing.warnings import finer
from pairsim.quantities.text import softness
from pairsim.record.column import Columns
from pairsim.record.columns import CA_E
from pairsim.record.run_entries import POINTS
from pairsim.runtime.message import Message
from pairsim.runtime.text import counted
from pairsim.solvers.parameters import Parameters

if TYPE_CHECKING:
    from pairsim.runtime.monitor import Monitor
    from pairsim.solvers.goals import Goal

WRINKLED = 2.0  # roughness of a surface from which it has waves as long as cells (`pairsim.fem.surface.roughness`)


class AlongCase(SceneCase):
    """The case of one particle, which is solved at its Ca_e or at several."""

    along: Values | None = Field(
        None, description="elastic capillary numbers in place of Ca_e: a list or a range; default: Ca_e alone"
    )

    @property
    def series(self) -> tuple[float, ...]:
        """The elastic capillary numbers, ascending."""
        return tuple(sorted(set(self.along or self.Ca_es)))


def check_along(case: AlongCase) -> Iterator[Mistake]:
    """Yield the mistakes in keys that all cases have: it is about one soft particle."""
    if case.n != 1:
        yield Mistake("particles", case.n, f"must be 1: the {case.kind} is that of a particle on its own")
    elif case.Ca_e == 0:
        why = "a rigid particle keeps its shape; pairsim curve has its velocity and pressure drop"
        yield Mistake("Ca_e", case.Ca_e, f"must be above 0{', as along replaces it' if case.along else f': {why}'}")


def estimate_along(case: AlongCase) -> Estimate:
    """Size and duration."""
    return steady_estimate(case, len(case.series))


def solve_along(
    case: AlongCase, monitor: Monitor, columns: Columns, shown: str, goals: Sequence[Goal]
) -> events.Events:
    """Solve the steady states in ascending Ca_e.

    Args:
        case: The case.
        monitor: The monitor of the computation.
        columns: The first columns of the table, which has the name of the question; own ones have a `value` of a
            `Found`.
        shown: Name of the column that progress shows.
        goals: What is asked for: `accuracy` is kept of these, or a warning says where it is not.
    """
    from pairsim.analysis.rows_of_points import point_row
    from pairsim.computing.problems import steady_problem
    from pairsim.computing.steady import Solutions, health_columns
    from pairsim.fem.surface import roughness
    from pairsim.solvers.steady.ends import Ended

    what = f"{counted(len(case.series), 'value')} of Ca_e"
    yield events.Begin(what, len(case.series))
    yield events.Table(case.kind, [*columns.named(case.n), *health_columns(case)])
    problem, start = steady_problem(case, 1.0, monitor), Parameters((), case.solid_models, case.liquid_model)
    found, rough = Solutions(case, goals), list[str]()
    try:
        with found:
            branch = found.begin(problem, start.with_Ca_e(case.series[0]))
            if isinstance(branch, Ended):
                return found.outcome_of(branch)
            for count, Ca_e in enumerate(case.series, 1):
                point = branch.at(start.with_Ca_e(Ca_e))
                if isinstance(point, Ended):
                    return found.outcome_of(point)
                found.points.append(point)
                row = point_row(point) | {CA_E.name: Ca_e}
                row |= columns.own_row(case.n, Found(point, branch.solver))
                yield events.Row(case.kind, row)
                if roughness(branch.solver.bodies[0], branch.solver.state()[0]) > WRINKLED:
                    rough.append(f"{Ca_e:.4g}")
                value = columns.column(shown).unit(row[shown], ".6g")
                text = Message("{}  {} = {}", softness(Ca_e, case.scales), shown, value)
                yield events.Progress(count, text, count)
            return events.Outcome("finished", "end", what)
    finally:
        warning = (
            f"at Ca_e = {', '.join(rough)} the surface has waves as long as its cells, on this mesh alone: D and "
            f"deformation may be off by more than their errors; compare with {finer(case)}"
        )
        yield from found.last_events({POINTS: len(found.points)}, [warning] if rough else [])
