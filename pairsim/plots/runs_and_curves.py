"""The pictures of a run, of a curve, and of several runs or several curves in one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
from matplotlib.patches import Patch

from pairsim.analysis.master_curve import Curve
from pairsim.analysis.time_series import Series
from pairsim.cases.physical import BLOCK
from pairsim.plots.chart import START_UP, Line, Panel, draw_chart
from pairsim.plots.encoding import Encoding, check_group
from pairsim.plots.labels import case_parts, common_parts, equation, read_case, varying_keys
from pairsim.plots.lines import lines_of, panels_of, run_lines, told_apart
from pairsim.plots.parameters import NO_PARAMETERS
from pairsim.plots.style import Page, printing
from pairsim.plots.units import Units
from pairsim.quantities.kinds import POSITION, TIME
from pairsim.record.column import GAP
from pairsim.record.columns import DISTANCE, TAYLOR, Q, T
from pairsim.record.folder import SERIES, WAY, kind_of
from pairsim.runtime.errors import InputError

FOLDER, DIFFERENCES = "folder", "differences"
ALIKE = 0.05  # lines whose differences are below this part of their range count as lying on each other


@printing()
def draw_run(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `series`: distances, relative velocities and D over time, and dU over d.

    Without a gap there are velocities, or the pressure drop, and D. The part in which the run starts up is grey.

    Raises:
        InputError: The folder is not that of a run, or holds no row yet.
    """
    if not (directory / SERIES).is_file():
        raise InputError(str(directory), "", None, f"is not the folder of a run that has begun: it has no {SERIES}")
    units = Units.of(directory, page.physical)
    run = Series.read(directory)
    if not run.table.has(T) or not run.table.rows:
        raise InputError(str(directory / SERIES), "", None, "has no rows yet; wait for the first step")
    parts = case_parts(read_case(directory / "case.yaml"), physical=units.scales is not None)
    series = run.converted(units.scales)
    starting = min(run.start_up * units.factor(TIME), float(series.t[-1]))
    lines = told_apart(run_lines(series, NO_PARAMETERS, places=len(series.gaps) > 1, flow=series.table.has(Q)))
    above = None
    if places := series.places:
        along = np.mean(places, axis=0)
        if len(along) > 1 and (np.diff(along) > 0).all():
            above = f"position along the tube  [{units.name(POSITION)}]", series.t, along - along[0]
    panels, shade = panels_of(lines, units), (0.0, starting) if starting else None
    for name in (each for each in panels if each[0] is T):
        panels[name] = replace(panels[name], shade=shade, above=above if name[1] is DISTANCE else None)
    handles = [Patch(color=START_UP, label="start-up")] if starting else []
    figure, _ = draw_chart(page, panels, lines, parts, handles=handles)
    return page.save(figure, out, "series")


