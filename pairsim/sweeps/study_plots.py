"""Plot a study: error against wall time, with the Pareto front."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from matplotlib.ticker import LogLocator, NullFormatter

from pairsim.plots.labels import case_parts, read_case
from pairsim.plots.style import COLOURS, MARKERS, SMALL, Page, key, printing, small_print
from pairsim.results.columns import column
from pairsim.runtime.errors import InputError
from pairsim.sweeps.study_file import TABLE


@printing()
def plot_study(directory: Path, out: Path | None = None, page: Page | None = None) -> list[Path]:
    """Draw `study` from study.csv.

    Args:
        directory: Folder of a study, finished or not.
        out: Folder of the picture, made if needed; the study's own by default.
        page: What it is drawn for.

    Returns:
        The files written; none while no error is known.

    Raises:
        InputError: The folder is not that of a study.
    """
    try:
        with (directory / TABLE).open(encoding="utf-8", newline="") as file:
            table = list(csv.DictReader(file))
    except OSError as error:
        raise InputError(str(directory), "", None, f"must be the folder of a study ({error})") from error
    settings = list(table[0])[: list(table[0]).index("status")]
    points = [row for row in table if float(row.get("error") or 0) > 0 and row.get("wall_time")]
    if not points:
        return []
    page = (page or Page()).alone()
    figure = page.figure(85)
    axes = figure.subplots()
    time_settings = [name for name in settings if name == "command" or name.startswith("time.")]
    series: dict[str, list[dict[str, Any]]] = {}
    for row in points:
        series.setdefault(_label(row, time_settings), []).append(row)
    others = [name for name in settings if name not in time_settings]
    handles: list[Any] = []
    for i, (label, rows) in enumerate(series.items()):
        x, y = [float(row["wall_time"]) for row in rows], [float(row["error"]) for row in rows]
        look: dict[str, Any] = {
            "marker": MARKERS[i % len(MARKERS)],
            "color": COLOURS[i % len(COLOURS)],
            "linestyle": "",
        }
        handles += axes.plot(x, y, label=label or "as in the file", markersize=4.5, **look)
        for row, place in zip(rows, zip(x, y, strict=True), strict=True):
            axes.annotate(_label(row, others), place, (4, 3), textcoords="offset points", fontsize=SMALL, color="0.25")
    front = sorted((float(row["wall_time"]), float(row["error"])) for row in points if row["pareto"] == "true")
    if front:  # a row without any error beats all, and has no place on a logarithmic axis
        label = "cheapest for its error"
        handles += axes.step(*zip(*front, strict=True), where="post", color="0.4", zorder=1, label=label)
    compared = column(next((name.partition("@")[0] for name in table[0] if "@" in name), "d_cr"))
    label = f"error of ${compared.symbol}$  [${compared.unit or '-'}$]"
    axes.set(xscale="log", yscale="log", xlabel="wall time  [s]", ylabel=label)
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.margins(0.14)
    key(figure, handles)
    small_print(figure, _shared(directory))
    return page.save(figure, out or directory, "study")


def _shared(directory: Path) -> list[str]:
    """The parameters of a case of the study: they are the same in all."""
    found = sorted(directory.glob("sweep-*/**/case.yaml"))
    return case_parts(read_case(found[0])) if found else []


def _label(row: dict[str, Any], keys: list[str]) -> str:
    """Label of some settings, such as Np 20, tol 0.0003."""
    return ", ".join(f"{key.rpartition('.')[2]} {row[key]}" for key in keys if row[key])
