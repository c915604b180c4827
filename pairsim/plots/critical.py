"""Critical distances over the parameter that was followed."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from pairsim.plots.axes import finish, key, small_print, spread
from pairsim.plots.encoding import Encoding
from pairsim.plots.labels import case_parts, read_case
from pairsim.plots.lines import draw_zero, zero_notes
from pairsim.plots.style import Page, printing
from pairsim.plots.units import Units
from pairsim.results.answer import Zero
from pairsim.results.table_files import read_table

OTHER = {"Ca_e": "De", "De": "Ca_e"}
"""The parameter that a picture is drawn over, and the one that tells its lines apart."""
ENDS = {"vanishes": ("X", "a stable and an unstable one meet"), "edge": ("s", "leaves the range of $d$")}


@printing()
def draw_critical(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `critical`: d_cr over the parameter that was followed, one line a branch.

    Args:
        directory: Folder of critical distances.
        out: Folder of the pictures.
        page: What they are drawn for.

    Returns:
        The files written; none where no parameter was followed, or nothing was found yet.

    Raises:
        InputError: The folder is not that of critical distances.
    """
    case = read_case(directory / "case.yaml")
    units = Units.of(directory, page.physical)
    table = units.table(read_table(directory / "critical.csv"))
    rows = [dict(zip(table, values, strict=True)) for values in zip(*table.values(), strict=True)]
    if not case.get("along") or not rows:
        return []
    name = next(iter(case["along"]))
    encoding = Encoding.of(rows, [OTHER[name]])
    figure, (axis,) = page.panels(1, height=82, extra=0)
    axis.margins(y=0.15)
    for branch in dict.fromkeys(row["branch"] for row in rows):
        _draw_branch(axis, name, [row for row in rows if row["branch"] == branch], encoding)
    spread(axis, "x", [row[name] for row in rows])
    spread(axis, "y", [row["d_cr"] for row in rows])
    seen = axis.get_ylim()
    for row in rows:
        _draw_row(axis, name, row, encoding.look(row)["color"])
    axis.set_ylim(seen)  # the error of a distance grows without bound towards a fold
    finish(axis, units.axis_label([name]), units.axis_label(["d_cr"]), [np.array([row["d_cr"] for row in rows])])
    encoding.bar(figure, [axis])
    look: dict[str, Any] = {"linestyle": "", "markersize": 5, "color": "0.2"}
    known = {row["kind"] for row in rows}
    ends = [Line2D([], [], marker=mark, label=words, **look) for kind, (mark, words) in ENDS.items() if kind in known]
    key(figure, [*encoding.handles(), *zero_notes([_zero(row) for row in rows if row["kind"] == "wanted"]), *ends])
    lines = len(encoding.values[OTHER[name]]) > 1
    small_print(figure, case_parts(case, {name, OTHER[name]} if lines else {name}))
    return page.save(figure, out, "critical")


def _zero(row: Mapping[str, Any]) -> Zero:
    return Zero(row["d_cr"], bool(row["stable"]))


def _draw_branch(axis: Axes, name: str, points: Sequence[Mapping[str, Any]], encoding: Encoding) -> None:
    """A line through the points of a branch, dashed where its distances are unstable."""
    colour = encoding.look(points[0])["color"]
    for first, second in itertools.pairwise(points):
        # What vanishes is neither: the other end tells.
        end = second if first["kind"] == "vanishes" else first
        style = "-" if _zero(end).stable else "--"
        axis.plot([first[name], second[name]], [first["d_cr"], second["d_cr"]], linestyle=style, color=colour)


def _draw_row(axis: Axes, name: str, row: Mapping[str, Any], colour: Any) -> None:
    """A distance, or the end of a branch, with the interval of the distance or, where two meet, of the parameter."""
    of = {"yerr": "d_error", "xerr": "parameter_error"}
    error: dict[str, Any] = {which: row[column] for which, column in of.items() if np.isfinite(row[column])}
    if row["kind"] == "wanted":
        draw_zero(axis, row[name], row["d_cr"], _zero(row), colour, **error)
    elif row["kind"] in ENDS:
        mark = ENDS[row["kind"]][0]
        axis.errorbar([row[name]], [row["d_cr"]], marker=mark, markersize=5, color=colour, elinewidth=0.8, **error)
