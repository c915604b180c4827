"""Lines of runs and curves: any number of them in the same panel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pairsim.plots.units import Units
from pairsim.results.answer import Zero, zeros_in
from pairsim.results.columns import error_of, suffixes_in
from pairsim.results.curve_table import curve_of
from pairsim.results.table_files import read_table
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
        units: Of the columns.
        curve: Whether it is a master curve and not a run.
        zeros: Distances at which dU of a curve is zero.
        failed: Whether the case failed at its last row.
    """

    parameters: Mapping[str, Any]
    table: Mapping[str, Array]
    y: str
    units: Units
    curve: bool
    zeros: tuple[Zero, ...] = ()
    failed: bool = False

    @property
    def gap(self) -> str:
        """The suffix of the gap's columns."""
        return "".join(suffixes_in([self.y], "dU"))

    @property
    def error(self) -> Array | None:
        """The half-width of what is drawn, where it is known."""
        return self.table.get(error_of(self.y))

    @property
    def d(self) -> str:
        """The column of the distance."""
        return f"d{self.gap}"

    def column(self, name: str) -> str:
        """The column of t, of the distance d, or of what is drawn, y."""
        return {"t": "t", "d": self.d, "y": self.y}[name]

    def smooth(self) -> tuple[Array, Array, Array]:
        """Abscissa, dU and its half-width between the points of a curve of at least two."""
        curve = curve_of(self.table, self.gap)
        assert curve is not None
        fine = fine_distances(curve.d)
        return fine, curve.values(fine), curve.half_widths(fine)

    def drawn(self, x: str, y: str = "y") -> tuple[Array, Array, Array | None]:
        """Abscissa, ordinate and the half-width of dU, as a line shows them.

        Args:
            x, y: As in `column`.
        """
        if self.curve and y == "y" and len(self.table[self.d]) > 1:
            return self.smooth()
        return self.table[self.column(x)], self.table[self.column(y)], self.error if y == "y" else None


def fine_distances(points: Array) -> Array:
    """Distances for a smooth line through points in ascending distance, these among them, ascending."""
    between = np.geomspace(points[0], points[-1], FINE)[1:-1]
    return np.union1d(points, between[(between > points[0]) & (between < points[-1])])


def lines_of(
    directory: Path, parameters: Mapping[str, Any], units: Units, *, curve: bool, failed: bool = False
) -> list[Line]:
    """The lines of a folder, one a gap, or that of U or dp where there is no gap; none before the first row.

    Args:
        directory: Folder of a run or a curve.
        parameters: Of its case.
        units: What it is drawn in.
        curve: Whether it is a curve. One over distances that differ from gap to gap has no line.
        failed: Whether the case failed.

    Raises:
        InputError: The table cannot be read.
    """
    table = units.table(read_table(directory / ("curve.csv" if curve else "series.csv")))
    rows = len(next(iter(table.values())))
    gaps = suffixes_in(table, "dU")
    if not rows or (curve and not (gaps and f"slope{gaps[0]}" in table)):
        return []
    columns = [f"dU{gap}" for gap in gaps] or [f"U{each}" for each in suffixes_in(table, "U")] or ["dp"]
    zeros = units.zeros(zeros_in(read_table(directory / "equilibria.csv", missing_ok=True))) if curve else ()
    many = len(columns) > 1
    return [
        Line({**parameters, "gap": i} if many else parameters, table, name, units, curve, zeros, failed)
        for i, name in enumerate(columns, 1)
    ]


def draw_line(axis: Axes, line: Line, x: str, look: Mapping[str, Any], y: str = "y") -> None:
    """One line with its band, that of a curve with points and zeros; a cross ends that of a case which failed.

    Args:
        axis: The panel.
        line: The line.
        x, y: What is drawn over what, as in `Line.column`.
        look: `color`, `linestyle`, `marker`, and the opacity of its `band`.
    """
    points, values = line.table[line.column(x)], line.table[line.column(y)]
    fine, curve, error = line.drawn(x, y)
    axis.plot(fine, curve, color=look["color"], linestyle=look["linestyle"])
    if error is not None:
        fill(axis, fine, curve, error, look)
    if line.curve or len(points) == 1:
        size = 2.5 if look["marker"] != "." else 3.5
        axis.plot(points, values, look["marker"], color=look["color"], markersize=size)
    for zero in line.zeros:
        draw_zero(axis, zero.d, 0.0, zero, look["color"], xerr=zero.error)
    if line.failed:
        axis.plot(points[-1:], values[-1:], "x", color=look["color"], markersize=5)


def draw_zero(axis: Axes, x: float, y: float, zero: Zero, colour: Any, marker: str = "o", **error: Any) -> None:
    """A zero of dU with the bar of its error, filled where it is stable."""
    look: dict[str, Any] = {"color": colour, "markerfacecolor": colour if zero.stable else "white", "zorder": 5}
    axis.errorbar([x], [y], marker=marker, markersize=ZERO, elinewidth=0.8, linestyle="", **look, **error)


def fill(axis: Axes, x: Array, y: Array, error: Array, look: Mapping[str, Any]) -> None:
    """The band of half-width `error` around a line."""
    error = np.where(np.isfinite(error), error, np.nan)  # between two points alone nothing is known
    axis.fill_between(x, y - error, y + error, color=look["color"], alpha=look["band"], linewidth=0)


def notes(lines: Sequence[Line]) -> list[Any]:
    """Entries of the legend for what else is drawn: bands, zeros, failures."""
    entries: list[Any] = []
    if any(line.error is not None for line in lines):
        entries.append(Patch(color="0.35", alpha=BAND, linewidth=0, label=r"error of $\Delta U$"))
    entries += zero_notes([zero for line in lines for zero in line.zeros])
    if any(line.failed for line in lines):
        entries.append(Line2D([], [], marker="x", linestyle="", color="0.2", label="failed here"))
    return entries


def zero_notes(zeros: Sequence[Zero]) -> list[Line2D]:
    """Entries of the legend for zeros, each with whether it is stable."""
    look: dict[str, Any] = {"marker": "o", "linestyle": "", "markersize": ZERO, "color": "0.2"}
    known = {zero.stable for zero in zeros}
    stable = [Line2D([], [], label="stable zero", **look)] if True in known else []
    open_one = Line2D([], [], label="unstable zero", markerfacecolor="white", **look)
    return [*stable, *([open_one] if False in known else [])]