@printing()
def draw_curve(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `curve`: dU over d with its error as a band and its zeros, and D of the particles.

    No file is written for a single particle, for points whose gaps differ from each other, or for a branch that ends
    before the first point.

    Raises:
        InputError: The folder is not that of a curve, or holds no point yet.
    """
    if (directory / WAY).is_file() and not (directory / "curve.csv").is_file():
        return []
    units = Units.of(directory, page.physical)
    if not Curve.read(directory).table.rows:
        raise InputError(str(directory / "curve.csv"), "", None, "has no points yet")
    lines = told_apart(lines_of(directory, units, curve=True))
    if not lines:
        return []
    parts = case_parts(read_case(directory / "case.yaml"), physical=units.scales is not None)
    figure, _ = draw_chart(page, panels_of(lines, units, wide="x"), lines, parts)
    return page.save(figure, out, "curve")


def overlay(folders: Sequence[Path], out: Path, page: Page, group: str | None = None) -> list[Path]:
    """Draw `runs` or `curves`: dU of all folders in the same panels; what differs is in the legend.

    The key `group` chooses colours: any that differs, also a quantity such as physical.flow_rate; by default the one
    with most values of those that tell the cases apart.

    Raises:
        InputError: A folder is of another kind, or has nothing to draw yet.
    """
    kind, *others = dict.fromkeys(map(kind_of, folders))
    if others or kind not in ("run", "curve"):
        allowed = "must be all runs or all curves, to be drawn together"
        raise InputError("pairsim plot", "", ", ".join([kind, *others]), allowed)
    if len(set(folders)) < len(folders):
        raise InputError("pairsim plot", "", str(folders[0]), "must be named once")
    whole = [read_case(folder / "case.yaml") for folder in folders]
    cases = [case.parameters for case in whole]
    differ = [key for key in dict.fromkeys(chain(*cases)) if len({case.get(key) for case in cases}) > 1]
    gaps = ["gap"] if any(case.particles > 2 for case in whole) else []
    check_group(group, [*dict.fromkeys([*varying_keys(cases), *differ, *gaps])])
    first = _first(differ, group)
    keys = varying_keys(cases, first=first)
    told_apart = len({case.at(keys) for case in cases}) == len(cases)
    if not told_apart or Encoding.of(cases, keys, group if group in keys else None).untold:
        cases = [case | {FOLDER: str(folder)} for case, folder in zip(cases, folders, strict=True)]
        keys = [*first[:1], FOLDER]
    units = Units.of_all(folders, page.physical)
    lines: list[Line] = []
    for folder, case, own in zip(folders, cases, units, strict=True):
        found = lines_of(folder, own, case, curve=kind == "curve")
        if not found:
            raise InputError(
                str(folder), "", None, "has nothing to draw: no rows yet, or no curve over a single distance"
            )
        lines += found
    parts = common_parts(whole, keys, units[0].scales is not None)
    return draw_overlay(lines, keys, parts, units[0], out, page, f"{kind}s", group)


def _first(differ: Sequence[str], group: str | None) -> list[str]:
    """The keys by which cases are told apart before all others: `group`, if it is among those that differ.

    If it is a quantity of an experiment, the other quantities follow, before the numbers that follow from them.
    """
    if group is None or group not in differ:
        return []
    quantities = [key for key in differ if key.startswith(BLOCK)]
    return [group, *(quantities if group in quantities else ())]


@printing()
def draw_overlay(
    lines: Sequence[Line],
    keys: Sequence[str],
    parts: Sequence[str],
    units: Units,
    out: Path,
    page: Page,
    stem: str,
    group: str | None = None,
) -> list[Path]:
    """Draw lines whose cases differ in some keys: those of runs over time and distance, those of curves over distance.

    Lines are as `lines_of` makes them, at least one, and their cases have `parts` in common. Where they lie on each
    other, one more panel has their differences from one of them. The key `group` chooses colours.

    Raises:
        InputError: `group` does not differ.
    """
    lines = [each for each in lines if each.panel[1] is not TAYLOR]
    over = lines[0].panel[0]
    motion = [each for each in lines if each.panel[0] is over and each.panel[1] is not DISTANCE and not each.mark]
    gaps = ["gap"] if any("gap" in each.parameters for each in motion) else []
    encoding = Encoding.of([each.parameters for each in motion], [*keys, *gaps], group)
    drawn = {key: {each.parameters.get(key) for each in motion} for key in keys}
    parts = [
        *parts,
        *(equation(key, *values) for key, values in drawn.items() if len(values) == 1),
    ]  # the others failed
    if encoding.panel:
        lines = [each for each in lines if each.panel[0] is over]
    chart = panels_of(lines, units, wide="x" * (over is DISTANCE))
    if not encoding.panel and (differences := _differences(motion, encoding, units, [*keys, *gaps])) is not None:
        chart[DIFFERENCES], more = differences
        lines += more
    figure, _ = draw_chart(page, chart, lines, parts, encoding)
    return page.save(figure, out, stem)


def _differences(
    lines: Sequence[Line], encoding: Encoding, units: Units, keys: Sequence[str]
) -> tuple[Panel, list[Line]] | None:
    """Differences of lines from a reference, whose case differs in one key alone, with the sum of both half-widths.

    Returns their panel and their lines; None where the lines themselves do not lie on each other.
    """
    key = encoding.line or encoding.colour
    if key in ("", "gap"):
        return None
    reference = encoding.values[key][0]
    found = []
    for line in lines:
        for other in lines:
            same = all(other.parameters.get(name) == line.parameters.get(name) for name in keys if name != key)
            differ = line.parameters.get(key) != reference == other.parameters.get(key)
            if not same or not differ or line.columns != other.columns:
                continue
            x = line.x[(line.x >= other.x[0]) & (line.x <= other.x[-1])]
            apart = np.interp(x, line.x, line.y) - np.interp(x, other.x, other.y)
            if len(x) and 0 < np.abs(apart).max() < ALIKE * np.ptp(other.y):
                errors = [np.interp(x, each.x, each.error) for each in (line, other) if each.error is not None]
                error = errors[0] + errors[1] if len(errors) == 2 else None
                t = None if line.t is None else x
                found.append(replace(line, panel=DIFFERENCES, x=x, y=apart, error=error, marked=(), t=t))
    if not found or found[0].columns is None:
        return None
    over, y = found[0].columns
    symbol, unit = y.symbol, units.name(y.unit)
    label = f"${symbol} - {symbol}$({equation(key, reference)})  [{unit}]"
    return Panel(units.axis_label([over]), label, wide="x" * (over.of == GAP)), found
