"""Lines of runs and curves: any number of them in the same panels."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pairsim.plots.encoding import Encoding
from pairsim.plots.labels import axis_label, equation, finish, spread
from pairsim.plots.style import Page, key, small_print
from pairsim.results.columns import error_column, relative_velocities
from pairsim.results.curve_table import curve_of
from pairsim.results.output import read_series
from pairsim.runtime.arrays import Array

FINE = 400  # points of a smooth line
BAND, TOGETHER = 0.22, 6  # opacity of a band; so many bands over each other are still told apart
ZERO = 4.5  # size of the marker, points


@dataclass(frozen=True)
class Line:
    """What one line of a picture shows.

    Attributes:
        parameters: Of its case, by key; `gap` counts the gaps of three particles or more.
        table: Columns of series.csv or curve.csv.
        y: The column that is drawn.
        curve: Whether it is a master curve and not a run.
        zeros: Distances at which dU of a curve is zero, and whether they are stable.
        failed: Whether the case failed at its last row.
    """

    parameters: Mapping[str, Any]
    table: Mapping[str, Array]
    y: str
    curve: bool
    zeros: tuple[tuple[float, bool], ...] = ()
    failed: bool = False

    @property
    def gap(self) -> str:
        """What the names of the gap's columns end with."""
        return self.y.removeprefix("dU") if self.y.startswith("dU") else ""

    @property
    def d(self) -> str:
        """The column of the distance."""
        return f"d{self.gap}"

    def smooth(self) -> tuple[Array, Array, Array | None]:
        """Abscissa, dU and its half-width between the points of a curve of at least two."""
        curve = curve_of(self.table, self.gap)
        assert curve is not None
        fine = fine_distances(curve.d)
        known = error_column(self.table, self.gap) is not None
        return fine, curve.values(fine), curve.half_widths(fine) if known else None


def fine_distances(points: Array) -> Array:
    """Distances for a smooth line through points in ascending distance, these among them, ascending."""
    between = np.geomspace(points[0], points[-1], FINE)[1:-1]
    return np.union1d(points, between[(between > points[0]) & (between < points[-1])])


def read_zeros(directory: Path) -> tuple[tuple[float, bool], ...]:
    """The zeros of a curve, from equilibria.csv, and whether they are stable; none where the file is missing."""
    path = directory / "equilibria.csv"
    if not path.is_file():
        return ()
    with path.open(encoding="utf-8", newline="") as file:
        return tuple((float(row["d"]), row["stable"] == "true") for row in csv.DictReader(file))


def lines_of(directory: Path, parameters: Mapping[str, Any], *, curve: bool, failed: bool = False) -> list[Line]:
    """The lines of a folder, one a gap, or that of U or dp where there is no gap; none before the first row.

    Args:
        directory: Folder of a run or a curve.
        parameters: Of its case.
        curve: Whether it is a curve. One over distances that differ from gap to gap has no line.
        failed: Whether the case failed.

    Raises:
        InputError: The table cannot be read.
    """
    table = read_series(directory / ("curve.csv" if curve else "series.csv"))
    rows = len(next(iter(table.values())))
    relative = relative_velocities(table)
    if not rows or (curve and not (relative and f"slope{relative[0].removeprefix('dU')}" in table)):
        return []
    columns = relative or [name for name in table if name == "U" or name.startswith("U_")] or ["dp"]
    zeros = read_zeros(directory) if curve else ()
    many = len(columns) > 1
    return [
        Line({**parameters, "gap": i} if many else parameters, table, name, curve, zeros, failed)
        for i, name in enumerate(columns, 1)
    ]


