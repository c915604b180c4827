"""Pictures of a sweep: all its lines in one, and the results against the parameters."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.cases.physical import BLOCK
from pairsim.plots.chart import POINT, ZERO_MARKS, Line, Panel, draw_chart, point
from pairsim.plots.encoding import Encoding
from pairsim.plots.labels import common_parts, parameter_label, read_case, varying_keys
from pairsim.plots.lines import MOTION, lines_of
from pairsim.plots.parameters import Parameters, measured
from pairsim.plots.runs_and_curves import draw_overlay
from pairsim.plots.style import Page, printing
from pairsim.plots.units import Units
from pairsim.quantities.kinds import LENGTH
from pairsim.record.column import Column, Columns
from pairsim.record.columns import D_CR, DE, DU, STABLE, ZEROS, ZEROS_ERROR
from pairsim.runtime.errors import InputError
from pairsim.sweeps.folder import SweptCase, read_sweep


def plot_sweep(
    directory: Path, out: Path | None = None, group: str | None = None, page: Page | None = None
) -> list[Path]:
    """Draw a sweep, finished or not; colours distinguish the values of the varying key `group`.

    Returns:
        The files written: `sweep_series` of runs (every case against t and d), or `sweep_curves` of curves. If a
        parameter is a number, also `sweep_parameters` of runs (the last dU), or `sweep_zeros` of curves and critical
        distances (the zeros of dU), both over the parameter with the most values.

    Raises:
        InputError: The folder is not that of a sweep, has nothing to draw, or `group` does not vary.
    """
    page, target, sweep = page or Page(), out or directory, read_sweep(directory)
    if not any(case.state.status == "finished" for case in sweep.ended):
        raise InputError(str(directory), "", None, "has no finished case yet; pairsim status shows how it stands")
    units = Units.of_all([directory / case.folder for case in sweep.ended], page.physical)
    cases = [Drawn(case, own, directory) for case, own in zip(sweep.ended, units, strict=True)]
    parameters, varying, command = [case.parameters for case in cases], sweep.varying, sweep.question.name
    if quantities := [key for key in varying if key.startswith(BLOCK)]:
        # Numbers that follow from physical quantities are not listed as parameters, unless one is chosen as the group.
        telling = varying_keys(parameters, [*quantities, *varying])
        varying = [key for key in varying if key in telling or key == group]
    Encoding.of(parameters, varying, group)  # refuses keys that do not vary
    chosen = max(cases, key=_elasticity), cases[0], cases[-1]
    contents = [read_case(case.folder / "case.yaml") for case in chosen]
    parts = common_parts(contents, varying, units[0].scales is not None, sweep.varying)
    written: list[Path] = []
    if command in ("run", "curve") and (lines := _lines(cases, command == "curve")):
        stem = "sweep_curves" if command == "curve" else "sweep_series"
        written += draw_overlay(lines, varying, parts, units[0], target, page, stem, group)
    if command == "run" or any(case.values(ZEROS) for case in cases):
        main = sweep.question.tables[sweep.question.table] if command == "run" else None
        written += _draw_parameters(cases, main, varying, parts, group, target, page)
    if not written:
        drawn = sweep.question.in_sweeps.drawn
        has = "no zero of dU over a number that varies" if drawn else "pictures only in the folders of its cases"
        raise InputError(str(directory), "", None, f"is a sweep of `pairsim {command}`, which has {has}")
    return written


@dataclass(frozen=True)
class Drawn:
    """A case that has ended, with the units that it is drawn in."""

    case: SweptCase
    units: Units
    directory: Path  # of the sweep

    @property
    def folder(self) -> Path:
        """The folder of the case."""
        return self.directory / self.case.folder

    @cached_property
    def parameters(self) -> Parameters:
        """The values of the keys that vary."""
        return Parameters(self.case.parameters)

    @property
    def finished(self) -> bool:
        """Whether it has a result."""
        return self.case.state.status == "finished"

    def number(self, name: str) -> float | None:
        """A number in results.csv; None where the case does not have it."""
        found = self.case.state.values.get(name)
        return float(found) if isinstance(found, int | float) else None

    def values(self, column: Column) -> list[Any]:
        """A list in results.csv, empty where the case does not have it."""
        found: Any = self.case.state.values.get(column.name)
        return found or []


def _elasticity(case: Drawn) -> float:
    De = case.parameters.get(DE.name)
    return float(De) if isinstance(De, int | float) else 0.0


def _lines(cases: Sequence[Drawn], curve: bool) -> list[Line]:
    """The lines of all cases, as in the pictures of their folders; a cross ends the line of a case that failed."""
    lines: list[Line] = []
    for case in cases:
        with suppress(InputError):  # a case that failed before its first row has nothing to show
            lines += lines_of(case.folder, case.units, case.parameters, curve=curve, failed=not case.finished)
    return lines


@printing()
def _draw_parameters(
    cases: Sequence[Drawn],
    main: Columns | None,
    varying: Sequence[str],
    parts: Sequence[str],
    group: str | None,
    out: Path,
    page: Page,
) -> list[Path]:
    """Draw the last value of a quantity, or the zeros of dU, over the varying number with the most values.

    The other varying keys determine colours, styles and panels. Nothing is drawn if no number varies. `main` has the
    columns of the main table of runs; it is None for zeros.
    """
    known = {name: measured([case.parameters.get(name) for case in cases]) for name in varying}
    numbers = {name: pair for name, pair in known.items() if pair is not None and len(set(pair[0])) > 1}
    if not numbers:
        return []
    free = [name for name in numbers if name != group] or list(numbers)
    name = max(free, key=lambda each: len(set(numbers[each][0])))
    others, (places, unit) = [other for other in varying if other != name], numbers[name]
    encoding = Encoding.of([case.parameters for case in cases], others, group if group in others else None)
    named = cases[0].units.axis_label
    if main is not None:
        results = {key for case in cases for key in case.case.state.values}
        found = (each.name + end for each in MOTION for end in ("", "_1") if each.name + end in results)
        last = next(found, DU.name)
        words = named([main.column(last)], " at the end")
        lines = _ends(cases, places, main.column(last), main.half_width(last), encoding)
    else:
        words, lines = named([D_CR]), _zeros(cases, places)
    figure, _ = draw_chart(page, {0: Panel(parameter_label(name, unit), words, "x")}, lines, parts, encoding)
    return page.save(figure, out, "sweep_parameters" if main is not None else "sweep_zeros")


def _ends(
    cases: Sequence[Drawn], places: Sequence[float], quantity: Column, half_width: str, encoding: Encoding
) -> list[Line]:
    """The last values of a quantity, with half-widths from a column; a line joins cases that differ in x alone."""
    lines: dict[Hashable, tuple[Parameters, list[tuple[float, float, float]]]] = {}
    for place, case in zip(places, cases, strict=True):
        if case.finished and (last := case.number(quantity.name)) is not None:
            size, error = case.units.factor(quantity.unit), case.number(half_width)
            row = place, size * last, np.nan if error is None else size * error
            lines.setdefault(case.parameters.at(encoding.values), (case.parameters, []))[1].append(row)
    found = []
    for parameters, rows in lines.values():
        x, y, error = np.array(sorted(rows)).T
        found.append(Line(0, x, y, error, mark=POINT, parameters=parameters, look=encoding.look(parameters)))
    return found


def _zeros(cases: Sequence[Drawn], places: Sequence[float]) -> list[Line]:
    """The zeros of dU with their errors."""
    found = []
    for place, case in zip(places, cases, strict=True):
        size = case.units.factor(LENGTH)
        for d, kind, error in zip_longest(*map(case.values, (ZEROS, STABLE, ZEROS_ERROR))):
            bar = None if error is None else size * error
            found.append(point(0, place, size * d, ZERO_MARKS[kind], bar, parameters=case.parameters))
    return found
