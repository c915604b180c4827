"""The computation of rates of displaced particles at each value of the followed key."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import Any, Self

from pairsim.computing import events
from pairsim.computing.branch_report import BranchReport
from pairsim.computing.off_axis.columns import NAME
from pairsim.computing.off_axis.rows import names_of_rows, progress_line, row_of, warnings_of
from pairsim.computing.problems import steady_problem
from pairsim.computing.steady import Solutions, together, told
from pairsim.computing.workers import Desk, FoundAt, Shared, Workers
from pairsim.quantities.kinds import LENGTH
from pairsim.questions.focus import BETA, FocusCase, Place, column_of
from pairsim.questions.focus.fields import disturbed_frame
from pairsim.record.columns import CA_E, DE, DISTANCE, FOLLOWED
from pairsim.record.run_entries import POINTS
from pairsim.record.xdmf import FieldFrame
from pairsim.runtime.message import Message, Text
from pairsim.runtime.monitor import Monitor
from pairsim.runtime.others import found_by_all
from pairsim.runtime.text import counted
from pairsim.solvers import goals
from pairsim.solvers.curves.point import Point
from pairsim.solvers.focus.stability import Stability
from pairsim.solvers.steady.ends import Ended


def computation(case: FocusCase, monitor: Monitor, workers: Workers) -> events.Events:
    """Solve the steady states, and displace the particles in each; arguments as for `solve`."""
    values = len(case.series) or 1
    what = f"{counted(values, 'value')} of {case.key}" if case.key else "the case"
    yield events.Begin(what, values)
    over = column_of(case.key) if case.key else None
    names = names_of_rows(case, [FOLLOWED] if over is FOLLOWED else [])
    ascending = over is DISTANCE
    yield events.Table(NAME, names, ascending=ascending)
    scenes, remembered = _Scenes(case, monitor), list[Text]()
    others = Shared[Unit, Rates | Ended](workers, monitor, partial(_solve_part, case), scenes.hear)
    try:
        with scenes:
            rates = found_by_all(scenes.units, scenes.rates, others, in_order=not ascending)
            for count, ((scene, _), found) in enumerate(rates, 1):
                if isinstance(found, Ended):
                    return scenes.solutions(scene).outcome_of(found)
                scenes.solutions(scene).points.append(found.point)
                if not found.converged:
                    remembered.append(found.at)
                if found.frame is not None:
                    yield events.Frame(found.frame)
                yield events.Row(NAME, found.row)
                yield events.Progress(count, found.said, count)
                yield from told(others)
        return events.Outcome("finished", "end", what)
    finally:
        yield from _last_events(scenes.solved, warnings_of(remembered))


type Unit = tuple[int, int]
"""Numbers of a scene and of a place on its mesh."""


@dataclass(frozen=True)
class Rates:
    """What is found at a place.

    Attributes:
        point: The steady state.
        row: The row of the table.
        at: The place in words.
        said: The rates in words.
        converged: Whether stresses and shapes relax faster than the displacements change; otherwise the rates leave out
            what this change adds to them.
        frame: The fields; None unless they are asked for.
    """

    point: Point
    row: dict[str, Any]
    at: Text
    said: Text
    converged: bool
    frame: FieldFrame | None


class _Scenes:
    """The steady states of the scenes of a case, one of which is open at a time."""

    def __init__(self, case: FocusCase, monitor: Monitor) -> None:
        self._case, self._monitor, self._cases = case, monitor, case.scenes
        self._places = [scene.places for scene in self._cases]
        self._solutions = dict[int, Solutions]()
        self._stack, self._open = ExitStack(), -1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *failure: Any) -> None:
        self._stack.__exit__(*failure)

    @property
    def units(self) -> list[Unit]:
        """All places, in the order of solution."""
        return [(i, j) for i, places in enumerate(self._places) for j in range(len(places))]

    @property
    def solved(self) -> Sequence[Solutions]:
        """The solutions of all scenes that have been begun, here or in another process."""
        return [self._solutions[i] for i in sorted(self._solutions)]

    def solutions(self, scene: int) -> Solutions:
        """The solutions of a scene."""
        return self._solutions.setdefault(scene, Solutions(self._cases[scene], (goals.U,)))

    def hear(self, said: tuple[int, str, BranchReport]) -> None:
        """Record the report of another process on its branch in a scene."""
        scene, name, report = said
        self.solutions(scene).hear((name, report))

    def rates(self, unit: Unit) -> Rates | Ended:
        """Compute the rates at a place, or return how the continuation to its steady state ended."""
        scene, place = self._cases[unit[0]], self._places[unit[0]][unit[1]]
        found = self.solutions(unit[0])
        if self._open != unit[0]:
            self._stack.close()
            self._open = unit[0]
            self._stack.enter_context(found)
        branch = found.branch or found.begin(steady_problem(scene, scene.narrowest, self._monitor), place.parameters)
        if isinstance(branch, Ended):
            return branch
        point = branch.at(place.parameters)
        if isinstance(point, Ended):
            return point
        self._monitor.check()
        stability, at = Stability.of(branch.solver), _where(self._case, scene, place)
        value = scene.betas[0] if self._case.key == BETA else place.value
        frame = disturbed_frame(value, branch.solver, stability) if self._case.fields else None
        row = row_of(scene, place.parameters, point, stability, place.scales) | {FOLLOWED.name: value}
        return Rates(point, row, at, progress_line(at, stability), stability.disturbance.converged, frame)


def _solve_part(
    case: FocusCase, units: Sequence[Unit], desk: Desk
) -> Iterator[FoundAt[Unit, Rates] | tuple[int, str, BranchReport]]:
    """Compute the rates at some places in another process; if a continuation ends, so does this, without a message.

    Yields the rates at each place, and reports on the branch of a scene with the name of the process.
    """
    with _Scenes(case, desk.monitor) as scenes:
        for unit in units:
            found = scenes.rates(unit)
            if isinstance(found, Ended):
                return
            yield FoundAt(unit, found)
            if (report := scenes.solutions(unit[0]).report) is not None:
                yield unit[0], desk.name, report


def _last_events(solved: Sequence[Solutions], warnings: Sequence[Text]) -> Generator[events.Event, None, None]:
    """The summary of all scenes for run.json, and the solutions on the way to parameters that were not reached."""
    points = sum(len(each.points) for each in solved)
    if len(solved) == 1:
        yield from solved[0].last_events({POINTS: points}, warnings)
        return
    yield together([each.summary({}, ()) for each in solved], {POINTS: points}, warnings)
    yield from chain.from_iterable(list(each.last_events({}))[1:] for each in solved[-1:])


def _where(case: FocusCase, scene: FocusCase, place: Place) -> Text:
    """The place where a rate is computed in words, such as d = 0.1."""
    parameters = place.parameters
    if (followed := case.followed) is not None and column_of(case.key) is FOLLOWED:
        return f"{case.key} = {place.value:.4g} {followed.unit}".rstrip()
    if case.key == BETA:
        return f"{BETA} = {scene.betas[0]:.4g}"
    over = column_of(case.key) if case.key else DISTANCE if parameters.gaps else CA_E if any(parameters.Ca_es) else DE
    if over is DISTANCE:
        return Message("{} = {}", over.name, LENGTH(parameters.gaps[0]))
    return f"{over.name} = {parameters.De if over is DE else max(parameters.Ca_es):.4g}"
