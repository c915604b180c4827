"""Several runs or several curves in one picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.cases.merging import flat
from pairsim.plots.chart import Panel, Series, draw_chart
from pairsim.plots.encoding import Encoding
from pairsim.plots.labels import case_parts, equation, hashable, read_case
from pairsim.plots.lines import Line, lines_of, series_of
from pairsim.plots.style import Page, printing
from pairsim.plots.units import Units
from pairsim.results.columns import column, error_of
from pairsim.results.folder import kind_of
from pairsim.runtime.errors import InputError

FIRST = ("beta", "De", "Ca_e", "d0", "particles", "liquid", "xi")
"""Keys that a difference is looked for in before all others."""
NOT_COMPARED = ("name", "output", "fields", "physical", "time.end", "limits")
FOLDER = "folder"
ALIKE = 0.05  # lines whose differences are below this part of their range lie on each other


def varying_keys(cases: Sequence[dict[str, Any]]) -> list[str]:
    """The keys that tell cases apart: each one tells some apart that those before it do not.

    So the liquid is not named where De tells as much, nor a mesh that was chosen for it; and not the distances of a
    curve, which are seen.
    """
    names = [key for key in (*FIRST, *(key for case in cases for key in case)) if not key.startswith(NOT_COMPARED)]
    chosen: list[str] = []
    known = 1
    for name in dict.fromkeys(names):
        count = len({tuple(hashable(case.get(key)) for key in (*chosen, name)) for case in cases})
        if name != "d" and count > known:
            chosen, known = [*chosen, name], count
    return chosen


def overlay(
    folders: Sequence[Path], out: Path, page: Page, group: str | None = None, panels: str | None = None
) -> list[Path]:
    """Draw `runs` or `curves`: dU of all folders in the same panels; what differs is in the legend.

    Args:
        folders: Two or more folders, all of runs or all of curves.
        out: Folder of the picture.
        page: What it is drawn for.
        group: The key that chooses colours, the first that differs by default.
        panels: The key whose values have a panel each.

    Raises:
        InputError: A folder is of another kind, or has nothing to draw yet.
    """
    kinds: dict[Path, str] = {folder: kind_of(folder) for folder in folders}
    for folder, kind in kinds.items():
        if kind not in ("run", "curve"):
            raise InputError(str(folder), "", kind, "must be a run or a curve to be laid over others")
        if kind != kinds[folders[0]]:
            raise InputError(str(folder), "", kind, f"must be a {kinds[folders[0]]}, as {folders[0]} is")
    whole = [read_case(folder / "case.yaml") for folder in folders]
    cases = list(map(flat, whole))
    keys = varying_keys(cases)
    names = [str(folder) for folder in folders]
    if len(set(names)) < len(names):
        raise InputError("pairsim plot", "", names[0], "must be named once")
    told_apart = len({tuple(hashable(case.get(key)) for key in keys) for case in cases}) == len(cases)
    if not told_apart or Encoding.of(cases, keys, group, panels).untold:
        cases, keys = [case | {FOLDER: name} for case, name in zip(cases, names, strict=True)], [FOLDER]
    lines: list[Line] = []
    curve = kinds[folders[0]] == "curve"
    drawn = [Units.of(folder, page.physical) for folder in folders]
    if any(units.scales is None for units in drawn):
        drawn = [Units()] * len(folders)
    for folder, case, units in zip(folders, cases, drawn, strict=True):
        found = lines_of(folder, case, units, curve=curve)
        if not found:
            raise InputError(str(folder), "", None, "has no line to draw: no rows yet, or no curve over one distance")
        lines += found
    # A Newtonian one has no law to name.
    fullest = max(whole, key=lambda case: (float(case.get("De", 0)), isinstance(case.get("liquid"), dict)))
    return draw_overlay(lines, keys, case_parts(fullest, keys), out, page, "curves" if curve else "runs", group, panels)


@printing()
def draw_overlay(
    lines: Sequence[Line],
    keys: Sequence[str],
    parts: Sequence[str],
    out: Path,
    page: Page,
    stem: str,
    group: str | None = None,
    panels: str | None = None,
    beside: tuple[Panel, Sequence[Series]] | None = None,
) -> list[Path]:
    """Draw lines whose cases differ in some keys: those of runs over time and distance, those of curves over distance.

    Where they lie on each other, a panel more has their differences to the first one.

    Args:
        lines: At least one, all of runs or all of curves.
        keys: What differs.
        parts: What they have in common, for the small print.
        out: Folder of the picture.
        page: What it is drawn for.
        stem: Name of the files without their endings.
        group: The key that chooses colours.
        panels: The key whose values have a panel each.
        beside: One panel more, and what is in it.

    Raises:
        InputError: `group` or `panels` does not differ.
    """
    gaps = ["gap"] if any("gap" in line.parameters for line in lines) else []
    encoding = Encoding.of([line.parameters for line in lines], [*keys, *gaps], group, panels)
    if lines[0].curve or lines[0].d not in lines[0].table:
        kinds = [("d" if lines[0].curve else "t", "y")]
    else:
        kinds = [("t", "d"), ("t", "y"), ("d", "y")][: 2 if encoding.panel else 3]
    table = [
        each
        for line in lines
        for i, (x, y) in enumerate(kinds, encoding.panel_of(line.parameters) * len(kinds))
        for each in series_of(line, i, x, encoding.look(line.parameters), y)
    ]
    places = [_panel(lines, title, i, x, y) for title in encoding.titles for i, (x, y) in enumerate(kinds)]
    count = len(places)
    if differences := [] if encoding.panel else _differences(lines, encoding):
        beside = _panel_of_differences(differences, encoding, kinds[0][0])
    if beside is not None:
        places.append(beside[0])
        table += [replace(each, panel=count) for each in beside[1]]
    columns = len(kinds) if encoding.panel and len(kinds) > 1 else None
    figure, _ = draw_chart(page, places, table, parts, encoding, columns=columns)
    return page.save(figure, out, stem)


def _panel(lines: Sequence[Line], title: str, like: int, x: str, y: str) -> Panel:
    """The axes of lines; distances of runs move little beside the differences of their starts, and have their own."""
    over, names = ([*dict.fromkeys(line.column(each) for line in lines)] for each in (x, y))
    labels = lines[0].units.axis_label(over), lines[0].units.axis_label(names)
    return Panel(*labels, title=title, wide="x" if lines[0].curve else "", like=like if title and y == "y" else None)


def _differences(lines: Sequence[Line], encoding: Encoding) -> list[Line]:
    """What lines differ from one whose case differs in one key alone, where they lie on it, with both half-widths."""
    key = _reference(encoding)
    found = []
    for line in lines if key not in ("", "gap") else []:
        first = {**line.parameters, key: encoding.values[key][0]}
        for other in (each for each in lines if each is not line and dict(each.parameters) == first):
            x = "d" if line.curve else "t"
            (a, values, error), (b, reference, more) = line.drawn(x), other.drawn(x)
            common = np.array([place for place in a if b[0] <= place <= b[-1]])
            apart = np.interp(common, a, values) - np.interp(common, b, reference)
            if len(common) and 0 < np.abs(apart).max() < ALIKE * np.ptp(reference):
                table = {line.column(x): common, line.y: apart}
                if error is not None and more is not None:
                    table[error_of(line.y)] = np.interp(common, a, error) + np.interp(common, b, more)
                found.append(replace(line, table=table, curve=False, zeros=(), failed=False))
    return found


def _reference(encoding: Encoding) -> str:
    """The key whose first value others are compared with."""
    return encoding.line or encoding.colour


def _panel_of_differences(differences: Sequence[Line], encoding: Encoding, x: str) -> tuple[Panel, list[Series]]:
    """Differences over t or d, with their bands."""
    key, line = _reference(encoding), differences[0]
    entry, over = column(line.y), line.column(x)
    compared = f"${entry.symbol} - {entry.symbol}$({equation(key, encoding.values[key][0])})"
    panel = Panel(line.units.axis_label([over]), f"{compared}  [{line.units.name(entry.unit)}]", wide="x" * (x == "d"))
    looks = (encoding.look(each.parameters) for each in differences)
    return panel, [each for line, look in zip(differences, looks, strict=True) for each in series_of(line, 0, x, look)]
