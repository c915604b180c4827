"""The picture of questions about one particle over Ca_e."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pairsim.plots.chart import POINT, Panel, Series, draw_chart
from pairsim.plots.labels import parts_along, read_case
from pairsim.plots.style import Page, printing
from pairsim.plots.units import Units
from pairsim.results.table_files import read_table


def draw_along(directory: Path, out: Path, page: Page, name: str, errors: Mapping[str, str]) -> list[Path]:
    """Draw columns of a table over Ca_e or, in an experiment, the modulus, a panel for each; returns the pictures.

    Args:
        directory: Folder of the results.
        out: Folder of the pictures.
        page: What they are drawn on, and in which units.
        name: Name of the table and of the picture.
        errors: Names of the columns, each with that of the column of its half-widths, "" without one.
    """
    units, case = Units.of(directory, page.physical), read_case(directory / "case.yaml")
    table = units.table(read_table(directory / f"{name}.csv"))
    (label, x), joined = units.followed(case, "Ca_e", table["Ca_e"]), {"linestyle": "-"}
    series = [Series(n, x, table[n], table.get(error), mark=POINT, look=joined) for n, error in errors.items()]
    panels = {n: Panel(label, units.axis_label([n]), wide="x") for n in errors}
    with printing():
        parts = parts_along(case, "Ca_e", units.scales is not None)
        figure, _ = draw_chart(page, panels, series, parts)
        return page.save(figure, out, name)
