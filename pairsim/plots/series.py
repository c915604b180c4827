"""The time series of one run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pairsim.plots.axes import finish, key, leave_out_spikes, small_print, widen
from pairsim.plots.labels import case_parts, read_case
from pairsim.plots.lines import BAND, fill
from pairsim.plots.space_time import draw_space_time
from pairsim.plots.style import COLOURS, LINES, Page, printing
from pairsim.plots.units import Units
from pairsim.results.columns import TIME, VELOCITY, column, error_of, suffixes_in
from pairsim.results.folders import read_record
from pairsim.results.output import SERIES
from pairsim.results.run_answer import Settled, start_up
from pairsim.results.table_files import read_table
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

START_UP = "0.88"  # grey of the part in which a run starts up
MOST_LINES = 3  # gaps in a panel; the gaps of more particles are rows of a picture over time


@printing()
def draw_series(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `series`: distances, relative velocities and D over time, and dU over d.

    Without a gap, velocities or the pressure drop, and D. The part in which the run starts up is marked, and at its
    end dU of quasi-steady motion.

    Args:
        directory: Folder of a run, finished or not.
        out: Folder of the pictures.
        page: What they are drawn for.

    Raises:
        InputError: The folder is not that of a run, or holds no row yet.
    """
    if not (directory / SERIES).is_file():
        raise InputError(str(directory), "", None, f"is not the folder of a run that has begun: it has no {SERIES}")
    units = Units.of(directory, page.physical)
    series = units.table(read_table(directory / SERIES))
    if "t" not in series or not len(series["t"]):
        raise InputError(str(directory / SERIES), "", None, "has no rows yet; wait for the first step")
    d, relative, U, D = ([name + each for each in suffixes_in(series, name)] for name in ("d", "dU", "U", "D"))
    record = read_record(directory)
    starting = min(start_up(record) * units.factor(TIME), float(series["t"][-1]))
    if len(relative) > MOST_LINES:
        notes: list[Any] = []
        figure = draw_space_time(page, series, [d, relative, D], units)
    else:
        notes = [Patch(color=START_UP, label="start-up")] if starting else []
        over_t = [d, relative or U or ["dp"], D]
        panels = [(["t"], names) for names in over_t if names] + [(d, relative)] * bool(relative)
        figure, axes = page.panels(len(panels), height=48)
        for axis, (against, names) in zip(axes, panels, strict=True):
            _draw_panel(axis, series, against, names, starting, units)
        if relative:
            notes += _draw_settled(axes[-1], series, *panels[-1], record, units.factor(VELOCITY))
    key(figure, notes)
    small_print(figure, case_parts(read_case(directory / "case.yaml")))
    return page.save(figure, out, "series")


def _draw_panel(
    axis: Axes, series: Mapping[str, Array], against: Sequence[str], names: Sequence[str], starting: float, units: Units
) -> None:
    """Columns over t, or each over a column of its own, with the start-up marked."""
    starts = int(np.count_nonzero(series["t"] < starting)) + 1
    over_t = against == ["t"]
    for i, (x, name) in enumerate(zip([*against] * len(names), names, strict=False)):
        look: dict[str, Any] = {"color": COLOURS[i], "linestyle": LINES[i]}
        look |= {"label": f"${column(name).symbol}$" if over_t else f"${column(name).symbol}({column(x).symbol})$"}
        axis.plot(series[x], series[name], marker="o" if len(series[x]) == 1 else "", **look)
        if (error := series.get(error_of(name))) is not None:
            fill(axis, series[x], series[name], error, look | {"band": BAND})
        if not over_t and starting:
            wide: dict[str, Any] = {"linewidth": 5, "linestyle": "-", "solid_capstyle": "butt", "zorder": 0.1}
            axis.plot(series[x][:starts], series[name][:starts], color=START_UP, **wide)
    if over_t and starting:
        axis.axvspan(0.0, starting, color=START_UP, linewidth=0, zorder=0.1)
    finish(axis, units.axis_label([*against]), units.axis_label([*names]), [series[name] for name in names])
    widen(axis, "x", [series[x] for x in against])
    leave_out_spikes(axis, [(series["t"], series[name]) for name in names])
    if len(names) > 1:
        axis.legend()


def _draw_settled(
    axis: Axes,
    series: Mapping[str, Array],
    d: Sequence[str],
    dU: Sequence[str],
    record: Mapping[str, Any],
    velocity: float,
) -> list[Line2D]:
    """Quasi-steady motion at the last distances, times a velocity, where it is known, and its entry of the legend."""
    known = [(i, settled) for i in range(len(dU)) if (settled := Settled.of(record, i)) is not None]
    look: dict[str, Any] = {"marker": "o", "markerfacecolor": "white", "linestyle": "", "zorder": 3}
    for i, settled in known:
        bar: dict[str, Any] = {"elinewidth": 0.8, "capsize": 2, "color": COLOURS[i]}
        axis.errorbar(series[d[i]][-1:], [settled.dU * velocity], [settled.error * velocity], **look, **bar)
    return [Line2D([], [], color=COLOURS[0], label="quasi-steady motion at the last distance", **look)] if known else []
