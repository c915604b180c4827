"""One master curve."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from pairsim.plots.chart import Panel, Series
from pairsim.plots.labels import case_parts, read_case
from pairsim.plots.lines import fine_distances, lines_of
from pairsim.plots.overlay import draw_overlay
from pairsim.plots.style import COLOURS, LINES, MARKERS, ORDERED, Page
from pairsim.plots.units import Units
from pairsim.results.columns import column, suffixes_in
from pairsim.results.folder import WAY
from pairsim.results.table_files import read_table
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError


def draw_curve(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `curve`: dU over d with its error as a band and its zeros, and D of the particles.

    Args:
        directory: Folder of a curve, finished or not.
        out: Folder of the pictures.
        page: What they are drawn for.

    Returns:
        The files written; none for a single particle, places that differ in their gaps, or a branch that ends before
        the first point.

    Raises:
        InputError: The folder is not that of a curve, or holds no point yet.
    """
    if (directory / WAY).is_file() and not (directory / "curve.csv").is_file():
        return []
    units = Units.of(directory, page.physical)
    table = units.table(read_table(directory / "curve.csv"))
    if not len(next(iter(table.values()))):
        raise InputError(str(directory / "curve.csv"), "", None, "has no points yet")
    lines = lines_of(directory, {}, units, curve=True)
    if not lines:
        return []
    parts = case_parts(read_case(directory / "case.yaml"))
    return draw_overlay(lines, [], parts, out, page, "curve", beside=_shapes(table, lines[0].d, units))


def _shapes(table: Mapping[str, Array], d: str, units: Units) -> tuple[Panel, list[Series]]:
    """The Taylor parameters: smooth lines over log d, which do not overshoot, through their points."""
    points, shapes = table[d], [f"D{each}" for each in suffixes_in(table, "D")]
    fine, many = fine_distances(points), len(shapes) > len(COLOURS)
    marked = np.searchsorted(fine, points).tolist()
    series = []
    for i, name in enumerate(shapes):
        values = table[name]
        if len(points) > 1:
            values = scipy.interpolate.PchipInterpolator(np.log(points), values)(np.log(fine))
        look: dict[str, Any] = {"color": COLOURS[i % len(COLOURS)], "linestyle": LINES[i % len(LINES)]}
        look |= {"marker": MARKERS[i % len(MARKERS)], "markersize": 2.5}
        if many:
            look |= {"color": ORDERED(i / (len(shapes) - 1)), "linestyle": "-", "marker": "."}
        label = f"${column(name).symbol}$" if not many or i in (0, len(shapes) - 1) else ""
        series.append(Series(0, fine, values, look, label=label, marked=marked))
    return Panel(units.axis_label([d]), units.axis_label(shapes), wide="x"), series
