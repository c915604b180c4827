"""Several runs or several curves in one picture."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from pairsim.config.merging import flat
from pairsim.plots.axes import finish, key, leave_out_spikes, small_print, spread
from pairsim.plots.encoding import Encoding
from pairsim.plots.labels import case_parts, equation, hashable, read_case, symbol
from pairsim.plots.lines import BAND, TOGETHER, Line, draw_line, lines_of, notes
from pairsim.plots.style import Page, printing
from pairsim.plots.units import Units
from pairsim.results.columns import column, error_of
from pairsim.results.folders import kind_of
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
    beside: Callable[[Axes], None] | None = None,
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
        beside: Draws one panel more.

    Raises:
        InputError: `group` or `panels` does not differ.
    """
    gaps = ["gap"] if any("gap" in line.parameters for line in lines) else []
    encoding = Encoding.of([line.parameters for line in lines], [*keys, *gaps], group, panels)
    if lines[0].curve or lines[0].d not in lines[0].table:
        kinds = [("d" if lines[0].curve else "t", "y")]
    else:
        kinds = [("t", "d"), ("t", "y"), ("d", "y")][: 2 if encoding.panel else 3]
    places = [(value, x, y) for value in encoding.panels for x, y in kinds]
    if differences := [] if encoding.panel else _differences(lines, encoding):
        beside = partial(_draw_differences, differences=differences, encoding=encoding, x=kinds[0][0])
    count = len(places) + (beside is not None)
    height = 62 if len(places) == 1 else 50 if count <= 6 else 40
    columns = len(kinds) if encoding.panel and len(kinds) > 1 else None
    figure, axes = page.panels(count, height, extra=16, columns=columns)
    for place, (axis, (value, x, y)) in enumerate(zip(axes, places, strict=False)):
        if place >= len(kinds):
            axis.sharex(axes[place % len(kinds)])
            if y == "y":  # distances move little beside the differences of their starts
                axis.sharey(axes[place % len(kinds)])
        _draw_panel(axis, lines, encoding, value, x, y)
        if encoding.panel:
            axis.set_title(equation(encoding.panel, value))
    if beside is not None:
        beside(axes[-1])
    encoding.bar(figure, axes)
    key(figure, [*encoding.handles(points=lines[0].curve), *notes(lines)])
    unseen = [f"all values of {symbol(name)}" for name in encoding.untold]
    small_print(figure, [*parts, *unseen])
    return page.save(figure, out, stem)


def _draw_panel(axis: Axes, lines: Sequence[Line], encoding: Encoding, value: Hashable, x: str, y: str) -> None:
    """The lines of a panel, on axes for those of all panels."""
    inside = [line for line in lines if encoding.inside(line.parameters, value)]
    band = BAND * min(1.0, TOGETHER / max(len(inside), 1))
    for line in inside:
        draw_line(axis, line, x, encoding.look(line.parameters) | {"band": band}, y)
    over, names = ([*dict.fromkeys(line.column(each) for line in lines)] for each in (x, y))
    units = lines[0].units
    finish(axis, units.axis_label(over), units.axis_label(names), [line.table[line.column(y)] for line in lines])
    if lines[0].curve:
        spread(axis, "x", [float(v) for line in lines for v in line.table[line.d]])
    elif y == "y":
        leave_out_spikes(axis, [(line.table["t"], line.table[line.y]) for line in lines])


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


def _draw_differences(axis: Axes, differences: Sequence[Line], encoding: Encoding, x: str) -> None:
    """Differences over t or d, with their bands."""
    for line in differences:
        draw_line(axis, line, x, encoding.look(line.parameters) | {"band": BAND})
    key, line = _reference(encoding), differences[0]
    entry, over = column(line.y), line.column(x)
    compared = f"${entry.symbol} - {entry.symbol}$({equation(key, encoding.values[key][0])})"
    label = f"{compared}  [{line.units.name(entry.unit)}]"
    if x == "d":
        spread(axis, "x", line.table[over])
    finish(axis, line.units.axis_label([over]), label, [each.table[each.y] for each in differences])
