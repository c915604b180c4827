"""Whether particles stay on the axis, in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby

import numpy as np

from pairsim.computing.off_axis.columns import (
    AT_REST,
    FREQUENCY,
    GROWTH,
    GROWTH_ERROR,
    RE,
    RE_C,
    RE_C_ERROR,
    TUBE,
    TUBE_LEAST,
    TUBE_MOST,
    VERDICT,
    A,
)
from pairsim.quantities.kinds import LENGTH, POSITION, RATE
from pairsim.quantities.scales import Scales
from pairsim.quantities.text import in_unit, softness, with_error, with_name
from pairsim.record.columns import CA_E, DE, DISTANCE, FOLLOWED, U
from pairsim.record.table import Table
from pairsim.solvers.focus.stability import Verdict

SEEN = 0.05  # relative half-width of a Reynolds number above which it shows in two digits; chosen
WIDE = 0.2  # relative width of the range of a length from which on both ends of the range are given; chosen


type Units = Sequence[Scales] | None
"""The units of each row of a table; None without a `physical` block."""
type Along = tuple[str, str] | None
"""The key that is followed, and the unit of its values if the table has a column for them."""


def answer_of_focus(table: Table, scales: Units, along: Along = None) -> list[str]:
    """The lines of `verdicts_in`, and one on what memory changes."""
    return [*verdicts_in(table, scales, along), *_memory(table, scales)]


def verdicts_in(table: Table, scales: Units, along: Along = None) -> list[str]:
    """A line for each group of neighbouring rows with the same verdict."""
    verdicts = list(table[VERDICT])
    groups = [[row for row, _ in group] for _, group in groupby(enumerate(verdicts), key=lambda each: each[1])]
    return [_line(table, rows, scales, along) for rows in groups]


def _of(scales: Units, row: int) -> Scales | None:
    return None if scales is None else scales[row]


def _line(table: Table, rows: list[int], scales: Units, along: Along) -> str:
    """What the particles do in neighbouring rows of the same verdict."""
    ends = rows if len(rows) == 1 else [rows[0], rows[-1]]
    verdict, where = Verdict(str(table[VERDICT][rows[0]])), _where(table, ends, scales, along)
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
        case Verdict.OSCILLATES:
            once = f"once in {_periods(table, ends, scales)} of tube"
            return f"{subject} oscillates about the axis{where}, {once}: {of} neither decay nor grow."
        case Verdict.NEUTRAL:
            said = "the flow around rigid particles in a liquid without memory is reversible, and inertia decides"
            return f"{subject} neither returns to the axis nor leaves it{where}: {said}."
        case Verdict.UNDECIDED:
            errors = [None if np.isnan(table[GROWTH_ERROR][row]) else table[GROWTH_ERROR][row] for row in ends]
            known = zip(ends, errors, strict=True)
            rates = " to ".join(with_name(_of(scales, row), RATE, table[GROWTH][row], error) for row, error in known)
            stays = f"{subject[0].lower()}{subject[1:]} stays on the axis"
            return f"Whether {stays}{where} is not certain: the growth rate of {of} is {rates}."


def _where(table: Table, ends: list[int], scales: Units, along: Along) -> str:
    """The values of the parameter that is followed, such as " at d = 0.1 to 0.4"; "" if none is."""
    suffixes = table.suffixes(DISTANCE)
    moving = [suffix for suffix in suffixes if np.ptp(table.of(DISTANCE, suffix)) > 0]
    key, unit = along or ("", "")
    if along is not None and table.has(FOLLOWED):
        return f" at {key} = {' to '.join(f'{table[FOLLOWED][row]:.4g}' for row in ends)} {unit}".rstrip()
    if key == DISTANCE.name:
        moving = moving or suffixes
    if moving:
        name = DISTANCE.name + ("" if len(moving) == len(suffixes) else moving[0])
        d = table.of(DISTANCE, moving[0])
        return f" at {name} = {' to '.join(in_unit(_of(scales, row), LENGTH, d[row]) for row in ends)}"
    if np.ptp(table[CA_E]) > 0 or key == CA_E.name:
        return f" at {' to '.join(softness(float(table[CA_E][row]), _of(scales, row)) for row in ends)}"
    if np.ptp(table[DE]) > 0 or key == DE.name:
        return f" at De = {' to '.join(f'{table[DE][row]:.4g}' for row in ends)}"
    return ""


def _tubes(table: Table, ends: list[int], scales: Units) -> str:
    """Lengths of tube with their half-widths, or with their ranges where these are wide and so not symmetric."""
    said = []
    for row in ends:
        tube, least, most = (float(table[column][row]) for column in (TUBE, TUBE_LEAST, TUBE_MOST))
        if most - least < WIDE * tube:
            said.append(with_name(_of(scales, row), POSITION, tube, (most - least) / 2))
        else:
            ends_of = (with_name(_of(scales, row), POSITION, each, digits=2) for each in (least, most))
            said.append(f"{with_name(_of(scales, row), POSITION, tube, digits=2)} ({' to '.join(ends_of)})")
    return " to ".join(said)


def _periods(table: Table, ends: list[int], scales: Units) -> str:
    """Lengths of tube in which particles oscillate once."""
    frequency = np.max([np.abs(each) for each in table.each(FREQUENCY).values()], axis=0)
    velocity = np.mean(list(table.each(U).values()), axis=0)
    lengths = [(row, 2 * math.pi * velocity[row] / frequency[row]) for row in ends]
    return " to ".join(with_name(_of(scales, row), POSITION, length, digits=3) for row, length in lengths)


def _inertia(table: Table, rows: list[int]) -> str:
    """The Reynolds number up to which rows that focus do so, and whether that of the experiment is below it."""
    known = table[RE_C][rows]
    if np.isnan(known).all():
        return ", and inertia does not prevent it, to first order in the Reynolds number"
    row, Re = rows[int(np.nanargmin(known))], table.known(RE)
    least, error = float(table[RE_C][row]), float(table[RE_C_ERROR][row])
    limit = with_error(least, error) if error > SEEN * least else f"{least:.2g}"
    if Re is None:
        return f", as long as the Reynolds number is below about {limit}"
    here = np.asarray(Re)[rows]
    said = " to ".join(dict.fromkeys(f"{each:.2g}" for each in here[[0, -1]]))
    if (here >= known).any():
        return (
            f" without inertia; but from a Reynolds number of about {limit} on inertia drives particles off the "
            f"axis, and here it is {said}"
        )
    return f", as long as the Reynolds number is below about {limit} (here {said})"


def _memory(table: Table, scales: Units) -> list[str]:
    """A line on the effect of the memory of stresses and shapes on a rate, if it is larger than the error."""
    change = {name: np.abs(table[name] - table[AT_REST.name + name.removeprefix(A.name)]) for name in table.each(A)}
    beyond = {name: each - np.nan_to_num(table[_error(name)], nan=np.inf) for name, each in change.items()}
    name = max(beyond, key=lambda each: float(beyond[each].max()))
    row = int(beyond[name].argmax())
    if beyond[name][row] <= 0:
        return []
    at_rest, units = AT_REST.name + name.removeprefix(A.name), _of(scales, row)
    rate, rest = (in_unit(units, RATE, float(table[each][row])) for each in (name, at_rest))
    return [f"Stresses and shapes remember where particles were: {name} = {rate}, and {rest} without this memory."]


def _error(name: str) -> str:
    return f"{A.name}_error{name.removeprefix(A.name)}"
