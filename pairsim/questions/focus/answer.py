"""Whether particles stay on the axis, in words."""

from __future__ import annotations

import math
from itertools import groupby

import numpy as np

from pairsim.quantities.kinds import LENGTH, POSITION, RATE
from pairsim.quantities.scales import Scales
from pairsim.quantities.text import in_unit, softness, with_error, with_name
from pairsim.questions.focus import (
    AT_REST,
    FREQUENCY,
    GROWTH,
    GROWTH_ERROR,
    RE,
    RE_ERROR,
    RE_MOST,
    TUBE,
    TUBE_LEAST,
    TUBE_MOST,
    VERDICT,
    A,
)
from pairsim.record.columns import CA_E, DE, DISTANCE, U
from pairsim.record.table import Table
from pairsim.solvers.focus.stability import Verdict

SEEN = 0.05  # part of a Reynolds number from which on its half-width would be seen in two digits; chosen
WIDE = 0.2  # part of a length that its range is at least, where both ends of the range are told; chosen


def answer_of_focus(table: Table, scales: Scales | None) -> list[str]:
    """A line for each verdict in turn along what is followed, and what memory changes."""
    verdicts = list(table[VERDICT])
    groups = [[row for row, _ in group] for _, group in groupby(enumerate(verdicts), key=lambda each: each[1])]
    lines = [_line(table, rows, scales) for rows in groups]
    return [*lines, *_memory(table, scales)]


def _line(table: Table, rows: list[int], scales: Scales | None) -> str:
    """What the particles do in neighbouring rows of the same verdict."""
    ends = rows if len(rows) == 1 else [rows[0], rows[-1]]
    verdict, where = Verdict(str(table[VERDICT][rows[0]])), _where(table, ends, scales)
    count = len(table.suffixes(U))
    subject = {1: "The particle", 2: "The pair"}.get(count, f"The row of {count}")
    of = "a small displacement from the axis" if count == 1 else "small displacements from the axis"
    many = count > 1
    match verdict:
        case Verdict.FOCUSES:
            does = "focuses" if count == 1 else "stays on the axis"
            falls = f"{of} fall{'' if many else 's'} to a tenth within {_tubes(table, ends, scales)} of tube"
            return f"{subject} {does}{where}: {falls}{_inertia(table, rows)}."
        case Verdict.LEAVES:
            grows = f"{of} grow{'' if many else 's'} tenfold within {_tubes(table, ends, scales)} of tube"
            return f"{subject} does not stay on the axis{where}: {grows}."
        case Verdict.SWINGS:
            once = f"once in {_periods(table, ends, scales)} of tube"
            return f"{subject} swings about the axis{where}, {once}: {of} neither decay nor grow."
        case Verdict.STAYS:
            said = "the flow around rigid particles in a Newtonian liquid is reversible, and inertia decides"
            return f"{subject} neither returns to the axis nor leaves it{where}: {said}."
        case Verdict.UNDECIDED:
            errors = [None if np.isnan(table[GROWTH_ERROR][row]) else table[GROWTH_ERROR][row] for row in ends]
            known = zip(ends, errors, strict=True)
            rates = " to ".join(with_name(scales, RATE, table[GROWTH][row], error) for row, error in known)
            stays = f"{subject[0].lower()}{subject[1:]} stays on the axis"
            return f"Whether {stays}{where} is not certain: the growth rate of {of} is {rates}."


def _where(table: Table, ends: list[int], scales: Scales | None) -> str:
    """The values of what is followed, such as " at d = 0.1 to 0.4"; "" where nothing is."""
    suffixes = table.suffixes(DISTANCE)
    distances = [table.of(DISTANCE, suffixes[0])] if suffixes else []
    if any(np.ptp(each) > 0 for each in distances):
        return f" at d = {' to '.join(in_unit(scales, LENGTH, distances[0][row]) for row in ends)}"
    if np.ptp(table[CA_E]) > 0:
        return f" at {' to '.join(softness(float(table[CA_E][row]), scales) for row in ends)}"
    if np.ptp(table[DE]) > 0:
        return f" at De = {' to '.join(f'{table[DE][row]:.4g}' for row in ends)}"
    return ""


def _tubes(table: Table, ends: list[int], scales: Scales | None) -> str:
    """Lengths of tube with their half-widths, or with their ranges where these are wide and so not symmetric."""
    said = []
    for row in ends:
        tube, least, most = (float(table[column][row]) for column in (TUBE, TUBE_LEAST, TUBE_MOST))
        if most - least < WIDE * tube:
            said.append(with_name(scales, POSITION, tube, (most - least) / 2))
        else:
            from_to = " to ".join(with_name(scales, POSITION, each, digits=2) for each in (least, most))
            said.append(f"{with_name(scales, POSITION, tube, digits=2)} ({from_to})")
    return " to ".join(said)


def _periods(table: Table, ends: list[int], scales: Scales | None) -> str:
    """Lengths of tube in which particles swing once."""
    frequency = np.max([np.abs(each) for each in table.each(FREQUENCY).values()], axis=0)
    velocity = np.mean(list(table.each(U).values()), axis=0)
    lengths = [2 * math.pi * velocity[row] / frequency[row] for row in ends]
    return " to ".join(with_name(scales, POSITION, length, digits=3) for length in lengths)


def _inertia(table: Table, rows: list[int]) -> str:
    """Up to which Reynolds number this holds, of rows that focus, and whether it does in the experiment."""
    known = table[RE_MOST][rows]
    if np.isnan(known).all():
        return ", and inertia does not prevent it, to first order in the Reynolds number"
    row, Re = rows[int(np.nanargmin(known))], table.known(RE)
    least, error = float(table[RE_MOST][row]), float(table[RE_ERROR][row])
    limit = with_error(least, error) if error > SEEN * least else f"{least:.2g}"
    if Re is not None and Re[rows[0]] >= least:
        return (
            f" without inertia; but from a Reynolds number of about {limit} on inertia drives particles off the "
            f"axis, and here it is {Re[rows[0]]:.2g}"
        )
    here = "" if Re is None else f" (here {Re[rows[0]]:.2g})"
    return f", as long as the Reynolds number is below about {limit}{here}"


def _memory(table: Table, scales: Scales | None) -> list[str]:
    """A line on what it changes that stresses and shapes remember displacements, where that is more than the error."""
    change = {name: np.abs(table[name] - table[AT_REST.name + name.removeprefix(A.name)]) for name in table.each(A)}
    beyond = {name: each - np.nan_to_num(table[_error(name)], nan=np.inf) for name, each in change.items()}
    name = max(beyond, key=lambda each: float(beyond[each].max()))
    row = int(beyond[name].argmax())
    if beyond[name][row] <= 0:
        return []
    rate, rest = (
        in_unit(scales, RATE, float(table[each][row])) for each in (name, AT_REST.name + name.removeprefix(A.name))
    )
    return [f"Stresses and shapes remember where particles were: {name} = {rate}, and {rest} without that."]


def _error(name: str) -> str:
    return f"{A.name}_error{name.removeprefix(A.name)}"
