"""Plot a study: error against wall time, with a line for each family of meshes and of steps."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from pairsim.plots.chart import Line, Panel, draw_chart
from pairsim.plots.parameters import shown
from pairsim.plots.style import COLOURS, MARKERS, SMALL, Look, Page, printing
from pairsim.record.columns import WALL_TIME
from pairsim.record.table_files import read_table
from pairsim.record.tables import frame_of
from pairsim.runtime.errors import InputError
from pairsim.sweeps.folder import read_sweep
from pairsim.sweeps.study_table import ERROR, FAMILIES, STUDY_COLUMNS, TABLE, families, settings_of

WORDS = "solid lines: only the cells differ; dotted lines: only the time steps differ"


@printing()
def plot_study(directory: Path, out: Path | None = None, page: Page | None = None) -> list[Path]:
    """Draw `study` from study.csv into the folder of the study, or into `out`; returns the files written.

    Nothing is drawn as long as no error is known.

    Raises:
        InputError: The folder is not that of a study.
    """
    if not (directory / "sweep.json").is_file():
        raise InputError(str(directory), "", None, "must be the folder of a study of this version; compute it again")
    table = frame_of(read_table(directory / TABLE, STUDY_COLUMNS))
    if ERROR.name not in table or (points := table[table[ERROR.name] > 0]).empty:
        return []
    meshes, steps = (list(families(points, family)) for family in FAMILIES)
    dotted: Look = {"color": "0.6", "linestyle": ":", "zorder": 1}
    series = [_line(group, dotted) for group in steps if len(group) > 1]
    for i, group in enumerate(meshes):
        look: Look = {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[i % len(MARKERS)], "markersize": 4.5}
        label = _words(group.iloc[0], of_mesh=False) or "as in the file"
        series.append(_line(group, look, label, range(len(group))))
    names = list(table.columns)
    question = read_sweep(directory, values=False).question
    compared = question.tables[question.table].column(names[names.index(WALL_TIME.name) + 1].partition("@")[0])
    error = f"error of ${compared.symbol}$  [${compared.unit.tex or '-'}$]"
    panel = Panel("wall time  [s]", error, wide="x", margins=(0.2, 0.14))  # labels stand right of their points
    figure, (axes,) = draw_chart(page or Page(), {0: panel}, series, [WORDS])
    axes.set_yscale("log")
    for i, group in enumerate(meshes):
        for _, row in group.iterrows():
            place, beside = (row[WALL_TIME.name], row[ERROR.name]), (4, -9 if i % 2 else 3)
            words = _words(row, of_mesh=True)
            axes.annotate(words, place, beside, textcoords="offset points", fontsize=SMALL, color="0.25")
    return (page or Page()).save(figure, out or directory, "study")


def _line(group: pd.DataFrame, look: Look, label: str = "", marked: Sequence[int] = ()) -> Line:
    """The line of a family: error against wall time; points in `marked` get a marker."""
    x, y = (group[name].to_numpy() for name in (WALL_TIME.name, ERROR.name))
    return Line(0, x, y, look={"linewidth": 0.8, "linestyle": "-", **look}, label=label, marked=marked)


def _words(row: pd.Series[Any], of_mesh: bool) -> str:
    """The settings of a row that concern the mesh, or all others, such as Np 20, max_size 0.1."""
    names = [name for name in settings_of(row.index) if name.startswith(FAMILIES["space"]) == of_mesh]
    return ", ".join(f"{name.rpartition('.')[2]} {shown(row[name])}" for name in names if row[name] == row[name] != "")
