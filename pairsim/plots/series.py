"""The time series of one run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.patches import Patch

from pairsim.plots.axes import small_print
from pairsim.plots.chart import SETTLED, START_UP, Panel, Series, draw_chart, point
from pairsim.plots.labels import case_parts, read_case
from pairsim.plots.space_time import draw_space_time
from pairsim.plots.style import COLOURS, LINES, Page, printing
from pairsim.plots.units import Units
from pairsim.results.columns import column, error_of, suffixes_in
from pairsim.results.folder import SERIES, read_record
from pairsim.results.settled import Settled, start_up
from pairsim.results.table_files import read_table
from pairsim.results.units import TIME, VELOCITY
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

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
    parts = case_parts(read_case(directory / "case.yaml"))
    if len(relative) > MOST_LINES:
        figure = draw_space_time(page, series, [d, relative, D], units)
        small_print(figure, parts)
        return page.save(figure, out, "series")
    over_t = [(["t"], names) for names in (d, relative or U or ["dp"], D) if names]
    columns = over_t + [(d, relative)] * bool(relative)
    shade = (0.0, starting) if starting else None
    panels = [Panel(units.axis_label(x), units.axis_label(y), shade=shade if x == ["t"] else None) for x, y in columns]
    table = [each for i, (x, y) in enumerate(columns) for each in _lines(i, series, x, y)]
    if relative:
        last = len(panels) - 1
        table += _start_up(last, series, d, relative, starting)
        table += _settled(last, series, d, record, units.factor(VELOCITY))
    handles = [Patch(color=START_UP, label="start-up")] if starting else []
    figure, _ = draw_chart(page, panels, table, parts, handles=handles)
    return page.save(figure, out, "series")


def _lines(panel: int, series: Mapping[str, Array], against: Sequence[str], names: Sequence[str]) -> list[Series]:
    """Columns over t, or each over a column of its own."""
    found = []
    for i, name in enumerate(names):
        x = against[i % len(against)]
        label = f"${column(name).symbol}$" if x == "t" else f"${column(name).symbol}({column(x).symbol})$"
        look = {"color": COLOURS[i], "linestyle": LINES[i]}
        error = series.get(error_of(name))
        found.append(Series(panel, series[x], series[name], look, error, label=label, t=series["t"]))
    return found


def _start_up(
    panel: int, series: Mapping[str, Array], d: Sequence[str], dU: Sequence[str], starting: float
) -> list[Series]:
    """The part of dU over d in which a run starts up, as a wide line behind it."""
    starts = int(np.count_nonzero(series["t"] < starting)) + 1 if starting else 0
    wide = {"color": START_UP, "linewidth": 5, "linestyle": "-", "solid_capstyle": "butt", "zorder": 0.1}
    pairs = zip(d, dU, strict=True) if starts > 1 else ()
    return [Series(panel, series[x][:starts], series[name][:starts], wide) for x, name in pairs]


def _settled(
    panel: int, series: Mapping[str, Array], d: Sequence[str], record: Mapping[str, Any], velocity: float
) -> list[Series]:
    """Quasi-steady motion at the last distances, times a velocity, where it is known."""
    known = [(i, settled) for i in range(len(d)) if (settled := Settled.of(record, i)) is not None]
    return [
        point(panel, series[d[i]][-1], at.dU * velocity, SETTLED, {"color": COLOURS[i]}, at.error * velocity)
        for i, at in known
    ]
