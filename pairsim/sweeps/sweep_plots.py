"""Pictures of a sweep: all its lines in one, and the results against the parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.cases.physical import BLOCK
from pairsim.plots.chart import POINT, ZEROS, Panel, Series, draw_chart, point
from pairsim.plots.encoding import Encoding
from pairsim.plots.labels import common_parts, hashable, measured, parameter_label, read_case, varying_keys
from pairsim.plots.lines import MOTION, lines_of
from pairsim.plots.runs_and_curves import draw_overlay
from pairsim.plots.style import Page, printing
from pairsim.plots.units import Units
from pairsim.results.columns import column, error_of
from pairsim.results.units import LENGTH
from pairsim.runtime.errors import InputError
from pairsim.sweeps.folder import read_sweep


@dataclass(frozen=True)
class _Sweep:
    """The cases of a sweep, and what its pictures need of it.

    Attributes:
        directory: Its folder.
        command: Its command.
        cases: Those that have ended, as `read_sweep` returns them, with their `units`.
        varying: Keys that vary, without those that follow from others.
        numbers: Those of them that are numbers or quantities: the values of all cases, and their unit.
        parts: The parameters that all cases share.
        group: The key that chooses colours, None where it was not chosen.
    """

    directory: Path
    command: str
    cases: Sequence[dict[str, Any]]
    varying: Sequence[str]
    numbers: Mapping[str, tuple[Sequence[float], str]]
    parts: Sequence[str]
    group: str | None


def plot_sweep(
    directory: Path, out: Path | None = None, group: str | None = None, page: Page | None = None
) -> list[Path]:
    """Draw a sweep, finished or not.

    Args:
        directory: Folder of the sweep.
        out: Folder of the pictures, made if needed; the sweep's own by default.
        group: Varying key that chooses the colours; the first one by default.
        page: What they are drawn for.

    Returns:
        The files written: of runs `sweep_series` (every case against t and d), of curves `sweep_curves` (all of them);
        where a parameter is a number, `sweep_parameters` of runs (the last dU) or `sweep_zeros` of curves and critical
        distances (the zeros of dU) over the one with the most values.

    Raises:
        InputError: The folder is not that of a sweep, has nothing to draw, or `group` does not vary.
    """
    page, target = page or Page(), out or directory
    sweep = _read(directory, group, page.physical)
    written: list[Path] = []
    if sweep.command in ("run", "curve"):
        written += _draw_lines(sweep, target, page)
    if sweep.numbers and (sweep.command == "run" or any(case["values"].get("zeros") for case in sweep.cases)):
        written += _draw_parameters(sweep, target, page)
    if not written:
        raise InputError(str(directory), "", None, "has no zero of dU to draw over a number that varies")
    return written


def _read(directory: Path, group: str | None, physical: bool | None) -> _Sweep:
    content = read_sweep(directory)
    cases = [case for case in content["cases"] if case["status"] in ("finished", "failed")]
    if not any(case["status"] == "finished" for case in cases):
        raise InputError(str(directory), "", None, "has no finished case yet; pairsim status shows how it stands")
    units = Units.of_all([directory / case["folder"] for case in cases], physical)
    cases = [case | {"units": own} for case, own in zip(cases, units, strict=True)]
    parameters, varying = [case["parameters"] for case in cases], content["varying"]
    if quantities := [key for key in varying if key.startswith(BLOCK)]:
        # Numbers that follow from quantities of an experiment need no lines of their own, unless they are chosen.
        telling = varying_keys(parameters, [*quantities, *varying])
        varying = [key for key in varying if key in telling or key == group]
    Encoding.of(parameters, varying, group)  # refuses keys that do not vary
    known = {name: measured([case.get(name) for case in parameters]) for name in varying}
    numbers = {name: pair for name, pair in known.items() if pair is not None and len(set(pair[0])) > 1}
    chosen = max(cases, key=lambda case: float(case["parameters"].get("De") or 0)), cases[0], cases[-1]
    contents = [read_case(directory / case["folder"] / "case.yaml") for case in chosen]
    parts = common_parts(contents, varying, units[0].physical, content["varying"])
    return _Sweep(directory, content["command"], cases, varying, numbers, parts, group)


def quantity_of(cases: Sequence[Mapping[str, Any]]) -> str:
    """The column of results.csv that tells best what cases do."""
    names = [name + ending for name in MOTION for ending in ("", "_1")]
    known = {key for case in cases for key in case["values"]}
    return next((name for name in names if name in known), "dU")


def _draw_lines(sweep: _Sweep, out: Path, page: Page) -> list[Path]:
    """Every case as its own picture shows it; a cross ends the line of a case that failed."""
    lines: list[Series] = []
    curve = sweep.command == "curve"
    for case in sweep.cases:
        folder, failed = sweep.directory / case["folder"], case["status"] != "finished"
        try:
            lines += lines_of(folder, case["units"], case["parameters"], curve=curve, failed=failed)
        except InputError:
            continue  # a case that failed before its first row has nothing to show
    if not lines:
        return []
    stem, units = "sweep_curves" if curve else "sweep_series", sweep.cases[0]["units"]
    return draw_overlay(lines, sweep.varying, sweep.parts, units, out, page, stem, sweep.group)


@printing()
def _draw_parameters(sweep: _Sweep, out: Path, page: Page) -> list[Path]:
    """The last value of the quantity, or the zeros of dU, over the number with the most values.

    The others choose colours, styles and panels.
    """
    free = [name for name in sweep.numbers if name != sweep.group] or list(sweep.numbers)
    name = max(free, key=lambda each: len(set(sweep.numbers[each][0])))
    others = [other for other in sweep.varying if other != name]
    group = sweep.group if sweep.group in others else None
    encoding = Encoding.of([case["parameters"] for case in sweep.cases], others, group)
    run, named = sweep.command == "run", sweep.cases[0]["units"].axis_label
    quantity = quantity_of(sweep.cases)
    words = named([quantity], " at the end") if run else named(["d_cr"])
    panel = Panel(parameter_label(name, sweep.numbers[name][1]), words, "x")
    series = _ends(sweep, name, quantity) if run else _zeros(sweep, name)
    figure, _ = draw_chart(page, {0: panel}, series, sweep.parts, encoding)
    return page.save(figure, out, "sweep_parameters" if run else "sweep_zeros")


def _ends(sweep: _Sweep, name: str, quantity: str) -> list[Series]:
    """The last values with their errors; lines join cases that differ in this parameter alone."""
    found = []
    lines: dict[Any, list[tuple[float, float]]] = {}
    parameters: dict[Any, Mapping[str, Any]] = {}
    for place, case in zip(sweep.numbers[name][0], sweep.cases, strict=True):
        if case["status"] == "finished" and quantity in case["values"]:
            rest = tuple((key, hashable(case["parameters"].get(key))) for key in sweep.varying if key != name)
            size = case["units"].factor(column(quantity).unit)
            value = size * case["values"][quantity]
            error = size * case["values"].get(error_of(quantity), np.nan)
            found.append(point(0, place, value, POINT, error, parameters=case["parameters"], look={"marker": ""}))
            lines.setdefault(rest, []).append((place, value))
            parameters[rest] = case["parameters"]
    for rest, points in lines.items():
        x, y = np.array(sorted(points)).T
        found.append(Series(0, x, y, parameters=parameters[rest], marked=range(len(x))))
    return found


def _zeros(sweep: _Sweep, name: str) -> list[Series]:
    """The zeros of dU with their errors."""
    found = []
    for place, case in zip(sweep.numbers[name][0], sweep.cases, strict=True):
        zeros, stable = (case["values"].get(kind) or [] for kind in ("zeros", "stable"))
        errors, size = case["values"].get("zeros_error") or [None] * len(zeros), case["units"].factor(LENGTH)
        for d, kind, error in zip(zeros, stable, errors, strict=True):
            bar = None if error is None else size * error
            found.append(point(0, place, size * d, ZEROS[kind], bar, parameters=case["parameters"]))
    return found
