"""Critical distances over the parameter that was followed."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np

from pairsim.plots.chart import ENDS, ZEROS, Panel, Series, draw_chart, point
from pairsim.plots.labels import parts_along, read_case
from pairsim.plots.style import Page, printing
from pairsim.plots.units import Units
from pairsim.results.table_files import read_table


@printing()
def draw_critical(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `critical`: d_cr over the parameter that was followed, one line a branch, dashed where it is unstable.

    No file is written where no parameter was followed, or nothing was found yet.

    Raises:
        InputError: The folder is not that of critical distances.
    """
    case = read_case(directory / "case.yaml")
    units = Units.of(directory, page.physical)
    table = units.table(read_table(directory / "critical.csv"))
    name = next(iter(case.get("along") or {}), "")
    if not name or not len(table["d_cr"]):
        return []
    label, places = units.followed(case, name, values := table[name])
    table |= {name: places, "parameter_error": table["parameter_error"] * places / values}
    rows = [dict(zip(table, values, strict=True)) for values in zip(*table.values(), strict=True)]
    series = []
    for first, second in itertools.pairwise(rows):
        if first["branch"] == second["branch"]:
            end = second if first["kind"] == "vanishes" else first  # what vanishes is neither: the other end tells
            x, y = (np.array([first[column], second[column]]) for column in (name, "d_cr"))
            series.append(Series(0, x, y, look={"linestyle": "-" if end["stable"] else "--"}))
    for row in rows:  # with the interval of the distance or, where two meet, of the parameter
        if mark := ZEROS[bool(row["stable"])] if row["kind"] == "wanted" else ENDS.get(row["kind"], ""):
            errors = row["d_error"], row["parameter_error"]
            series.append(point(0, row[name], row["d_cr"], mark, *errors, parameters=row))
    # The error of a distance grows without bound towards a fold.
    panel = Panel(label, units.axis_label(["d_cr"]), wide="xy", margins=(0.05, 0.15), bars=False)
    figure, _ = draw_chart(page, {0: panel}, series, parts_along(case, name, units.scales is not None))
    return page.save(figure, out, "critical")
