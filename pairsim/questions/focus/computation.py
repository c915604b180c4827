"""Rates of displaced particles at each value of what is followed."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from itertools import chain

from pairsim.computing import events
from pairsim.computing.off_axis.columns import NAME
from pairsim.computing.off_axis.rows import names_of_rows, row_of, said_of, warnings_of
from pairsim.computing.problems import steady_problem
from pairsim.computing.steady import Solutions, together
from pairsim.quantities.kinds import LENGTH
from pairsim.questions.focus import BETA, FocusCase, Place, column_of
from pairsim.questions.focus.fields import disturbed_frame
from pairsim.record.columns import CA_E, DE, DISTANCE, FOLLOWED
from pairsim.record.run_entries import POINTS
from pairsim.runtime.message import Message, Text
from pairsim.runtime.monitor import Monitor
from pairsim.runtime.text import counted
from pairsim.solvers import goals
from pairsim.solvers.focus.stability import Stability
from pairsim.solvers.steady.ends import Ended


def computation(case: FocusCase, monitor: Monitor) -> events.Events:
    """Solve the steady states, and displace the particles in each; arguments as for `solve`."""
    values = len(case.series) or 1
    what = f"{counted(values, 'value')} of {case.key}" if case.key else "the case"
    yield events.Begin(what, values)
    over = column_of(case.key) if case.key else None
    names = names_of_rows(case, [FOLLOWED] if over is FOLLOWED else [])
    yield events.Table(NAME, names, ascending=over is DISTANCE)
    solved, remembered = list[Solutions](), list[Text]()
    try:
        for scene in case.scenes:
            solved.append(found := Solutions(scene, (goals.U,)))
            done = sum(len(each.points) for each in solved)
            ended = yield from _of_scene(case, scene, found, monitor, done, remembered)
            if ended is not None:
                return found.outcome_of(ended)
        return events.Outcome("finished", "end", what)
    finally:
        yield from _last_events(solved, warnings_of(remembered))


def _of_scene(
    case: FocusCase, scene: FocusCase, found: Solutions, monitor: Monitor, done: int, remembered: list[Text]
) -> Generator[events.Event, None, Ended | None]:
    """Compute rates on one mesh, the rows of which follow those that are done; returns what ends it early."""
    places = scene.places
    with found:
        branch = found.begin(steady_problem(scene, scene.narrowest, monitor), places[0].parameters)
        if isinstance(branch, Ended):
            return branch
        for count, place in enumerate(places, done + 1):
            point = branch.at(place.parameters)
            if isinstance(point, Ended):
                return point
            monitor.check()
            stability = Stability.of(branch.solver)
            found.points.append(point)
            at = _said(case, scene, place)
            if not stability.disturbance.converged:
                remembered.append(at)
            value = scene.betas[0] if case.key == BETA else place.value
            if case.fields:
                yield events.Frame(disturbed_frame(value, branch.solver, stability))
            row = row_of(scene, place.parameters, point, stability, place.scales)
            yield events.Row(NAME, row | {FOLLOWED.name: value})
            yield events.Progress(count, said_of(at, stability), count)
    return None


def _last_events(solved: Sequence[Solutions], warnings: Sequence[Text]) -> Generator[events.Event, None, None]:
    """What run.json says of all scenes, and the solutions on the way to what was not reached."""
    points = sum(len(each.points) for each in solved)
    if len(solved) == 1:
        yield from solved[0].last_events({POINTS: points}, warnings)
        return
    yield together([each.summary({}, ()) for each in solved], {POINTS: points}, warnings)
    yield from chain.from_iterable(list(each.last_events({}))[1:] for each in solved[-1:])


def _said(case: FocusCase, scene: FocusCase, place: Place) -> Text:
    """Where a rate is computed, such as d = 0.1."""
    parameters = place.parameters
    if (followed := case.followed) is not None and column_of(case.key) is FOLLOWED:
        return f"{case.key} = {place.value:.4g} {followed.unit}".rstrip()
    if case.key == BETA:
        return f"{BETA} = {scene.betas[0]:.4g}"
    over = column_of(case.key) if case.key else DISTANCE if parameters.gaps else CA_E if any(parameters.Ca_es) else DE
    if over is DISTANCE:
        return Message("{} = {}", over.name, LENGTH(parameters.gaps[0]))
    return f"{over.name} = {parameters.De if over is DE else max(parameters.Ca_es):.4g}"
