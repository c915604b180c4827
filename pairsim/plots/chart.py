"""A chart: the table of what is drawn, and the one way to draw its lines, points, bands, panels and legends.

A row of the table is a value: x, y, the half-widths of their intervals, a series and a panel. The rows of a series in a
panel are together, as arrays.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pairsim.plots.axes import finish, key, leave_out_spikes, small_print, spread, widen
from pairsim.plots.encoding import Encoding
from pairsim.plots.labels import symbol
from pairsim.plots.style import Page
from pairsim.runtime.arrays import Array

BAND, TOGETHER = 0.22, 6  # opacity of a band; so many bands over each other are still told apart
START_UP = "0.88"  # grey of the part in which a run starts up
POINT, STABLE, UNSTABLE, FAILED = "point", "stable zero", "unstable zero", "failed here"
SETTLED = "quasi-steady motion at the last distance"
ENDS = {"vanishes": "a stable and an unstable one meet", "edge": "leaves the range of $d$"}
"""What ends a branch of critical distances, by its word in critical.csv."""
MARKS: dict[str, dict[str, Any]] = {
    STABLE: {"marker": "o", "markersize": 4.5},
    UNSTABLE: {"marker": "o", "markersize": 4.5, "markerfacecolor": "white"},
    SETTLED: {"marker": "o", "markerfacecolor": "white"},
    FAILED: {"marker": "x", "markersize": 5},
    ENDS["vanishes"]: {"marker": "X", "markersize": 5},
    ENDS["edge"]: {"marker": "s", "markersize": 5},
}
"""How points look that mark something, by their entries in the legend."""
ZEROS = UNSTABLE, STABLE


@dataclass(frozen=True)
class Series:
    """The rows of one series in one panel.

    Attributes:
        panel: Number of the panel.
        x, y: The values, (n,).
        look: Colour, line style, marker and what else a line of matplotlib has.
        error, x_error: Half-widths of the intervals of y and x, (n,): a band around a line, bars at points.
        mark: One of `MARKS`, or `POINT` for points without an entry in the legend; "" for a line.
        label: Its entry in the legend of the panel, or above a single one; "" for none.
        marked: Rows of a line that have a marker.
        t: Times of the rows, (n,), where a brief start-up may reach out of the panel.
    """

    panel: int
    x: Array
    y: Array
    look: Mapping[str, Any] = field(default_factory=dict)
    error: Array | None = None
    x_error: Array | None = None
    mark: str = ""
    label: str = ""
    marked: Sequence[int] = ()
    t: Array | None = None

    def range(self, *, bars: bool) -> Array:
        """The values of y and, with `bars`, the known ends of their intervals."""
        error = np.zeros(1) if self.error is None or not bars else np.nan_to_num(self.error, posinf=0.0)
        return np.concatenate([self.y - error, self.y + error])


def point(
    panel: int,
    x: float,
    y: float,
    mark: str,
    look: Mapping[str, Any],
    error: float | None = None,
    x_error: float | None = None,
) -> Series:
    """A series of one point; errors that are None or not finite have no bars."""
    known = (None if each is None or not np.isfinite(each) else np.array([each]) for each in (error, x_error))
    y_bar, x_bar = known
    return Series(panel, np.array([x]), np.array([y]), look, y_bar, x_bar, mark)


@dataclass(frozen=True)
class Panel:
    """The axes of a panel.

    Attributes:
        x, y: Their labels, with units.
        title: Above it.
        wide: The axes, of "x" and "y", that are logarithmic where values span a wide range.
        like: Number of the panel whose axes it shares; the same in all that share them.
        margins: Part of the range around what is drawn, along x and y.
        shade: From and to where it is grey, along x.
        bars: Whether bars set the range, and not points alone.
    """

    x: str
    y: str
    title: str = ""
    wide: str = ""
    like: int | None = None
    margins: tuple[float, float] = (0.05, 0.05)
    shade: tuple[float, float] | None = None
    bars: bool = True


def draw_chart(
    page: Page,
    panels: Sequence[Panel],
    series: Sequence[Series],
    parts: Sequence[str],
    encoding: Encoding | None = None,
    handles: Sequence[Any] = (),
    columns: int | None = None,
) -> tuple[Figure, list[Axes]]:
    """Draw series into panels, with a legend of all of them and the small print.

    Args:
        page: What it is drawn for.
        panels: The panels.
        series: What is drawn in them.
        parts: The small print.
        encoding: What tells the series apart.
        handles: Entries of the legend beside those of the encoding, of bands and of marks.
        columns: As in `Page.panels`.
    """
    count = len(panels)
    figure, axes = page.panels(count, 66 if count == 1 else 50 if count <= 6 else 40, 14, columns)
    for number, (axis, panel) in enumerate(zip(axes, panels, strict=True)):
        if panel.like is not None and panel.like != number:
            axis.sharex(axes[panel.like])
            axis.sharey(axes[panel.like])
        inside = [each for each in series if each.panel == number]
        group = [each for each in series if panel.like is not None and panels[each.panel].like == panel.like]
        _draw_panel(axis, panel, inside, group or inside)
    labelled = [axis.get_legend_handles_labels()[0] for axis in axes]
    for axis, entries in zip(axes, labelled, strict=True):
        if count > 1 and len(entries) > 1:
            axis.legend()
    handles = [*handles, *(labelled[0] if count == 1 else [])]
    if encoding is not None:
        encoding.bar(figure, axes)
        lines, points = any(not each.mark for each in series), any(each.mark or each.marked for each in series)
        handles = [*encoding.handles(lines=lines, points=points), *handles]
        parts = [*parts, *(f"all values of {symbol(name)}" for name in encoding.untold)]
    key(figure, [*handles, *notes(series)])
    small_print(figure, parts)
    return figure, axes


def _draw_panel(axis: Axes, panel: Panel, inside: Sequence[Series], group: Sequence[Series]) -> None:
    """What lies in a panel, on axes for a group of them."""
    axis.set_title(panel.title)
    axis.margins(*panel.margins)
    if panel.shade is not None:
        axis.axvspan(*panel.shade, color=START_UP, linewidth=0, zorder=0.1)
    band = BAND * min(1.0, TOGETHER / max(sum(each.error is not None for each in inside), 1))
    for name in panel.wide:
        spread(axis, name, [float(v) for each in group for v in (each.x if name == "x" else each.y)])
    axis.update_datalim([place for each in inside for place in zip(each.x, each.y, strict=True)])
    axis.autoscale_view()
    seen = axis.axis()
    for each in inside:
        draw_series(axis, each, band)
    if not panel.bars:
        axis.axis(seen)
    finish(axis, panel.x, panel.y, [each.range(bars=panel.bars) for each in group])
    widen(axis, "x", [each.x for each in group])
    if timed := [(each.t, each.y) for each in inside if each.t is not None]:
        leave_out_spikes(axis, timed)


def draw_series(axis: Axes, series: Series, band: float = BAND) -> None:
    """A line with its band, or points with their bars.

    Args:
        axis: The panel.
        series: What is drawn.
        band: Opacity of the band.
    """
    if series.mark or len(series.x) == 1:
        look: dict[str, Any] = {"marker": "o", "linestyle": "", "elinewidth": 0.8, "zorder": 5}
        look |= MARKS.get(series.mark, {"markersize": 3}) | dict(series.look)
        axis.errorbar(series.x, series.y, series.error, series.x_error, label=series.label, **look)
        return
    look = {"marker": "", **series.look}
    axis.plot(series.x, series.y, label=series.label, markevery=list(series.marked), **look)
    if series.error is not None:
        fill(axis, series.x, series.y, series.error, look | {"band": band})


def fill(axis: Axes, x: Array, y: Array, error: Array, look: Mapping[str, Any]) -> None:
    """The band of half-width `error` around a line."""
    error = np.where(np.isfinite(error), error, np.nan)  # between two points alone nothing is known
    axis.fill_between(x, y - error, y + error, color=look["color"], alpha=look["band"], linewidth=0)


def notes(series: Sequence[Series]) -> list[Any]:
    """Entries of the legend for bands and marks."""
    entries: list[Any] = []
    if any(each.error is not None and not each.mark for each in series):
        entries.append(Patch(color="0.35", alpha=BAND, linewidth=0, label=r"error of $\Delta U$"))
    marked = {each.mark for each in series}
    looks = ((mark, look) for mark, look in MARKS.items() if mark in marked)
    return entries + [Line2D([], [], label=mark, color="0.2", linestyle="", **look) for mark, look in looks]
