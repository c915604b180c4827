"""Critical distances over the parameter that was followed."""

from __future__ import annotations

import csv
import itertools
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from pairsim.plots.encoding import Encoding
from pairsim.plots.labels import axis_label, case_parts, finish, read_case, spread
from pairsim.plots.style import Page, key, printing, small_print
from pairsim.runtime.errors import InputError

OTHER = {"Ca_e": "De", "De": "Ca_e"}
"""The parameter that a picture is drawn over, and the one that tells its lines apart."""
STYLES = {True: "-", False: (0, (4, 1.5))}
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
        with path.open(encoding="utf-8", newline="") as file:
            rows: list[dict[str, Any]] = [dict(row) for row in csv.DictReader(file)]
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
    axis: Axes = figure.subplots()
    for branch in dict.fromkeys(row["branch"] for row in rows):
        _draw_branch(axis, name, [row for row in rows if row["branch"] == branch], encoding)
    spread(axis, "x", [row[name] for row in rows])
    spread(axis, "y", [row["d_cr"] for row in rows])
    bounded = [float(row.get("d_error") or 0) < LONG * row["d_cr"] for row in rows]
    for drawn in (True, False):  # the error of a distance grows without bound towards a fold
        seen = axis.get_ylim()
        for row, short in zip(rows, bounded, strict=True):
            if short == drawn and row["kind"] != "added":
                _draw_error(axis, name, row, encoding.colour_of(row))
    axis.set_ylim(seen)
    finish(axis, axis_label([name]), axis_label(["d_cr"]), [])
    encoding.bar(figure, [axis])
    key(figure, [*encoding.handles(), *_notes(rows)])
    lines = len(encoding.values[OTHER[name]]) > 1
    small_print(figure, case_parts(case, {name, OTHER[name]} if lines else {name}))
    return page.save(figure, out, "critical")


def _draw_branch(axis: Axes, name: str, points: list[dict[str, Any]], encoding: Encoding) -> None:
    colour = encoding.colour_of(points[0])
    for first, second in itertools.pairwise(points):
        # What vanishes is neither: the other end tells.
        end = second if first["kind"] == "vanishes" else first
        style = STYLES[end["stable"] == "true"]
        axis.plot([first[name], second[name]], [first["d_cr"], second["d_cr"]], linestyle=style, color=colour)
    for row in points:
        if row["kind"] == "wanted":
            face = colour if row["stable"] == "true" else "white"
            axis.plot(row[name], row["d_cr"], "o", color=colour, markerfacecolor=face, markersize=3.5)
        elif row["kind"] in ENDS:
            axis.plot(row[name], row["d_cr"], ENDS[row["kind"]][0], color=colour, markersize=5)


def _draw_error(axis: Axes, name: str, row: dict[str, Any], colour: str) -> None:
    """The interval of a distance or, where two zeros meet, of the parameter."""
    look: dict[str, Any] = {"fmt": "none", "ecolor": colour, "elinewidth": 2.4, "alpha": 0.35}
    if row.get("d_error"):
        axis.errorbar(row[name], row["d_cr"], yerr=float(row["d_error"]), **look)
    elif row.get("parameter_error"):
        axis.errorbar(row[name], row["d_cr"], xerr=float(row["parameter_error"]), **look)


def _notes(rows: list[dict[str, Any]]) -> list[Line2D]:
    entries = []
    for stable, label in ((True, "stable"), (False, "unstable")):
        if any((row["stable"] == "true") == stable for row in rows if row["kind"] != "vanishes"):
            look: dict[str, Any] = {
                "linestyle": STYLES[stable],
                "marker": "o",
                "markerfacecolor": "0.2" if stable else "white",
            }
            entries.append(Line2D([], [], color="0.2", label=label, **look))
    if any(row.get("d_error") or row.get("parameter_error") for row in rows):
        entries.append(
            Line2D([], [], color="0.2", alpha=0.35, linestyle="", marker="|", markeredgewidth=2.4, label="error")
        )
    for kind, (marker, label) in ENDS.items():
        if any(row["kind"] == kind for row in rows):
            entries.append(Line2D([], [], color="0.2", linestyle="", marker=marker, label=label))
    return entries
