"""The time series of one run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from pairsim.plots.labels import axis_label, case_parts, finish, read_case
from pairsim.plots.lines import BAND, fill
from pairsim.plots.style import COLOURS, LINES, Page, key, printing, small_print
from pairsim.results.columns import column, error_column, relative_velocities
from pairsim.results.folders import read_record
from pairsim.results.output import SERIES, read_series
from pairsim.results.run_answer import Settled, start_up
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

START_UP = "0.88"  # grey of the part in which a run starts up


@printing()
def draw_series(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `series`: relative velocities (or velocities, or the pressure drop) and D over time, and dU over d.

    The part in which the run starts up is marked, and at its end dU of quasi-steady motion.

    Args:
        directory: Folder of a run, finished or not.
        out: Folder of the pictures.
        page: What they are drawn for.

    Raises:
        InputError: The folder is not that of a run, or holds no row yet.
    """
    if not (directory / SERIES).is_file():
        raise InputError(str(directory), "", None, f"is not the folder of a run that has begun: it has no {SERIES}")
    series = read_series(directory / SERIES)
    if "t" not in series or not len(series["t"]):
        raise InputError(str(directory / SERIES), "", None, "has no rows yet; wait for the first step")

    def of(prefix: str) -> list[str]:
        return [name for name in series if name == prefix or name.startswith(prefix + "_")]

    relative = relative_velocities(series)
    panels = [(["t"], relative or of("U") or ["dp"])]
    if shapes := of("D"):
        panels.append((["t"], shapes))
    if relative:
        panels.append(([f"d{name.removeprefix('dU')}" for name in relative], relative))
    record = read_record(directory)
    starting = int(np.count_nonzero(series["t"] < start_up(record)))
    figure, axes = (page if len(panels) > 1 else page.alone()).panels(len(panels), height=48)
    for axis, (against, names) in zip(axes, panels, strict=True):
        for i, name in enumerate(names):
            x = against[min(i, len(against) - 1)]
            label = f"${column(name).symbol}$" if against == ["t"] else f"${column(name).symbol}({column(x).symbol})$"
            error = error_column(series, name.removeprefix("dU")) if name in relative else None
            _line(axis, series[x], series[name], i, label, series[error] if error is not None else None)
            if against != ["t"]:
                _draw_settled(axis, series[x], series[name], i, starting, Settled.of(record, i))
        if against == ["t"] and starting:
            axis.axvspan(0.0, min(start_up(record), series["t"][-1]), color=START_UP, linewidth=0, zorder=0.1)
        finish(axis, axis_label(against), axis_label(names), [series[name] for name in names])
        axis.xaxis.set_major_locator(MaxNLocator(5))
        axis.yaxis.set_major_locator(MaxNLocator(6))
        if len(names) > 1:
            axis.legend(ncols=1 if len(names) < 5 else 2)
    key(figure, _notes(starting > 0, bool(relative) and Settled.of(record, 0) is not None))
    small_print(figure, case_parts(read_case(directory / "case.yaml")))
    return page.save(figure, out, "series")


def _draw_settled(axis: Axes, d: Array, dU: Array, place: int, starting: int, settled: Settled | None) -> None:
    """The start-up as a wide light line below that of a run over d, and quasi-steady motion at its end."""
    if starting:
        until = starting + 1
        axis.plot(d[:until], dU[:until], color=START_UP, linewidth=5, solid_capstyle="butt", zorder=0.1)
    if settled is not None:
        look: dict[str, Any] = {"color": COLOURS[place % len(COLOURS)], "markerfacecolor": "white", "zorder": 3}
        axis.errorbar(d[-1:], [settled.dU], [settled.error], marker="o", capsize=2, linewidth=0.8, **look)


def _notes(starting: bool, settled: bool) -> list[Any]:
    """Legend entries of the start-up and of quasi-steady motion."""
    marker = Line2D([], [], color=COLOURS[0], marker="o", markerfacecolor="white", linestyle="")
    marker.set_label("quasi-steady motion at the last distance")
    return [*([Patch(color=START_UP, label="start-up")] if starting else []), *([marker] if settled else [])]


def _line(axis: Axes, x: Array, y: Array, place: int, label: str, error: Array | None) -> None:
    style = LINES[place % len(LINES)]
    (line,) = axis.plot(x, y, linestyle=style, marker="o" if len(x) == 1 else "", label=label)
    if error is not None:
        fill(axis, x, y, error, {"color": line.get_color(), "band": BAND})
