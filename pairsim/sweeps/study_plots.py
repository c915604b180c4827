"""Plot a study: error against wall time, with the Pareto front."""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pairsim.plots.axes import key, small_print, spread
from pairsim.plots.labels import case_parts, read_case
from pairsim.plots.style import COLOURS, MARKERS, SMALL, Page, printing
from pairsim.results.columns import column
from pairsim.runtime.errors import InputError
from pairsim.sweeps.study_file import TABLE

ALIKE = 0.15  # relative distance of points of which one has the words of both, if they are the same


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
    page = page or Page()
    figure, (axes,) = page.panels(1, height=85, extra=0)
    of_time = [name for name in settings if name == "command" or name.startswith("time.")]
    others = [name for name in settings if name not in of_time]
    series: dict[str, list[dict[str, str]]] = defaultdict(list)
    for row in points:
        series[_label(row, of_time) or "as in the file"].append(row)
    handles: list[Any] = []
    written: list[tuple[str, tuple[float, float]]] = []
    for i, (label, rows) in enumerate(series.items()):
        x, y = ([float(row[name]) for row in rows] for name in ("wall_time", "error"))
        look: dict[str, Any] = {"marker": MARKERS[i % len(MARKERS)], "color": COLOURS[i % len(COLOURS)]}
        handles += axes.plot(x, y, label=label, markersize=4.5, linestyle="", **look)
        for row, place in zip(rows, zip(x, y, strict=True), strict=True):
            near = [
                words for words, at in written if all(abs(b / a - 1) < ALIKE for a, b in zip(place, at, strict=True))
            ]
            written.append((_label(row, others), place))
            if written[-1][0] in near:
                continue
            axes.annotate(
                written[-1][0],
                place,
                (4, -9 if i % 2 else 3),
                textcoords="offset points",
                fontsize=SMALL,
                color="0.25",
            )
    front = sorted((float(row["wall_time"]), float(row["error"])) for row in points if row["pareto"] == "true")
    if front:  # a row without any error beats all, and has no place on a logarithmic axis
        look = {"where": "post", "color": "0.4", "linestyle": "-", "zorder": 1}
        handles += axes.step(*zip(*front, strict=True), label="cheapest for its error", **look)
    compared = column(next((name.partition("@")[0] for name in table[0] if "@" in name), "d_cr"))
    axes.set(yscale="log", xlabel="wall time  [s]", ylabel=f"error of ${compared.symbol}$  [${compared.unit or '-'}$]")
    spread(axes, "x", [float(row["wall_time"]) for row in points])
    axes.margins(x=0.2, y=0.14)  # labels stand right of their points
    key(figure, handles)
    found = sorted(directory.glob("sweep-*/**/case.yaml"))  # but for the discretisation all cases are the same
    small_print(figure, case_parts(read_case(found[0])) if found else [])
    return page.save(figure, out or directory, "study")


def _label(row: Mapping[str, str], keys: Sequence[str]) -> str:
    """Label of some settings, such as Np 20, tol 0.0003."""
    return ", ".join(f"{key.rpartition('.')[2]} {row[key]}" for key in keys if row[key])
