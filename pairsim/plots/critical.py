"""Critical distances over the parameter that was followed."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path

from pairsim.plots.chart import ENDS, ZERO_MARKS, Line, Panel, draw_chart, point
from pairsim.plots.labels import parameter_label, parts_along, read_case
from pairsim.plots.parameters import measured
from pairsim.plots.style import Page, printing
from pairsim.plots.units import Units
from pairsim.record.column import Column, Columns
from pairsim.record.columns import BRANCH, CA_E, D_CR, D_ERROR, DE, FOLLOWED, KIND, PARAMETER_ERROR, STABLE
from pairsim.record.table import Table
from pairsim.record.table_files import read_table

TOLD = {each.name: each for each in (CA_E, DE)}
CONVERTED = Columns(D_CR, D_ERROR)
"""The columns that are drawn and have units."""


@printing()
def draw_critical(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `critical`: d_cr over the parameter that was followed, one line a branch, dashed where it is unstable.

    No file is written where no parameter was followed, or nothing was found yet.

    Raises:
        InputError: The folder is not that of critical distances.
    """
    case = read_case(directory / "case.yaml")
    units = Units.of(directory, page.physical)
    table = read_table(directory / "critical.csv", CONVERTED).converted(units.scales)
    name = case.followed
    if not name or not table.rows:
        return []
    number = TOLD.get(name, FOLLOWED)
    values = table[number]
    known = measured(case.values_followed)
    label, places = parameter_label(name, known[1] if known is not None else ""), values
    if name in TOLD:
        label, places = units.followed(case, number, values)
    table |= {number.name: places, PARAMETER_ERROR.name: table[PARAMETER_ERROR] * places / values}
    # The error of a distance grows without bound towards a fold.
    panel = Panel(label, units.axis_label([D_CR]), wide="xy", margins=(0.05, 0.15), bars=False)
    parts = parts_along(case, name, units.scales is not None)
    figure, _ = draw_chart(page, {0: panel}, [*_branches(table, number), *_zeros(table, number)], parts)
    return page.save(figure, out, "critical")


def _branches(table: Table, number: Column) -> Iterator[Line]:
    """The branches of critical distances over the number that was followed, a line for each pair of neighbours."""
    kinds, branches, stable = table[KIND], table[BRANCH], table[STABLE]
    for first, second in itertools.pairwise(range(table.rows)):
        if branches[first] == branches[second]:
            end = second if kinds[first] == "vanishes" else first  # at a fold it is neither: the other end decides
            x, y = (table[column][[first, second]] for column in (number, D_CR))
            yield Line(0, x, y, look={"linestyle": "-" if stable[end] else "--"})


def _zeros(table: Table, number: Column) -> Iterator[Line]:
    """The zeros with the interval of the distance or, where two meet, of the number."""
    for row in range(table.rows):
        kind = table[KIND][row]
        if mark := ZERO_MARKS[bool(table[STABLE][row])] if kind == "wanted" else ENDS.get(kind, ""):
            x, y, *errors = (table[column][row] for column in (number, D_CR, D_ERROR, PARAMETER_ERROR))
            yield point(0, x, y, mark, *errors)
