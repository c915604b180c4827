"""The columns of runs and curves as lines: panels are named after the quantities, such as (T, DU)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from pairsim.analysis.master_curve import Curve
from pairsim.analysis.time_series import Series
from pairsim.plots.chart import FAILED, ZERO_MARKS, Line, Panel, point
from pairsim.plots.parameters import NO_PARAMETERS, Parameters
from pairsim.plots.style import COLOURS, LINES, MARKERS, ORDERED, Look
from pairsim.plots.units import Units
from pairsim.record.column import Column
from pairsim.record.columns import DISTANCE, DP, DU, DU_HALF, DU_QUARTER, SLOPE, TAYLOR, F, Q, T, U, Z
from pairsim.runtime.arrays import Array

FINE = 400  # points of a smooth line
MOTION = (DU, U, DP)
"""What shows best how particles move: relative velocities, the velocity of a single one, or else the pressure drop."""


def fine_distances(points: Array) -> Array:
    """Distances for a smooth line through points in ascending distance, these among them, ascending."""
    between = np.geomspace(points[0], points[-1], FINE)[1:-1]
    return np.union1d(points, between[(between > points[0]) & (between < points[-1])])


def lines_of(
    directory: Path, units: Units, parameters: Parameters = NO_PARAMETERS, *, curve: bool, failed: bool = False
) -> list[Line]:
    """The lines of a run or a curve, from its folder; none before the first row.

    The parameters are those of its case; with three particles or more `gap`, the number of the gap, is added to them.
    If the computation failed, a cross ends its lines.

    Raises:
        InputError: The table cannot be read.
    """
    if curve:
        return curve_lines(Curve.read(directory).converted(units.scales), parameters, failed=failed)
    return run_lines(Series.read(directory).converted(units.scales), parameters, failed=failed)


def run_lines(
    series: Series, parameters: Parameters, *, failed: bool = False, places: bool = False, flow: bool = False
) -> list[Line]:
    """Distances, motion and D of a run over time, and relative velocities over distance; nothing before the first step.

    With `places` the positions of the particles, relative to their mean, are drawn, too, and with `flow` a flow rate
    that varies, above the motion; for the rest see `lines_of`.
    """
    table = series.table
    if not table.rows:
        return []
    motion = next(column for column in MOTION if table.suffixes(column))
    found = []
    over_distance = [(DISTANCE, DU)] if motion is DU else []
    order = [(T, DISTANCE), (T, motion), (T, TAYLOR), *over_distance]
    if flow:  # in two columns, above each other on the left
        order = [(T, Q), (T, TAYLOR), (T, motion), *over_distance, (T, DISTANCE)]
    for x, y in order:
        for suffix, own in _of_each(table.suffixes(y), parameters):
            over, values = table.of(x, suffix if x.of else ""), table.of(y, suffix)
            columns, error = _of_gap(x, y, suffix), table.half_widths(y, suffix)
            found.append(Line((x, y), over, values, error, t=series.t, columns=columns, parameters=own))
            if failed:
                found.append(point((x, y), over[-1], values[-1], FAILED, columns=columns, parameters=own))
    if places and series.places:
        mean = np.mean(series.places, axis=0)
        for suffix, own in _of_each(table.suffixes(Z), parameters):
            z = table.of(Z, suffix) - mean
            found.append(Line((T, Z), series.t, z, t=series.t, columns=_of_gap(T, Z, suffix), parameters=own))
    return found


def curve_lines(curve: Curve, parameters: Parameters, *, failed: bool = False) -> list[Line]:
    """dU of a curve over d with its points and its zeros, and D.

    There are no lines before the first point, or where distances differ from gap to gap. Where particles are moved,
    there are the forces alone. A curve that is drawn alone has the half-widths due to its inputs, too; for the rest see
    `lines_of`.
    """
    gaps, table = curve.gaps, curve.table
    if not table.rows or not gaps or (table.known(SLOPE, gaps[0]) is None and table.known(DU_HALF, gaps[0]) is None):
        return []
    if table.suffixes(F):
        return _smooth(curve, F, table.varied(gaps[0]), parameters)
    found = []
    for gap, own in _of_each(gaps, parameters):
        over = table.varied(gap)
        points, values = table[over], table.of(DU, gap)
        fine, smooth, error = points, values, table.half_widths(DU, gap)
        if (interpolant := curve.interpolant(gap)) is not None:
            fine = fine_distances(points)
            smooth, error = interpolant.values(fine), interpolant.half_widths(fine)
        panel, columns = (DISTANCE, DU), (over, DU.with_suffix(gap))
        marked = np.searchsorted(fine, points).tolist()
        by_inputs = curve.by_inputs.half_widths(fine) if curve.by_inputs.known and not parameters else None
        whole = Line(panel, fine, smooth, error, inputs=by_inputs, columns=columns, parameters=own, marked=marked)
        found.append(whole)
        for column in (each for each in (DU_HALF, DU_QUARTER) if not parameters):
            if (earlier := table.known(column, gap)) is not None:
                others = over, column.with_suffix(gap)
                found.append(Line(panel, points, earlier, columns=others, parameters=own))
        for zero in curve.zeros:
            mark = ZERO_MARKS[zero.stable]
            found.append(point(panel, zero.d, 0.0, mark, x_error=zero.error, columns=columns, parameters=own))
        if failed:
            found.append(point(panel, points[-1], values[-1], FAILED, columns=columns, parameters=own))
    return [*found, *_smooth(curve, TAYLOR, table.varied(gaps[0]), parameters)]


def _smooth(curve: Curve, column: Column, over: Column, parameters: Parameters) -> list[Line]:
    """A quantity of the particles over the distance of a curve: D, or forces with their half-widths."""
    points, found = curve.table[over], []
    fine = fine_distances(points)
    for suffix in curve.table.suffixes(column):
        values, error = curve.table.of(column, suffix), curve.table.half_widths(column, suffix)
        if len(points) > 1:  # smooth lines over log d, which do not overshoot
            values = scipy.interpolate.PchipInterpolator(np.log(points), values)(np.log(fine))
            error = None if error is None else np.interp(np.log(fine), np.log(points), error)
        marked, columns = np.searchsorted(fine, points).tolist(), (over, column.with_suffix(suffix))
        panel = DISTANCE, column
        found.append(Line(panel, fine, values, error, columns=columns, parameters=parameters, marked=marked))
    return found


def _of_gap(x: Column, y: Column, suffix: str) -> tuple[Column, Column]:
    """Two columns for a gap or particle; x may be the same for all."""
    return x.with_suffix(suffix if x.of else ""), y.with_suffix(suffix)


def _of_each(endings: Sequence[str], parameters: Parameters) -> list[tuple[str, Parameters]]:
    """The endings of columns, each with the parameters of its line."""
    return [
        (ending, parameters | {"gap": i} if len(endings) > 1 else parameters) for i, ending in enumerate(endings, 1)
    ]


def told_apart(lines: Sequence[Line]) -> list[Line]:
    """The lines of a single table, with colours, styles and legend entries that distinguish the columns in a panel."""
    found = []
    for panel in dict.fromkeys(each.panel for each in lines):
        inside = [(each, columns) for each in lines if each.panel == panel and (columns := each.columns) is not None]
        drawn = list(dict.fromkeys(columns for _, columns in inside))
        many, over_own = len(drawn) > len(COLOURS), len({x for x, _ in drawn}) > 1
        for each, columns in inside:
            i = drawn.index(columns)
            look: Look = {"color": COLOURS[i % len(COLOURS)], "linestyle": LINES[i % len(LINES)]}
            look |= {"marker": MARKERS[i % len(MARKERS)], "markersize": 2.5}
            if many:
                look |= {"color": ORDERED(i / (len(drawn) - 1)), "linestyle": "-", "marker": "."}
            x, y = (column.symbol for column in columns)
            label = f"${y}({x})$" if over_own else f"${y}$"
            shown = not each.mark and (not many or i in (0, len(drawn) - 1))
            look = {"color": look["color"]} if each.mark else look
            found.append(replace(each, look={**look, **each.look}, label=label if shown else ""))
    return found


def panels_of(lines: Sequence[Line], units: Units, wide: str = "") -> dict[Any, Panel]:
    """The panels of lines; those of distances in runs share no range, as these change less than their starts differ."""
    panels = {}
    for panel in dict.fromkeys(each.panel for each in lines):
        both = zip(*(each.columns for each in lines if each.panel == panel and each.columns is not None), strict=True)
        x, y = (units.axis_label(list(dict.fromkeys(columns))) for columns in both)
        y = y.replace("  [", " from their mean  [") if panel[1] is Z else y
        panels[panel] = Panel(x, y, wide, shared=panel != (T, DISTANCE))
    return panels
