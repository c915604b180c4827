"""Solution of the points of a master curve, in the main process and in those of workers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from pairsim.cases.differences import differ
from pairsim.cases.inputs import inputs_of
from pairsim.computing import events
from pairsim.computing.branch_report import BranchReport
from pairsim.computing.found import Found
from pairsim.computing.problems import steady_problem
from pairsim.computing.steady import Solutions, told
from pairsim.computing.workers import Desk, FoundAt, Shared, Workers
from pairsim.questions.curve import QUESTION, CurveCase
from pairsim.record.fields_of_frame import steady_frame
from pairsim.record.xdmf import FieldFrame
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.curves.adaptation import AdaptiveBranch
from pairsim.solvers.curves.curve import Distances
from pairsim.solvers.curves.point import Point
from pairsim.solvers.curves.sensitivities import STIFFNESS
from pairsim.solvers.goals import DP_PLUS, D, F, Goal, U, dU
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.ends import Ended
from pairsim.solvers.steady.scene import SteadySolver

OF_ZEROS = 2.0  # number of points that take as long as a zero, which is also solved on meshes of its own; measured


def parameters_of(case: CurveCase, sensitivities: bool) -> list[str]:
    """The parameters by which dU is differentiated.

    They are all parameters if sensitivities are asked for or an input has a half-width; otherwise those that a spread
    of the particles needs and, for a pair in an experiment, the difference of the diameters.
    """
    of_pair, of_spread = case.n == 2 and case.velocity is None, list[str]()
    if case.spread:
        of_spread = ["Ca_e", STIFFNESS] * bool(case.spread.modulus) + ["beta"] * bool(case.spread.diameter)
    if not sensitivities and not any(each.half_width for each in inputs_of(case)):
        difference = ["difference"] if of_pair and (case.physical is not None or case.spread.diameter) else []
        return of_spread + difference
    values = ("Ca_e", max(case.Ca_es)), ("De", case.De), ("xi", case.De and case.xi), ("beta", 1.0)
    known = [name for name, value in values if value] + ["difference"] * of_pair
    if sensitivities and of_pair and all(case.Ca_es) and differ(case):
        known.append(STIFFNESS)
    return known + [name for name in of_spread if name not in known]


def goals_of(case: CurveCase) -> Sequence[Goal]:
    """The goals for which a curve is computed."""
    if case.velocity is not None:
        return (F, DP_PLUS)
    if case.n > 1:
        return (dU,)
    return (U, DP_PLUS, D) if any(case.Ca_es) else (U, DP_PLUS)


def begun(
    case: CurveCase, found: Solutions, first: Distances, monitor: Monitor, sensitivities: Sequence[str]
) -> AdaptiveBranch | Ended:
    """The branch of a curve at its first distances, or why there is none; cells are chosen for the whole curve."""
    narrowest = min((d for place in case.in_order for d in place), default=math.inf)
    problem = steady_problem(case, narrowest, monitor)
    return found.begin(problem, start_of(case, first), places=case.in_order, sensitivities=sensitivities)


def start_of(case: CurveCase, place: Distances) -> Parameters:
    """The parameters of a curve at some distances."""
    return Parameters(place, case.solid_models, case.liquid_model, varied=case.varied)


@dataclass(frozen=True)
class ReadOff:
    """What the results contain of a solution beside its `Point`.

    Attributes:
        own: The values of the columns that the question declares itself (`Columns.own`), by name.
        frame: The fields; None unless they are requested at this distance.
    """

    own: dict[str, Any]
    frame: FieldFrame | None


def read_off(case: CurveCase, point: Point, solver: SteadySolver) -> ReadOff:
    """What the results contain of the present solution of a solver beside its point, which is given."""
    asked = any(abs(point.d - d) < 1e-9 * d for d in case.fields)
    own = QUESTION.tables["curve"].own_row(case.n, Found(point, solver))
    return ReadOff(own, steady_frame(point.d, solver) if asked else None)


def solve_part(
    case: CurveCase, sensitivities: Sequence[str], places: Sequence[Distances], desk: Desk
) -> Iterator[FoundAt[Distances, tuple[Point, ReadOff]] | tuple[str, BranchReport]]:
    """Solve at some places of a curve in another process, which finds its own first solution and cells.

    Yields what is found at each place, and reports on the branch with the name of the process.
    """
    found = desk.kept(partial(Solutions, case, goals_of(case)))

    def at(branch: AdaptiveBranch, place: Distances) -> tuple[Point, ReadOff] | Ended:
        point = branch.at(start_of(case, place))
        return point if isinstance(point, Ended) else (point, read_off(case, point, branch.solver))

    return found.in_part(partial(begun, case, found, places[0], desk.monitor, sensitivities), places, at, desk.name)


class Others:
    """The workers that solve for points of a curve beside the main process, if there are any.

    Args:
        case: The case.
        workers: The workers.
        monitor: The monitor of the case.
        found: Receives the reports on their branches.
        sensitivities: Parameters by which dU is differentiated.
    """

    def __init__(
        self, case: CurveCase, workers: Workers, monitor: Monitor, found: Solutions, sensitivities: Sequence[str]
    ) -> None:
        part = partial(solve_part, case, tuple(sensitivities))
        self._case = case
        self._shared = Shared[Distances, tuple[Point, ReadOff]](workers, monitor, part, found.hear)
        self._first: Sequence[Distances] | None = None
        self._read = dict[int, tuple[Point, ReadOff]]()

    def begin(self, places: Sequence[Distances]) -> None:
        """Share out the first places, so that workers begin while this process looks for its first solution."""
        self._first = self._shared.share(places, OF_ZEROS if self._case.of_free_pairs else 0.0)

    def share(self, places: Sequence[Distances]) -> Sequence[Distances]:
        """Share places out to the workers; returns those that this process must solve itself."""
        if self._first is not None:
            first, self._first = self._first, None
            return first
        return self._shared.share(sorted(places, reverse=True)) if self._shared.shares else places

    def come(self) -> Iterator[tuple[Distances, Point]]:
        """Yield the places and points that the workers have found since the last call."""
        return self._points(self._shared.come())

    def rest(self, meanwhile: Callable[[], bool]) -> Iterator[tuple[Distances, Point]]:
        """Yield the places and points that the workers find until all have ended; `meanwhile` as for `Shared.rest`."""
        return self._points(self._shared.rest(meanwhile))

    def _points(self, found: Iterator[tuple[Distances, tuple[Point, ReadOff]]]) -> Iterator[tuple[Distances, Point]]:
        for place, (point, read) in found:
            self._read[id(point)] = point, read
            yield place, point

    def of(self, point: Point) -> ReadOff | None:
        """What a worker has read off the solution of a point; None if the point was solved in this process."""
        _, read = self._read.pop(id(point), (None, None))
        return read

    def notes(self) -> Iterator[events.Note]:
        """Yield notes about workers, such as one that has ended early."""
        return told(self._shared)
