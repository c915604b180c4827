"""Rates off the axis in addition to another question, in cases with `focus: true`; loads their solver only then."""

from __future__ import annotations

from collections.abc import Generator, Sequence

from pairsim.cases.off_axis import OffAxisCase
from pairsim.computing import events
from pairsim.computing.off_axis.columns import NAME
from pairsim.quantities.kinds import LENGTH
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.runtime.message import Message, Text
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.ends import arrived


def rates_beside(
    case: OffAxisCase, branch: Branch, places: Sequence[Parameters], done: float, count: int
) -> Generator[events.Event, None, list[Text]]:
    """Compute the rates of all particles of a branch at some places, ascending: the table `focus`.

    Where no rates are found there is a warning, and no failure: the question itself has been answered by then.

    Args:
        case: The case.
        branch: Its branch of solutions.
        places: The parameters at which rates are computed.
        done: How much of `events.Begin.total` is done; the rates add nothing to it.
        count: Number of steps or points of the question.

    Returns:
        Warnings.
    """
    from pairsim.computing.off_axis.rows import names_of_rows, progress_line, row_of, warnings_of
    from pairsim.solvers.focus.stability import Stability

    yield events.Table(NAME, names_of_rows(case, n=len(branch.solver.bodies)))
    warnings, remembered = list[Text](), list[Text]()
    for place in places:
        at: Text = Message("d = {}", LENGTH(dict.fromkeys(place.gaps))) if place.gaps else "the axis"
        try:
            point = arrived(branch.at(place))
            branch.solver.problem.monitor.check()
            stability = Stability.of(branch.solver)
        except (NoSteadyState, MeshFailure) as failure:
            warnings.append(Message("no rate off the axis was found at {}: {}", at, failure.message))
            continue
        if not stability.disturbance.converged:
            remembered.append(at)
        yield events.Row(NAME, row_of(case, place, point, stability, case.scales))
        yield events.Progress(done, Message("off the axis: {}", progress_line(at, stability)), count)
    return [*warnings, *warnings_of(remembered)]
