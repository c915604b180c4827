"""What all panels share: ranges and ticks of their axes, labels, the legend, the small print."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

from pairsim.plots.style import SMALL
from pairsim.runtime.arrays import Array

WIDE = 8.0  # ratio of values from which their axis is logarithmic
LEAST = 0.02, 2e-6  # what an axis spans at least: a part of its largest value, and a number
BRIEF = 0.01  # part of the time in which values do not set the axis
LETTER = 0.55  # width of a letter, in sizes of the font
MARKUP = re.compile(r"\\mathrm|[\\${}_]")  # what TeX does not print
BEYOND = 0.35  # part of the range of the others up to which they are seen nevertheless


def spread(axis: Axes, name: str, values: Iterable[float]) -> None:
    """A logarithmic axis with plain numbers for values that span a wide range.

    Args:
        axis: The panel.
        name: "x" or "y".
        values: What is drawn along it.
    """
    known = list(values)
    low, high = min(known), max(known)
    direction: Axis = axis.xaxis if name == "x" else axis.yaxis
    if low > 0 and high / low >= WIDE:
        (axis.set_xscale if name == "x" else axis.set_yscale)("log")
        direction.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high / low < 300 else (1.0,)))
        direction.set_major_formatter(StrMethodFormatter("{x:g}"))
        direction.set_minor_formatter(NullFormatter())


def widen(axis: Axes, name: str, values: Sequence[Array]) -> None:
    """A range along "x" or "y" that does not blow up what hardly varies, such as rounding."""
    filled = [entry for entry in values if len(entry)] or [np.array([0.0, 1.0])]
    low, high = min(float(v.min()) for v in filled), max(float(v.max()) for v in filled)
    least = max(LEAST[0] * max(abs(low), abs(high)), LEAST[1])
    if high - low < least:
        middle = (low + high) / 2
        (axis.set_xlim if name == "x" else axis.set_ylim)(middle - least / 2, middle + least / 2)


def finish(axis: Axes, x: str, y: str, values: Sequence[Array]) -> None:
    """Labels, few ticks, the line y = 0 where values change sign, and a range that does not blow rounding up.

    Args:
        axis: The panel.
        x: Label of the abscissa.
        y: Label of the ordinate.
        values: What is drawn.
    """
    widen(axis, "y", values)
    if any(v.min() < 0 for v in values if len(v)) and any(v.max() > 0 for v in values if len(v)):
        axis.axhline(0, color="0.55", linewidth=0.6, linestyle="-", zorder=0.5)
    axis.set(xlabel=x, ylabel=y)
    for direction in (axis.xaxis, axis.yaxis):
        if direction.get_scale() == "linear":
            direction.set_major_locator(MaxNLocator(6 if direction is axis.yaxis else 5, steps=[1, 2, 2.5, 5, 10]))


def leave_out_spikes(axis: Axes, runs: Sequence[tuple[Array, Array]]) -> None:
    """End an axis somewhat beyond what values are nearly all of the time: a brief start-up may reach out of it.

    Args:
        axis: The panel.
        runs: Times and values of each line.
    """
    known = [np.interp(np.linspace(t[0], t[-1], 1000), t, values) for t, values in runs]
    low = min(float(np.quantile(values, BRIEF)) for values in known)
    high = max(float(np.quantile(values, 1 - BRIEF)) for values in known)
    beyond = BEYOND * (high - low)
    if min(values.min() for _, values in runs) < low - beyond:
        axis.set_ylim(bottom=low - beyond)
    if max(values.max() for _, values in runs) > high + beyond:
        axis.set_ylim(top=high + beyond)


def small_print(figure: Figure, parts: Sequence[str]) -> None:
    """What holds for the whole picture, in small letters below it, in as many lines as it takes."""
    lines: list[list[str]] = [[]]
    room = left = figure.get_figwidth() * 72 / (LETTER * SMALL)
    for part in parts:
        letters = len(MARKUP.sub("", part)) + 2
        if letters > left and lines[-1]:
            lines, left = [*lines, []], room
        lines[-1].append(part)
        left -= letters
    text = ",\n".join(",  ".join(line) for line in lines)
    if text:
        figure.supxlabel(text, x=0.015, ha="left", fontsize=SMALL, color="0.25", linespacing=1.3)


def by_rows(handles: Sequence[Any], columns: int) -> list[Any]:
    """Entries of a legend in the order in which matplotlib, which fills columns, shows them row by row."""
    return [handle for column in range(columns) for handle in handles[column::columns]]


def key(figure: Figure, handles: Sequence[Any]) -> Legend | None:
    """A legend above the panels, read row by row, in as many columns as there is room for."""
    for columns in range(min(len(handles), 6), 0, -1):
        legend = figure.legend(handles=by_rows(handles, columns), loc="outside upper center", ncols=columns)
        if columns == 1 or legend.get_window_extent().width <= 0.98 * figure.bbox.width:
            return legend
        legend.remove()
    return None
