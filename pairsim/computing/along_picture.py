"""The picture of questions about one particle over Ca_e."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pairsim.plots.chart import POINT, Line, Panel, draw_chart
from pairsim.plots.labels import parts_along, read_case
from pairsim.plots.style import Look, Page, printing
from pairsim.plots.units import Units
from pairsim.record.column import Columns
from pairsim.record.columns import CA_E
from pairsim.record.table_files import read_table


def draw_along(directory: Path, out: Path, page: Page, name: str, columns: Columns, drawn: Sequence[str]) -> list[Path]:
    """Draw columns of a table over Ca_e or, in an experiment, the modulus, a panel for each; returns the pictures.

    Args:
        directory: Folder of the results.
        out: Folder of the pictures.
        page: What they are drawn on, and in which units.
        name: Name of the table and of the picture.
        columns: The columns of the table.
        drawn: Names of those that are drawn, with their half-widths; columns that an older folder lacks are left out.
    """
    units, case = Units.of(directory, page.physical), read_case(directory / "case.yaml")
    table = read_table(directory / f"{name}.csv", columns).converted(units.scales)
    label, x = units.followed(case, CA_E, table[CA_E])
    joined: Look = {"linestyle": "-"}
    known = {n: table.get(columns.half_width(n)) for n in drawn if n in table}
    lines = [Line(n, x, table[n], error, mark=POINT, look=joined) for n, error in known.items()]
    panels = {n: Panel(label, units.axis_label([columns.column(n)]), wide="x") for n in known}
    with printing():
        parts = parts_along(case, CA_E.name, units.scales is not None)
        figure, _ = draw_chart(page, panels, lines, parts)
        return page.save(figure, out, name)
