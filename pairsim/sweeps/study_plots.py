"""Plot a study: error against wall time, with a line and its observed orders for each family."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.axes import Axes

from pairsim.plots.chart import Panel, Series, draw_chart
from pairsim.plots.labels import shown
from pairsim.plots.style import COLOURS, MARKERS, SMALL, Page, printing
from pairsim.results.columns import column
from pairsim.results.table_files import read_table
from pairsim.results.tables import frame_of
from pairsim.sweeps.study import FAMILIES, TABLE, families, settings_of

NOTE: dict[str, Any] = {"textcoords": "offset points", "fontsize": SMALL}
ORDERS = "numbers: observed orders, at lines in the size of cells, at dots in that of steps"


@printing()
def plot_study(directory: Path, out: Path | None = None, page: Page | None = None) -> list[Path]:
    """Draw `study` from study.csv, into the folder of the study or another; returns the files written.

    There are none while no error is known.
    """
    table = frame_of(read_table(directory / TABLE))
    if "error" not in table or (points := table[table["error"] > 0]).empty:
        return []
    page = page or Page()
    series = []
    for i, group in enumerate(families(points, "space")):
        look = {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[i % len(MARKERS)], "markersize": 4.5}
        label = _words(group.iloc[0], of_mesh=False) or "as in the file"
        series.append(_line(group, {**look, "linestyle": "-"}, label, range(len(group))))
    dotted = {"color": "0.6", "linestyle": ":", "zorder": 1}
    series += [_line(group, dotted) for group in families(points, "time") if len(group) > 1]
    compared = column(list(table.columns)[list(table.columns).index("wall_time_spread") + 1].partition("@")[0])
    error = f"error of ${compared.symbol}$  [${compared.unit.tex or '-'}$]"
    panel = Panel("wall time  [s]", error, wide="x", margins=(0.2, 0.14))  # labels stand right of their points
    figure, (axes,) = draw_chart(page, {0: panel}, series, [ORDERS])
    axes.set_yscale("log")
    for i, group in enumerate(families(points, "space")):
        for _, row in group.iterrows():
            place = row["wall_time"], row["error"]
            axes.annotate(_words(row, of_mesh=True), place, (4, -9 if i % 2 else 3), color="0.25", **NOTE)
        _note_orders(axes, group, 2)
    for group in families(points, "time"):
        _note_orders(axes, group, -8)
    return page.save(figure, out or directory, "study")


def _line(group: pd.DataFrame, look: dict[str, Any], label: str = "", marked: Sequence[int] = ()) -> Series:
    """Error against wall time of a family."""
    x, y = (group[name].to_numpy() for name in ("wall_time", "error"))
    return Series(0, x, y, look={"linewidth": 0.8, **look}, label=label, marked=marked)


def _note_orders(axes: Axes, group: pd.DataFrame, below: float) -> None:
    places = group[["wall_time", "error"]]
    middle = ((places * places.shift()) ** 0.5).assign(order=group["order"])
    for x, y, order in middle.dropna().to_numpy():
        axes.annotate(f"{order:.1f}", (x, y), (2, below), color="0.5", **NOTE)


def _words(row: pd.Series[Any], of_mesh: bool) -> str:
    """The settings of the mesh of a row, or its others, such as Np 20, max_size 0.1."""
    names = [name for name in settings_of(row.index) if name.startswith(FAMILIES["space"]) == of_mesh]
    return ", ".join(f"{name.rpartition('.')[2]} {shown(row[name])}" for name in names if row[name] == row[name] != "")
