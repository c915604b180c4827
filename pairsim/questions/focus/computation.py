"""Rates of displaced particles at each value of what is followed."""

from __future__ import annotations

import math

import numpy as np

from pairsim.analysis.rows_of_points import point_row
from pairsim.computing import events
from pairsim.computing.problems import steady_problem
from pairsim.computing.steady import Solutions, health_columns
from pairsim.quantities.kinds import LENGTH, RATE
from pairsim.questions.focus import (
    A_ERROR,
    AT_REST,
    FREQUENCY,
    GROWTH,
    GROWTH_ERROR,
    INTERVALS,
    MATRIX,
    MODE_GROWTH,
    RE,
    RE_MOST,
    TUBE,
    TUBE_LEAST,
    TUBE_MOST,
    UNKNOWNS,
    VERDICT,
    A,
    FocusCase,
    column_of,
)
from pairsim.record.column import names_of, table_row
from pairsim.record.columns import CA_E, DE, DISTANCE, NEWTON, U_ERROR, U
from pairsim.record.run_entries import POINTS
from pairsim.runtime.message import Message, Text
from pairsim.runtime.monitor import Monitor
from pairsim.runtime.text import counted
from pairsim.solvers import goals
from pairsim.solvers.curves.branch import Point
from pairsim.solvers.focus.stability import Stability, Verdict
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.ends import Ended


def computation(case: FocusCase, monitor: Monitor) -> events.Events:
    """Solve the steady states, and displace the particles in each; arguments as for `solve`."""
    places, Re = case.places, case.reynolds_number
    what = f"{counted(len(places), 'value')} of {case.key}" if case.key else "the case"
    yield events.Begin(what, len(places))
    columns = [DISTANCE, CA_E, DE, U, U_ERROR, *INTERVALS, *([] if Re is None else [RE]), *MATRIX, NEWTON, UNKNOWNS]
    over = None if not case.key else column_of(case.key)
    names = [*names_of(case.n, *columns), *health_columns(case)]
    yield events.Table("focus", names, ascending=over is DISTANCE)
    found, remembered = Solutions(case, (goals.U,)), list[Text]()
    try:
        with found:
            branch = found.begin(steady_problem(case, case.narrowest, monitor), places[0])
            if isinstance(branch, Ended):
                return found.outcome_of(branch)
            for count, place in enumerate(places, 1):
                point = branch.at(place)
                if isinstance(point, Ended):
                    return found.outcome_of(point)
                monitor.check()
                stability = Stability.of(branch.solver)
                found.points.append(point)
                if not stability.disturbance.converged:
                    remembered.append(_place(case, place))
                of_experiment: dict[str, float | str] = {} if Re is None else {RE.name: Re}
                yield events.Row("focus", point_row(point) | stability_row(place, point, stability) | of_experiment)
                said = Message("{}  growth = {}", _place(case, place), RATE(float(stability.growth[0].real)))
                yield events.Progress(count, Message("{}  {}", said, stability.verdict.value), count)
            return events.Outcome("finished", "end", what)
    finally:
        yield from found.last_events({POINTS: len(found.points)}, _warnings(remembered))


def stability_row(place: Parameters, point: Point, stability: Stability) -> dict[str, float | str]:
    """What a row of focus.csv has beside other values of the point, and its parameters as they were asked for."""
    found, U = stability.disturbance, float(point.observation.U.mean())
    growth, error = float(stability.growth[0].real), stability.growth_error
    tube, least, most = tube_lengths(U, growth, error, stability.verdict)
    values = {
        DISTANCE: place.gaps,
        CA_E: max(place.Ca_es),
        DE: place.De,
        GROWTH: growth,
        GROWTH_ERROR: _known(error),
        **{TUBE: tube, TUBE_LEAST: least, TUBE_MOST: most},
        RE_MOST: _known(stability.Re_most),
        A: found.rates.ravel(),
        A_ERROR: np.where(np.isfinite(stability.half_widths), stability.half_widths, np.nan).ravel(),
        AT_REST: found.at_rest.ravel(),
        MODE_GROWTH: stability.growth.real,
        FREQUENCY: stability.growth.imag,
        UNKNOWNS: len(found.fields),
    }
    return {**table_row(len(found.rates), values), VERDICT.name: stability.verdict.value}


def tube_lengths(U: float, growth: float, error: float, verdict: Verdict) -> tuple[float, float, float]:
    """The length of tube for a displacement that is smaller or larger by a factor of ten, and its range [D_c].

    Args:
        U: Velocity of the particles [U_av].
        growth: Growth rate of the displacement [U_av/D_c].
        error: Its half-width.
        verdict: The verdict; nan unless displacements surely decay or grow.
    """
    if verdict not in (Verdict.FOCUSES, Verdict.LEAVES):
        return math.nan, math.nan, math.nan
    tube, rate = math.log(10) * U, abs(growth)
    return tube / rate, tube / (rate + error), tube / (rate - error)


def _known(value: float) -> float:
    """A number of the table, nan where it is infinite."""
    return value if math.isfinite(value) else math.nan


def _place(case: FocusCase, place: Parameters) -> Text:
    """Where a rate is computed, such as d = 0.1."""
    over = column_of(case.key) if case.key else DISTANCE if place.gaps else CA_E if any(place.Ca_es) else DE
    if over is DISTANCE:
        return Message("{} = {}", over.name, LENGTH(place.gaps[0]))
    return f"{over.name} = {place.De if over is DE else max(place.Ca_es):.4g}"


def _warnings(remembered: list[Text]) -> list[Text]:
    """The warning of places at which displacements change faster than stresses are forgotten."""
    if not remembered:
        return []
    said = (
        "at {} displacements change before the stress is forgotten: growth is that of the slowest mode of particles "
        "and stresses together, without half-width, and a_ij are rates at rest"
    )
    return [Message(said, Message.joined(", ", remembered))]
