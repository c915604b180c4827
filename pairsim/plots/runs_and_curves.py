"""The pictures of one run, and of one curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.patches import Patch

from pairsim.plots.chart import SETTLED, START_UP, Series, draw_chart, point, small_print
from pairsim.plots.labels import case_parts, read_case
from pairsim.plots.lines import lines_of, panels_of, run_lines, told_apart
from pairsim.plots.space_time import draw_space_time
from pairsim.plots.style import Page, printing
from pairsim.plots.units import Units
from pairsim.results.columns import suffixes_in
from pairsim.results.folder import SERIES, WAY, read_record
from pairsim.results.settled import Settled, start_up
from pairsim.results.table_files import read_table
from pairsim.results.units import TIME, VELOCITY
from pairsim.runtime.errors import InputError

MOST_LINES = 3  # gaps in a panel; the gaps of more particles are rows of a picture over time


@printing()
def draw_run(directory: Path, out: Path, page: Page) -> list[Path]:
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
    table = units.table(read_table(directory / SERIES))
    if "t" not in table or not len(table["t"]):
        raise InputError(str(directory / SERIES), "", None, "has no rows yet; wait for the first step")
    parts = case_parts(read_case(directory / "case.yaml"))
    gaps = suffixes_in(table, "dU")
    if len(gaps) > MOST_LINES:
        names = [[name + each for each in suffixes_in(table, name)] for name in ("d", "dU", "D")]
        figure = draw_space_time(page, table, names, units)
        small_print(figure, parts)
        return page.save(figure, out, "series")
    record = read_record(directory)
    starting = min(start_up(record) * units.factor(TIME), float(table["t"][-1]))
    lines = told_apart(run_lines(table, {}))
    panels = panels_of(lines, units)
    if starting:
        panels = {
            name: replace(panel, shade=(0.0, starting) if name[0] == "t" else None) for name, panel in panels.items()
        }
    over_d = [each for each in lines if each.panel == ("d", "dU")]
    series = [*lines, *_start_up(over_d, starting), *_settled(over_d, record, units.factor(VELOCITY))]
    handles = [Patch(color=START_UP, label="start-up")] if starting else []
    figure, _ = draw_chart(page, panels, series, parts, handles=handles)
    return page.save(figure, out, "series")


def _start_up(lines: Sequence[Series], end: float) -> list[Series]:
    """The part of each line in which a run starts up, as a wide line behind it."""
    wide = {"color": START_UP, "linewidth": 5, "linestyle": "-", "solid_capstyle": "butt", "zorder": 0.1}
    found = []
    for each in lines:
        count = 1 + int(np.count_nonzero(each.t < end)) if each.t is not None else 0
        if end and count > 1:
            found.append(Series(each.panel, each.x[:count], each.y[:count], look=wide))
    return found


def _settled(lines: Sequence[Series], record: Mapping[str, Any], velocity: float) -> list[Series]:
    """Quasi-steady motion at the last distances of lines, times a velocity, where it is known."""
    known = [(each, at) for i, each in enumerate(lines) if (at := Settled.of(record, i)) is not None]
    return [
        point(
            each.panel, each.x[-1], at.dU * velocity, SETTLED, at.error * velocity, look={"color": each.look["color"]}
        )
        for each, at in known
    ]


@printing()
def draw_curve(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `curve`: dU over d with its error as a band and its zeros, and D of the particles.

    Args:
        directory: Folder of a curve, finished or not.
        out: Folder of the pictures.
        page: What they are drawn for.

    Returns:
        The files written; none for a single particle, places that differ in their gaps, or a branch that ends before
        the first point.

    Raises:
        InputError: The folder is not that of a curve, or holds no point yet.
    """
    if (directory / WAY).is_file() and not (directory / "curve.csv").is_file():
        return []
    units = Units.of(directory, page.physical)
    if not len(next(iter(read_table(directory / "curve.csv").values()))):
        raise InputError(str(directory / "curve.csv"), "", None, "has no points yet")
    lines = told_apart(lines_of(directory, units, curve=True))
    if not lines:
        return []
    parts = case_parts(read_case(directory / "case.yaml"))
    figure, _ = draw_chart(page, panels_of(lines, units, wide="x"), lines, parts)
    return page.save(figure, out, "curve")