def draw_line(axis: Axes, line: Line, x: str, look: Mapping[str, Any]) -> None:
    """One line with its band, that of a curve with points and zeros; a cross ends that of a case which failed.

    Args:
        axis: The panel.
        line: The line.
        x: Column of the abscissa.
        look: `color`, `linestyle`, `marker`, and the opacity of its `band`.
    """
    plain = {name: look[name] for name in ("color", "linestyle")}
    points, values = line.table[x], line.table[line.y]
    if line.curve and len(points) > 1:
        fine, curve, error = line.smooth()
        axis.plot(fine, curve, **plain)
        if error is not None:
            fill(axis, fine, curve, error, look)
    if line.curve or len(points) == 1:
        axis.plot(points, values, look["marker"], color=look["color"], markersize=2.5 if look["marker"] != "." else 3.5)
    if not line.curve:
        axis.plot(points, values, **plain)
        if (name := error_column(line.table, line.gap)) is not None:
            fill(axis, points, values, line.table[name], look)
    for zero, stable in line.zeros:
        face = look["color"] if stable else "white"
        axis.plot([zero], [0], "o", color=look["color"], markerfacecolor=face, markersize=ZERO, zorder=5)
    if line.failed:
        axis.plot(points[-1:], values[-1:], "x", color=look["color"], markersize=5)


def fill(axis: Axes, x: Array, y: Array, error: Array, look: Mapping[str, Any]) -> None:
    """The band of half-width `error` around a line."""
    error = np.where(np.isfinite(error), error, np.nan)  # between two points alone nothing is known
    axis.fill_between(x, y - error, y + error, color=look["color"], alpha=look["band"], linewidth=0)


def notes(lines: Sequence[Line]) -> list[Any]:
    """Entries of the legend for what else is drawn: bands, zeros, failures."""
    entries: list[Any] = []
    if any(line.y.startswith("dU") and error_column(line.table, line.gap) for line in lines):
        entries.append(Patch(color="0.35", alpha=BAND, linewidth=0, label=r"error of $\Delta U$"))
    entries += zero_notes([zero for line in lines for zero in line.zeros])
    if any(line.failed for line in lines):
        entries.append(Line2D([], [], marker="x", linestyle="", color="0.2", label="failed here"))
    return entries


def zero_notes(zeros: Sequence[tuple[float, bool]]) -> list[Line2D]:
    """Entries of the legend for zeros, each with whether it is stable."""
    entries = []
    for stable in sorted({stable for _, stable in zeros}, reverse=True):
        face, label = ("0.2", "stable zero") if stable else ("white", "unstable zero")
        look: dict[str, Any] = {
            "marker": "o",
            "linestyle": "",
            "markersize": ZERO,
            "color": "0.2",
            "markerfacecolor": face,
        }
        entries.append(Line2D([], [], label=label, **look))
    return entries


def draw_lines(page: Page, lines: Sequence[Line], encoding: Encoding, parts: Sequence[str]) -> Figure:
    """All lines: those of runs against time and distance, those of curves against distance.

    Args:
        page: What it is drawn for.
        lines: At least one, all of runs or all of curves.
        encoding: How they are distinguished.
        parts: What they have in common, for the small print.
    """
    against = [line.d for line in lines[:1] if line.d in line.table]
    against = against if lines[0].curve else ["t", *against]
    rows = encoding.panels
    if len(rows) * len(against) == 1:
        page = page.alone()
    figure, axes = page.panels(len(rows) * len(against), extra=16)
    places = [(value, x) for value in rows for x in against]
    for axis, (value, x) in zip(axes, places, strict=True):
        inside = [line for line in lines if encoding.inside(line.parameters, value)]
        for line in inside:
            case = line.parameters
            look: dict[str, Any] = {"color": encoding.colour_of(case), "linestyle": encoding.line_of(case)}
            look |= {"marker": encoding.marker_of(case), "band": BAND * min(1.0, TOGETHER / len(inside))}
            draw_line(axis, line, x if x == "t" else line.d, look)
        _finish(axis, inside, x)
        if encoding.panel:
            axis.set_title(equation(encoding.panel, value))
    encoding.bar(figure, axes)
    key(figure, [*encoding.handles(points=lines[0].curve), *notes(lines)])
    small_print(figure, parts)
    return figure


def _finish(axis: Axes, lines: Sequence[Line], x: str) -> None:
    if not lines:
        return
    names = list(dict.fromkeys(line.y for line in lines))
    gaps = list(dict.fromkeys(line.d for line in lines)) if x != "t" else ["t"]
    if lines[0].curve:
        spread(axis, "x", [float(v) for line in lines for v in line.table[line.d]])
    finish(axis, axis_label(gaps), axis_label(names), [line.table[line.y] for line in lines])
