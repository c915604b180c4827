"""Lines of runs and curves: any number of them in the same panel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.plots.chart import FAILED, ZEROS, Series, point
from pairsim.plots.units import Units
from pairsim.results.columns import error_of, suffixes_in
from pairsim.results.curve_table import Zero, curve_of, zeros_in
from pairsim.results.table_files import read_table
from pairsim.runtime.arrays import Array

FINE = 400  # points of a smooth line


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


def series_of(line: Line, panel: int, x: str, look: Mapping[str, Any], y: str = "y") -> list[Series]:
    """What is drawn of a line: that of a curve has points and zeros; a cross ends that of a case which failed.

    Args:
        line: The line.
        panel: Number of the panel.
        x, y: What is drawn over what, as in `Line.column`.
        look: `color`, `linestyle` and `marker`.
    """
    points, values = line.table[line.column(x)], line.table[line.column(y)]
    fine, curve, error = line.drawn(x, y)
    look = {**look, "markersize": 3.5 if look["marker"] == "." else 2.5}
    marked = np.searchsorted(fine, points).tolist() if line.curve else ()
    t = None if line.curve else line.table.get("t")
    found = [Series(panel, fine, curve, look, error, marked=marked, t=t)]
    colour = {"color": look["color"]}
    for zero in line.zeros:
        found.append(point(panel, zero.d, 0.0, ZEROS[zero.stable], colour, x_error=zero.error))
    if line.failed:
        found.append(point(panel, points[-1], values[-1], FAILED, colour))
    return found
