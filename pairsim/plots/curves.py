"""One master curve."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy
from matplotlib.axes import Axes

from pairsim.plots.encoding import Encoding
from pairsim.plots.labels import axis_label, case_parts, finish, read_case, spread
from pairsim.plots.lines import BAND, draw_line, fine_distances, lines_of, notes
from pairsim.plots.style import LINES, MARKERS, Page, key, printing, small_print
from pairsim.results.columns import column
from pairsim.results.output import read_series
from pairsim.runtime.errors import InputError


@printing()
def draw_curve(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `curve`: dU over d with its error as a band and its zeros, and D of the particles.

    Args:
        directory: Folder of a curve, finished or not.
        out: Folder of the pictures.
        page: What they are drawn for.

    Returns:
        The files written; none for a single particle or places that differ in their gaps.

    Raises:
        InputError: The folder is not that of a curve, or holds no point yet.
    """
    table = read_series(directory / "curve.csv")
    if not len(next(iter(table.values()))):
        raise InputError(str(directory / "curve.csv"), "", None, "has no points yet")
    lines = lines_of(directory, {}, curve=True)
    if not lines:
        return []
    encoding = Encoding.of([line.parameters for line in lines], ["gap"])
    figure, (left, right) = page.panels(2, height=58, extra=14)
    for line in lines:
        case = line.parameters
        look: dict[str, Any] = {"color": encoding.colour_of(case), "linestyle": encoding.line_of(case)}
        draw_line(left, line, line.d, look | {"marker": encoding.marker_of(case), "band": BAND})
    d = lines[0].table[lines[0].d]
    spread(left, "x", d)
    names = [line.y for line in lines]
    finish(left, axis_label([lines[0].d]), axis_label(names), [table[name] for name in names])
    shapes = [name for name in table if name.startswith("D_")]
    _draw_shapes(right, table, lines[0].d, shapes)
    key(figure, [*encoding.handles(points=True), *notes(lines)])
    small_print(figure, case_parts(read_case(directory / "case.yaml")))
    return page.save(figure, out, "curve")


def _draw_shapes(axis: Axes, table: dict[str, np.ndarray], d: str, shapes: list[str]) -> None:
    """The Taylor parameters: smooth lines over log d, which do not overshoot, through their points."""
    points = table[d]
    fine = fine_distances(points)
    for i, name in enumerate(shapes):
        look: dict[str, Any] = {
            "linestyle": LINES[i % len(LINES)],
            "marker": MARKERS[i % len(MARKERS)],
            "markersize": 2.5,
            "markevery": np.searchsorted(fine, points).tolist(),
        }
        values = table[name]
        if len(points) > 1:
            values = scipy.interpolate.PchipInterpolator(np.log(points), values)(np.log(fine))
        axis.plot(fine, values, label=f"${column(name).symbol}$", **look)
    spread(axis, "x", table[d])
    finish(axis, axis_label([d]), axis_label(shapes), [table[name] for name in shapes])
    axis.legend()
