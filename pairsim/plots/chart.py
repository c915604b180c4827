"""Charts: lines and points with their bands, drawn into panels with legends.

What is drawn is a table with a row for each value: x, y, the half-widths of their intervals, and the parameters of its
case. The rows of a line are stored together, as the arrays of a `Line`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter
from scipy.interpolate import make_interp_spline

from pairsim.plots.encoding import Encoding
from pairsim.plots.labels import symbol
from pairsim.plots.parameters import NO_PARAMETERS, Parameters
from pairsim.plots.style import SMALL, WIDE, Look, Page
from pairsim.record.column import Column
from pairsim.record.columns import TAYLOR, F
from pairsim.runtime.arrays import Array

BAND, TOGETHER = 0.22, 6  # opacity of a band, and the number of bands over each other up to which it is kept
LIGHTER = 0.55  # opacity of the band due to the inputs, over that of the error
START_UP = "0.88"  # grey of the part in which a run starts up
LEAST = 0.02, 2e-6  # least span of an axis: a part of its largest value, and an absolute one
LEAST_RATIO = 4.0  # least ratio of the ends of a logarithmic axis
BRIEF = 0.01  # part of the time whose extreme values do not set the axis
BEYOND = 0.35  # part of the range of the other values by which the axis extends beyond it
LETTER = 0.5  # width of a letter, in sizes of the font
MARKUP = re.compile(r"\\mathrm|[\\${}_]")  # what TeX does not print
POINT, STABLE, UNSTABLE, FAILED = "point", "stable zero", "unstable zero", "failed here"
ENDS = {"vanishes": "a stable and an unstable one meet", "edge": "leaves the range of $d$"}
"""Entries of the legend for the ends of branches of critical distances, by their words in critical.csv."""
MARKS: dict[str, Look] = {
    STABLE: {"marker": "o", "markersize": 4.5},
    UNSTABLE: {"marker": "o", "markersize": 4.5, "markerfacecolor": "white"},
    FAILED: {"marker": "x", "markersize": 5},
    ENDS["vanishes"]: {"marker": "X", "markersize": 5},
    ENDS["edge"]: {"marker": "s", "markersize": 5},
}
"""The looks of points that mark something, by their entries in the legend."""
ZERO_MARKS = UNSTABLE, STABLE
ERROR_OF_DU = r"error of $\Delta U$"
ERROR_OF_F = "error of $F$"


@dataclass(frozen=True)
class Line:
    """A line or points in a panel."""

    panel: Any  # key of the panel
    x: Array  # (n,)
    y: Array  # (n,)
    error: Array | None = None  # half-widths of y, (n,): a band around a line, bars at points
    x_error: Array | None = None  # the same for x
    inputs: Array | None = None  # half-widths of y due to those of the inputs, (n,): a lighter band around a line
    columns: tuple[Column, Column] | None = None  # those of x and y, if they come from a table
    parameters: Parameters = NO_PARAMETERS  # of its case; they choose how it looks, and its panel
    look: Look = field(default_factory=Look)  # properties that have precedence over those by the parameters
    mark: str = ""  # one of `MARKS`, or `POINT` for points without an entry in the legend; "" for a line
    label: str = ""  # its entry in the legend of the panel, or above a single one; "" for none
    marked: Sequence[int] = ()  # rows of a line that have a marker
    t: Array | None = None  # times of the rows, (n,), if a brief start-up may be cut off; else None

    def range(self, *, bars: bool) -> Array:
        """The values of y and, with `bars`, the known ends of their intervals."""
        known = [np.nan_to_num(each, posinf=0.0) for each in (self.error, self.inputs) if each is not None and bars]
        error = np.max(known, axis=0) if known else np.zeros(1)
        return np.concatenate([self.y - error, self.y + error])


def point(
    panel: Any,
    x: float,
    y: float,
    mark: str,
    error: float | None = None,
    x_error: float | None = None,
    columns: tuple[Column, Column] | None = None,
    parameters: Parameters = NO_PARAMETERS,
) -> Line:
    """A line of one point; errors that are None or not finite have no bars."""
    y_bar, x_bar = (np.array([each]) if each is not None and np.isfinite(each) else None for each in (error, x_error))
    return Line(panel, np.array([x]), np.array([y]), y_bar, x_bar, mark=mark, columns=columns, parameters=parameters)


@dataclass(frozen=True)
class Panel:
    """The axes of a panel."""

    x: str  # label, with its unit
    y: str  # the same
    wide: str = ""  # the axes, of "x" and "y", that are logarithmic where values span a wide range
    logarithmic: bool = False  # whether both are in any case
    shared: bool = True  # whether the panels of all values of a parameter have the same ranges
    margins: tuple[float, float] = (0.05, 0.05)  # part of the range around what is drawn, along x and y
    shade: tuple[float, float] | None = None  # interval along x that is grey
    bars: bool = True  # whether the range holds error bars, too, and not points alone
    above: tuple[str, Array, Array] | None = None  # second scale along x: label, places, values there, ascending, (n,)


def draw_chart(
    page: Page,
    panels: Mapping[Any, Panel],
    series: Sequence[Line],
    parts: Sequence[str],
    encoding: Encoding | None = None,
    handles: Sequence[Any] = (),
    bands: str = ERROR_OF_DU,
) -> tuple[Figure, list[Axes]]:
    """Draw series into panels, with one legend above and small print below.

    Args:
        page: The page.
        panels: The panels; where a parameter is shown by panels, all of them are repeated for each of its values.
        series: What is drawn.
        parts: The parameters in the small print.
        encoding: Which parameters choose colours, styles and panels.
        handles: Further entries of the legend, beside those of the encoding, of bands and of marks.
        bands: Name of the bands in the legend.
    """
    encoding = encoding or Encoding()
    places = [(i, name) for i in range(len(encoding.titles)) for name in panels]
    count, columns = len(places), len(panels) if len(encoding.titles) > 1 and len(panels) > 1 else None
    figure, axes = page.panels(count, 66 if count == 1 else 50 if count <= 6 else 40, 14, columns)
    drawn = [(encoding.place(encoding.panel, each.parameters), _with_look(each, encoding)) for each in series]
    cut = False
    for axis, (number, name) in zip(axes, places, strict=True):
        panel = panels[name]
        if panel.shared and number:
            axis.sharex(axes[places.index((0, name))])
            axis.sharey(axes[places.index((0, name))])
        group = [each for i, each in drawn if each.panel == name and (panel.shared or i == number)]
        axis.set_title(encoding.titles[number])
        cut |= _draw_panel(axis, panel, [each for i, each in drawn if (i, each.panel) == (number, name)], group)
    labelled = [axis.get_legend_handles_labels()[0] for axis in axes]
    for axis, entries in zip(axes, labelled, strict=True):
        if page.legend and count > 1 and len(entries) > 1:
            # Beside a title there is no room above the panel.
            above = (
                {} if axis.get_title() else {"loc": "lower center", "bbox_to_anchor": (0.5, 1), "ncols": len(entries)}
            )
            axis.legend(**above)
    encoding.bar(figure, axes)
    lines, points = any(not each.mark for each in series), any(each.mark or each.marked for each in series)
    if not page.legend:
        return figure, axes
    own = [*encoding.handles(lines=lines, points=points), *handles, *(labelled[0] if count == 1 else [])]
    key(figure, [*own, *notes(series, bands)])
    more = [f"all values of {symbol(name)}" for name in encoding.untold] + ["a brief start-up is cut off"] * cut
    small_print(figure, [*parts, *more])
    return figure, axes


def _with_look(series: Line, encoding: Encoding) -> Line:
    """The series with colour, style and marker from the parameters of its case; its own `look` has precedence.

    Marks such as zeros and crosses keep the shape of their kind.
    """
    whole = encoding.look(series.parameters)
    look: Look = {**whole, "markersize": 2.5 if encoding.line else 3.5}
    if series.mark:
        look = {"color": whole["color"]}
        if series.mark in ZERO_MARKS and encoding.line:
            look["marker"] = whole["marker"]
    return replace(series, look={**look, **series.look})


def _draw_panel(axis: Axes, panel: Panel, inside: Sequence[Line], group: Sequence[Line]) -> bool:
    """Draw the lines inside a panel, on axes that fit the lines of a group; returns whether a start-up is cut off."""
    axis.margins(*panel.margins)
    if panel.shade is not None:
        axis.axvspan(*panel.shade, color=START_UP, linewidth=0, zorder=0.1)
    band = BAND * min(1.0, TOGETHER / max(sum(each.error is not None for each in inside), 1))
    for name in "xy" if panel.logarithmic else panel.wide:
        _spread(axis, name, [each.x if name == "x" else each.y for each in group], 1.0 if panel.logarithmic else WIDE)
    axis.update_datalim([place for each in inside for place in zip(each.x, each.y, strict=True)])
    axis.autoscale_view()
    seen = axis.axis()
    for each in inside:
        draw_series(axis, each, band)
    if not panel.bars:
        axis.axis(seen)
    finish(axis, panel.x, panel.y, [each.range(bars=panel.bars) for each in group])
    _widen(axis, "x", [each.x for each in group])
    if panel.logarithmic:
        for limits, set_limits in ((axis.get_xlim(), axis.set_xlim), (axis.get_ylim(), axis.set_ylim)):
            middle, ratio = np.sqrt(np.prod(limits)), max(limits[1] / limits[0], LEAST_RATIO) ** 0.5
            set_limits(middle / ratio, middle * ratio)
    if panel.above is not None:
        label, x, values = panel.above
        both = tuple(make_interp_spline(*pair, k=1) for pair in ((x, values), (values, x)))
        axis.secondary_xaxis("top", functions=both).set_xlabel(label)
    timed = [(each.t, each.y) for each in inside if each.t is not None]
    return bool(timed) and leave_out_spikes(axis, timed)


def draw_series(axis: Axes, series: Line, band: float = BAND) -> None:
    """Draw a line with its band, whose opacity is `band`, or points with their bars."""
    if series.mark or len(series.x) == 1:
        of_mark: Look = MARKS.get(series.mark, {"markersize": 3})
        look: Look = {"marker": "o", "linestyle": "", "elinewidth": 0.8, "zorder": 5, **of_mark, **series.look}
        axis.errorbar(series.x, series.y, series.error, series.x_error, label=series.label, **look)
        return
    look = {**series.look} if len(series.marked) else {**series.look, "marker": ""}
    axis.plot(series.x, series.y, label=series.label, markevery=list(series.marked), **look)
    for half_widths, opacity in ((series.inputs, LIGHTER * band), (series.error, band)):
        if half_widths is not None:
            fill(axis, series.x, series.y, half_widths, look["color"], opacity)


def fill(axis: Axes, x: Array, y: Array, error: Array, colour: Any, band: float = BAND) -> None:
    """The band of half-width `error` around a line."""
    error = np.where(np.isfinite(error), error, np.nan)  # with two points alone nothing is known between them
    axis.fill_between(x, y - error, y + error, color=colour, alpha=band, linewidth=0)


def notes(series: Sequence[Line], words: str = ERROR_OF_DU) -> list[Any]:
    """Entries of the legend for bands and marks."""
    banded = [each for each in series if each.error is not None and not each.mark]
    quantities = [each.panel[1] for each in banded if isinstance(each.panel, tuple)]
    label = ERROR_OF_F if F in quantities else words + (" and $D$" if TAYLOR in quantities else "")
    bands = [Patch(color="0.35", alpha=BAND, linewidth=0, label=label)] if banded else []
    if any(each.inputs is not None for each in series):
        bands.append(Patch(color="0.35", alpha=LIGHTER * BAND, linewidth=0, label="half-width due to the inputs"))
    marked = {each.mark for each in series}
    plain: Look = {"color": "0.2", "linestyle": ""}
    looks: dict[str, Look] = {mark: {**plain, **look} for mark, look in MARKS.items() if mark in marked}
    return [*bands, *(Line2D([], [], label=mark, **look) for mark, look in looks.items())]


def _spread(axis: Axes, name: str, values: Sequence[Array], least: float) -> None:
    """Make "x" or "y" logarithmic, with plain numbers, where values span at least this ratio."""
    low, high = min(map(np.min, values), default=0.0), max(map(np.max, values), default=0.0)
    if low > 0 and high / low >= least:
        axis.set(**{f"{name}scale": "log"})
        direction: Axis = getattr(axis, f"{name}axis")
        direction.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high / low < 300 else (1.0,)))
        direction.set_major_formatter(StrMethodFormatter("{x:g}"))
        direction.set_minor_formatter(NullFormatter())


def _widen(axis: Axes, name: str, values: Sequence[Array]) -> None:
    """Widen the range along "x" or "y" where values hardly vary, so that rounding does not fill the panel."""
    low, high = min(map(np.min, values), default=0.0), max(map(np.max, values), default=1.0)
    least = max(LEAST[0] * max(abs(low), abs(high)), LEAST[1])
    if high - low < least:
        middle = (low + high) / 2
        axis.set(**{f"{name}lim": (middle - least / 2, middle + least / 2)})


def finish(axis: Axes, x: str, y: str, values: Sequence[Array]) -> None:
    """Set labels, few ticks, the line y = 0 where values change sign, and a range that does not magnify rounding."""
    _widen(axis, "y", values)
    if any((v < 0).any() for v in values) and any((v > 0).any() for v in values):
        axis.axhline(0, color="0.55", linewidth=0.6, linestyle="-", zorder=0.5)
    axis.set(xlabel=x, ylabel=y)
    for direction in (axis.xaxis, axis.yaxis):
        if direction.get_scale() == "linear":
            direction.set_major_locator(MaxNLocator(6 if direction is axis.yaxis else 5, steps=[1, 2, 2.5, 5, 10]))


def leave_out_spikes(axis: Axes, runs: Sequence[tuple[Array, Array]]) -> bool:
    """End an axis a little beyond the values of nearly all times, so that a brief start-up does not set its range.

    Runs have times and values of each line. Returns whether a line is cut off.
    """
    known = [np.interp(np.linspace(t[0], t[-1], 1000), t, values) for t, values in runs]
    lows, highs = np.quantile(known, [BRIEF, 1 - BRIEF], axis=1)
    beyond = BEYOND * (highs.max() - lows.min())
    least, most = lows.min() - beyond, highs.max() + beyond
    values = np.concatenate([values for _, values in runs])
    below, above = bool(values.min() < least), bool(values.max() > most)
    if below or above:
        axis.set_ylim(least if below else None, most if above else None)
    return below or above


def small_print(figure: Figure, parts: Sequence[str]) -> None:
    """Write what holds for the whole picture in small letters below it, in as many lines as it takes."""
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
