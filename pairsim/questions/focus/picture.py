"""The picture of growth rates over the followed key."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.computing.loading import case_of
from pairsim.computing.off_axis.columns import GROWTH, RE_C, TABLE, A
from pairsim.plots.chart import POINT, Line, Panel, draw_chart
from pairsim.plots.labels import parameter_label, parts_along, read_case, tex_number
from pairsim.plots.parameters import measured
from pairsim.plots.style import COLOURS, LINES, Look, Page, printing
from pairsim.plots.units import Units
from pairsim.quantities.kinds import LENGTH
from pairsim.quantities.scales import Scales
from pairsim.questions.focus import QUESTION, column_of
from pairsim.record.columns import DISTANCE, FOLLOWED
from pairsim.record.table import Table
from pairsim.record.table_files import read_table


def scales_at(directory: Path, units: Units) -> Callable[[float], Scales | None]:
    """The units of a picture as a function of the value of the followed key, on which they may depend (flow rate)."""
    followed = case_of(QUESTION, directory / "case.yaml").followed if units.scales is not None else None

    def at(value: float) -> Scales | None:
        return units.scales if followed is None else followed.scales(value)

    return at


@printing()
def draw_focus(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `focus`: the largest growth rate, entries of the matrix of several particles, and the Reynolds number.

    No file is written if no key is followed.
    """
    units, case = Units.of(directory, page.physical), read_case(directory / "case.yaml")
    found = read_table(directory / "focus.csv", TABLE, missing_ok=True)
    scales = scales_at(directory, units)
    table = found.converted(units.scales)
    if found.has(FOLLOWED) and found.rows:
        rows = [found.where([row]).converted(scales(value)) for row, value in enumerate(found[FOLLOWED])]
        table = Table({name: np.concatenate([row[name] for row in rows]) for name in found}, found.declared)
    key = case.followed
    if not key or not table.rows:
        return []
    followed = column_of(key).with_suffix("")
    if followed.name == DISTANCE.name:
        label, x = units.axis_label([followed]), table.of(DISTANCE, table.suffixes(DISTANCE)[0])
    elif followed.name == FOLLOWED.name:
        known = measured(case.values_followed)
        label, x = parameter_label(key, known[1] if known is not None else ""), table[FOLLOWED]
    else:
        label, x = units.followed(case, followed, table[key])
    panels: dict[Any, Panel] = {GROWTH: Panel(label, units.axis_label([GROWTH]), wide="x")}
    joined: Look = {"linestyle": "-"}
    lines = [Line(GROWTH, x, table[GROWTH], table.half_widths(GROWTH), mark=POINT, look=joined)]
    if len(entries := table.suffixes(A)) > 1:
        shown = [suffix for suffix in entries if suffix.startswith("_1")]  # the motion of the first particle
        columns = [A.with_suffix(suffix) for suffix in shown]
        panels[A] = Panel(label, units.axis_label(columns), wide="x")
        for i, (suffix, entry) in enumerate(zip(shown, columns, strict=True)):
            own: Look = {"color": COLOURS[i % len(COLOURS)], "linestyle": LINES[i % len(LINES)]}
            bars = table.half_widths(A, suffix)
            lines.append(Line(A, x, table[entry], bars, mark=POINT, look=own, label=f"${entry.symbol}$"))
    if np.nan_to_num(table[RE_C]).any():
        panels[RE_C] = Panel(label, units.axis_label([RE_C]), wide="x")
        lines.append(Line(RE_C, x, table[RE_C], table.half_widths(RE_C), mark=POINT, look=joined))
    parts = parts_along(case, key, units.scales is not None)
    if followed.name != DISTANCE.name and (gaps := table.each(DISTANCE)):
        distances = dict.fromkeys(tex_number(values[0]) for values in gaps.values())
        parts.append(f"$d = {', '.join(distances)}$ {units.name(LENGTH)}")
    figure, _ = draw_chart(page, panels, lines, parts)
    return page.save(figure, out, "focus")
