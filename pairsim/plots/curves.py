"""One master curve."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
import scipy
from matplotlib.axes import Axes

from pairsim.plots.axes import finish, spread
from pairsim.plots.labels import case_parts, read_case
from pairsim.plots.lines import fine_distances, lines_of
from pairsim.plots.overlay import draw_overlay
from pairsim.plots.style import COLOURS, LINES, MARKERS, ORDERED, Page
from pairsim.plots.units import Units
from pairsim.results.columns import column, suffixes_in
from pairsim.results.output import WAY
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
    shapes = partial(_draw_shapes, table=table, d=lines[0].d, units=units)
    return draw_overlay(lines, [], case_parts(read_case(directory / "case.yaml")), out, page, "curve", beside=shapes)


def _draw_shapes(axis: Axes, table: Mapping[str, Array], d: str, units: Units) -> None:
    """The Taylor parameters: smooth lines over log d, which do not overshoot, through their points."""
    points, shapes = table[d], [f"D{each}" for each in suffixes_in(table, "D")]
    fine, many = fine_distances(points), len(shapes) > len(COLOURS)
    for i, name in enumerate(shapes):
        values = table[name]
        if len(points) > 1:
            values = scipy.interpolate.PchipInterpolator(np.log(points), values)(np.log(fine))
        axis.plot(
            fine,
            values,
            label=f"${column(name).symbol}$" if not many or i in (0, len(shapes) - 1) else None,
            color=ORDERED(i / (len(shapes) - 1)) if many else COLOURS[i],
            linestyle=LINES[0] if many else LINES[i % len(LINES)],
            marker="." if many else MARKERS[i],
            markersize=2.5,
            markevery=np.searchsorted(fine, points).tolist(),
        )
    spread(axis, "x", table[d])
    finish(axis, units.axis_label([d]), units.axis_label(shapes), [table[name] for name in shapes])
    axis.legend()
