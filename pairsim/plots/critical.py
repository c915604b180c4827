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
from pairsim.plots.labels import axis_label, case_parts, read_case
from pairsim.plots.lines import draw_zero
from pairsim.plots.style import Page, printing
from pairsim.results.answer import Zero
from pairsim.results.folders import rows_of
from pairsim.runtime.errors import InputError

OTHER = {"Ca_e": "De", "De": "Ca_e"}
"""The parameter that a picture is drawn over, and the one that tells its lines apart."""
STYLES = {True: "-", False: "--"}
LONG = 0.5  # an error of a distance beyond this part of it does not widen the picture
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
    path = directory / "critical.csv"
    try:
        rows: list[dict[str, Any]] = [*map(dict, rows_of(path))]
    except OSError as error:
        raise InputError(str(path), "", None, f"cannot be read ({error.strerror})") from None
    if not case.get("along") or not rows:
        return []
    name = next(iter(case["along"]))
    for row in rows:
        row |= {column: float(row[column]) for column in (name, OTHER[name], "d_cr")}
    encoding = Encoding.of(rows, [OTHER[name]])
    page = page.alone()
    figure = page.figure(82)
    axis = figure.subplots()
    for branch in dict.fromkeys(row["branch"] for row in rows):
        _draw_branch(axis, name, [row for row in rows if row["branch"] == branch], encoding)
    spread(axis, "x", [row[name] for row in rows])
    spread(axis, "y", [row["d_cr"] for row in rows])
    bounded = [float(row.get("d_error") or 0) < LONG * row["d_cr"] for row in rows]
    for drawn in (True, False):  # the error of a distance grows without bound towards a fold
        seen = axis.get_ylim()
        for row, short in zip(rows, bounded, strict=True):
            if short == drawn and row["kind"] != "added":
                _draw_error(axis, name, row, encoding.look(row)["color"])
    axis.set_ylim(seen)
    finish(axis, axis_label([name]), axis_label(["d_cr"]), [np.array([row["d_cr"] for row in rows])])
    encoding.bar(figure, [axis])
    key(figure, [*encoding.handles(), *_notes(rows)])
    lines = len(encoding.values[OTHER[name]]) > 1
    small_print(figure, case_parts(case, {name, OTHER[name]} if lines else {name}))
    return page.save(figure, out, "critical")


def _draw_branch(axis: Axes, name: str, points: Sequence[Mapping[str, Any]], encoding: Encoding) -> None:
    colour = encoding.look(points[0])["color"]
    for first, second in itertools.pairwise(points):
        # What vanishes is neither: the other end tells.
        end = second if first["kind"] == "vanishes" else first
        style = STYLES[end["stable"] == "true"]
        axis.plot([first[name], second[name]], [first["d_cr"], second["d_cr"]], linestyle=style, color=colour)
    for row in points:
        if row["kind"] == "wanted":
            draw_zero(axis, row[name], row["d_cr"], Zero(row["d_cr"], row["stable"] == "true"), colour)
        elif row["kind"] in ENDS:
            axis.plot(row[name], row["d_cr"], ENDS[row["kind"]][0], color=colour, markersize=5)


def _draw_error(axis: Axes, name: str, row: Mapping[str, Any], colour: Any) -> None:
    """The interval of a distance or, where two zeros meet, of the parameter."""
    for direction, column in (("yerr", "d_error"), ("xerr", "parameter_error")):
        if row.get(column):
            error: dict[str, Any] = {direction: float(row[column])}
            axis.errorbar(row[name], row["d_cr"], fmt="none", ecolor=colour, elinewidth=2.4, alpha=0.35, **error)
            return


def _notes(rows: Sequence[Mapping[str, Any]]) -> list[Line2D]:
    """Entries of the legend: stable and unstable distances, errors, ends of branches."""
    grey: dict[str, Any] = {"color": "0.2", "linestyle": ""}
    known = {row["stable"] == "true" for row in rows if row["kind"] != "vanishes"}
    entries = [
        Line2D([], [], **grey | {"linestyle": STYLES[stable]}, marker="o", markerfacecolor=face, label=label)
        for stable, face, label in ((True, "0.2", "stable"), (False, "white", "unstable"))
        if stable in known
    ]
    if any(row.get("d_error") or row.get("parameter_error") for row in rows):
        entries.append(Line2D([], [], **grey, alpha=0.35, marker="|", markeredgewidth=2.4, label="error"))
    kinds = {row["kind"] for row in rows}
    return entries + [Line2D([], [], **grey, marker=m, label=words) for k, (m, words) in ENDS.items() if k in kinds]
