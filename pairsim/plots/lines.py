"""The columns of runs and curves as series: panels are named after the quantities, such as ("t", "dU")."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from pairsim.plots.chart import FAILED, ZEROS, Panel, Series, point
from pairsim.plots.style import COLOURS, LINES, MARKERS, ORDERED
from pairsim.plots.units import Units
from pairsim.results.columns import column, error_of, suffixes_in
from pairsim.results.curve_table import curve_of, over, zeros_in
from pairsim.results.folder import SERIES
from pairsim.results.table_files import read_table
from pairsim.runtime.arrays import Array

FINE = 400  # points of a smooth line
MOTION = ("dU", "U", "dp")
"""What tells best how particles move: relative velocities, that of a single one, or the pressure drop without any."""


def fine_distances(points: Array) -> Array:
    """Distances for a smooth line through points in ascending distance, these among them, ascending."""
    between = np.geomspace(points[0], points[-1], FINE)[1:-1]
    return np.union1d(points, between[(between > points[0]) & (between < points[-1])])


def lines_of(
    directory: Path, units: Units, parameters: Mapping[str, Any] | None = None, *, curve: bool, failed: bool = False
) -> list[Series]:
    """What can be drawn of the folder of a run or a curve; nothing before the first row.

    The parameters are those of its case; `gap` counts the gaps of three particles or more. If it failed, a cross ends
    its lines.

    Raises:
        InputError: The table cannot be read.
    """
    table = units.table(read_table(directory / ("curve.csv" if curve else SERIES)))
    if not len(next(iter(table.values()))):
        return []
    if not curve:
        return run_lines(table, parameters or {}, failed=failed)
    zeros = units.table(read_table(directory / "equilibria.csv", missing_ok=True))
    return curve_lines(table, parameters or {}, zeros, failed=failed)


def run_lines(
    table: Mapping[str, Array], parameters: Mapping[str, Any], *, failed: bool = False, places: bool = False
) -> list[Series]:
    """Distances, motion and D of a run over time, and relative velocities over distance, of at least one row.

    With `places` the positions of the particles, relative to their mean, are drawn, too; for the rest see `lines_of`.
    """
    motion = next(name for name in MOTION if suffixes_in(table, name))
    found = []
    for x, y in (("t", "d"), ("t", motion), ("t", "D"), *([("d", "dU")] if motion == "dU" else [])):
        for ending, own in _of_each(suffixes_in(table, y), parameters):
            columns = x if x == "t" else x + ending, y + ending
            over, values = (table[name] for name in columns)
            more: dict[str, Any] = {"columns": columns, "parameters": own}
            found.append(Series((x, y), over, values, table.get(error_of(columns[1])), t=table["t"], **more))
            if failed:
                found.append(point((x, y), over[-1], values[-1], FAILED, **more))
    if places and (endings := suffixes_in(table, "z")):
        mean = np.mean([table[f"z{ending}"] for ending in endings], axis=0)
        for ending, own in _of_each(endings, parameters):
            line = Series(("t", "z"), table["t"], table[f"z{ending}"] - mean, t=table["t"], parameters=own)
            found.append(replace(line, columns=("t", f"z{ending}")))
    return found


def curve_lines(
    table: Mapping[str, Array], parameters: Mapping[str, Any], zeros: Mapping[str, Array], *, failed: bool = False
) -> list[Series]:
    """dU of a curve over d with its points and its zeros, and D; nothing over distances that differ from gap to gap.

    The table has at least one row, the zeros are equilibria.csv; for the rest see `lines_of`.
    """
    gaps = suffixes_in(table, "dU")
    if not gaps or not {f"slope{gaps[0]}", f"dU_half{gaps[0]}"} & table.keys():
        return []
    found = []
    for ending, own in _of_each(gaps, parameters):
        columns = over(table, ending), f"dU{ending}"
        points, values = (table[name] for name in columns)
        fine, smooth, error = points, values, table.get(error_of(columns[1]))
        if (curve := curve_of(table, ending)) is not None:
            fine = fine_distances(points)
            smooth, error = curve.values(fine), curve.half_widths(fine)
        more: dict[str, Any] = {"columns": columns, "parameters": own}
        marked = np.searchsorted(fine, points).tolist()
        found.append(Series(("d", "dU"), fine, smooth, error, marked=marked, **more))
        for name in (each + ending for each in ("dU_half", "dU_quarter") if not parameters and each + ending in table):
            found.append(Series(("d", "dU"), points, table[name], **more | {"columns": (columns[0], name)}))
        for zero in zeros_in(zeros):
            found.append(point(("d", "dU"), zero.d, 0.0, ZEROS[zero.stable], x_error=zero.error, **more))
        if failed:
            found.append(point(("d", "dU"), points[-1], values[-1], FAILED, **more))
    points = table[x := over(table, gaps[0])]
    fine = fine_distances(points)
    for ending in suffixes_in(table, "D"):
        columns = x, f"D{ending}"
        shapes = table[columns[1]]
        if len(points) > 1:  # smooth lines over log d, which do not overshoot
            shapes = scipy.interpolate.PchipInterpolator(np.log(points), shapes)(np.log(fine))
        marked = np.searchsorted(fine, points).tolist()
        found.append(Series(("d", "D"), fine, shapes, columns=columns, parameters=parameters, marked=marked))
    return found


def _of_each(endings: Sequence[str], parameters: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    """The endings of columns, each with the parameters of its line."""
    return [
        (ending, {**parameters, "gap": i} if len(endings) > 1 else parameters) for i, ending in enumerate(endings, 1)
    ]


def told_apart(series: Sequence[Series]) -> list[Series]:
    """The columns of a single table, each with a look of its own and an entry in the legend of its panel."""
    found = []
    for panel in dict.fromkeys(each.panel for each in series):
        inside = [each for each in series if each.panel == panel]
        names = list(dict.fromkeys(each.columns for each in inside))
        many, over_own = len(names) > len(COLOURS), len({x for x, _ in names}) > 1
        for each in inside:
            i = names.index(each.columns)
            look: dict[str, Any] = {"color": COLOURS[i % len(COLOURS)], "linestyle": LINES[i % len(LINES)]}
            look |= {"marker": MARKERS[i % len(MARKERS)], "markersize": 2.5}
            if many:
                look |= {"color": ORDERED(i / (len(names) - 1)), "linestyle": "-", "marker": "."}
            x, y = (column(name).symbol for name in each.columns)
            label = f"${y}({x})$" if over_own else f"${y}$"
            shown = not each.mark and (not many or i in (0, len(names) - 1))
            look = {"color": look["color"]} if each.mark else look
            found.append(replace(each, look={**look, **each.look}, label=label if shown else ""))
    return found


def panels_of(series: Sequence[Series], units: Units, wide: str = "") -> dict[Any, Panel]:
    """The panels of series; distances of runs, which move little beside what their starts differ by, share no range."""
    panels = {}
    for name in dict.fromkeys(each.panel for each in series):
        both = zip(*(each.columns for each in series if each.panel == name), strict=True)
        x, y = (units.axis_label(list(dict.fromkeys(names))) for names in both)
        y = y.replace("  [", " from their mean  [") if name[1] == "z" else y
        panels[name] = Panel(x, y, wide, shared=name != ("t", "d"))
    return panels
