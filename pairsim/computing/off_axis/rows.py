"""Rows of tables of rates off the axis."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pairsim.analysis.rows_of_points import point_row
from pairsim.cases.case import SceneCase
from pairsim.computing.off_axis.columns import (
    A_ERROR,
    AT_REST,
    FREQUENCY,
    GROWTH,
    GROWTH_ERROR,
    INTERVALS,
    MATRIX,
    MODE_GROWTH,
    RE,
    RE_C,
    RE_C_ERROR,
    TUBE,
    TUBE_LEAST,
    TUBE_MOST,
    UNKNOWNS,
    VERDICT,
    A,
)
from pairsim.computing.steady import health_columns
from pairsim.quantities.kinds import RATE
from pairsim.quantities.scales import Scales
from pairsim.record.column import Column, names_of, table_row
from pairsim.record.columns import CA_E, DE, DISTANCE, NEWTON, U_ERROR, U
from pairsim.runtime.message import Message, Text
from pairsim.solvers.curves.point import Point
from pairsim.solvers.focus.stability import Stability, Verdict
from pairsim.solvers.parameters import Parameters


def stability_row(place: Parameters, point: Point, stability: Stability) -> dict[str, float | str]:
    """The values of a row of focus.csv that follow from the stability, and the parameters as requested."""
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
        RE_C: _known(stability.Re_c),
        RE_C_ERROR: _known(stability.Re_c_error),
        A: found.rates.ravel(),
        A_ERROR: np.where(np.isfinite(stability.half_widths), stability.half_widths, np.nan).ravel(),
        AT_REST: found.at_rest.ravel(),
        MODE_GROWTH: stability.growth.real,
        FREQUENCY: stability.growth.imag,
        UNKNOWNS: len(found.fields),
    }
    return {**table_row(len(found.rates), values), VERDICT.name: stability.verdict.value}


def tube_lengths(U: float, growth: float, error: float, verdict: Verdict) -> tuple[float, float, float]:
    """The length of tube within which a displacement falls or grows by a factor of ten, and its range [D_c].

    Args:
        U: Velocity of the particles [U_av].
        growth: Growth rate of the displacement [U_av/D_c].
        error: Half-width of the growth rate [U_av/D_c].
        verdict: The verdict.

    Returns:
        The length, its least and its largest value; nan unless displacements surely decay or grow.
    """
    if verdict not in (Verdict.FOCUSES, Verdict.LEAVES):
        return math.nan, math.nan, math.nan
    tube, rate = math.log(10) * U, abs(growth)
    return tube / rate, tube / (rate + error), tube / (rate - error)


def _known(value: float) -> float:
    """A number of the table, nan where it is infinite."""
    return value if math.isfinite(value) else math.nan


def names_of_rows(case: SceneCase, more: Sequence[Column] = (), n: int | None = None) -> list[str]:
    """The names of the columns of a table of rates, for n particles; by default for all particles of the case."""
    count = case.n if n is None else n
    density = [] if case.reynolds_number is None else [RE]
    columns = [DISTANCE, CA_E, DE, *more, U, U_ERROR, *INTERVALS, *density, *MATRIX, NEWTON, UNKNOWNS]
    return [*names_of(count, *columns), *health_columns(case)]


def row_of(
    case: SceneCase, place: Parameters, point: Point, stability: Stability, scales: Scales | None = None
) -> dict[str, float | str]:
    """A row of such a table.

    Args:
        case: The case.
        place: The parameters as requested.
        point: The solution at these.
        stability: Its stability against displacements from the axis.
        scales: The units at these; None without a `physical` block.
    """
    row: dict[str, float | str] = {**point_row(point), **stability_row(place, point, stability)}
    Re = None if scales is None or case.experiment is None else case.experiment.reynolds_number(scales)
    return row if Re is None else row | {RE.name: Re}


def progress_line(place: Text, stability: Stability) -> Message:
    """A line of progress."""
    said = Message("{}  growth = {}", place, RATE(float(stability.growth[0].real)))
    return Message("{}  {}", said, stability.verdict.value)


def warnings_of(remembered: Sequence[Text]) -> list[Text]:
    """The warning of places at which displacements change faster than stresses are forgotten."""
    if not remembered:
        return []
    said = (
        "at {} displacements change before the stress is forgotten: growth is that of the slowest mode of particles "
        "and stresses together, without half-width, and a_ij are rates at rest"
    )
    return [Message(said, Message.joined(", ", remembered))]
