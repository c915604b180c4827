"""Pictures of a sweep: all its lines in one, and the results against the parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from itertools import zip_longest
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
from pairsim.quantities.kinds import LENGTH
from pairsim.results.columns import column, error_of
from pairsim.runtime.errors import InputError
from pairsim.sweeps.folder import read_sweep


def plot_sweep(
    directory: Path, out: Path | None = None, group: str | None = None, page: Page | None = None
) -> list[Path]:
    """Draw a sweep, finished or not; the varying key `group` chooses colours.

    Returns the files written: of runs `sweep_series` (every case against t and d), of curves `sweep_curves` (all of
    them); where a parameter is a number, `sweep_parameters` of runs (the last dU) or `sweep_zeros` of curves and
    critical distances (the zeros of dU) over the one with the most values.

    Raises:
        InputError: The folder is not that of a sweep, has nothing to draw, or `group` does not vary.
    """
    page, target, content = page or Page(), out or directory, read_sweep(directory)
    cases = [case for case in content["cases"] if case["status"] in ("finished", "failed")]
    if not any(case["status"] == "finished" for case in cases):
        raise InputError(str(directory), "", None, "has no finished case yet; pairsim status shows how it stands")
    units = Units.of_all([directory / case["folder"] for case in cases], page.physical)
    cases = [case | {"units": own} for case, own in zip(cases, units, strict=True)]
    parameters, varying, command = [case["parameters"] for case in cases], content["varying"], content["command"]
    if quantities := [key for key in varying if key.startswith(BLOCK)]:
        # Numbers that follow from quantities of an experiment need no lines of their own, unless they are chosen.
        telling = varying_keys(parameters, [*quantities, *varying])
        varying = [key for key in varying if key in telling or key == group]
    Encoding.of(parameters, varying, group)  # refuses keys that do not vary
    chosen = max(cases, key=lambda case: float(case["parameters"].get("De") or 0)), cases[0], cases[-1]
    contents = [read_case(directory / case["folder"] / "case.yaml") for case in chosen]
    parts = common_parts(contents, varying, units[0].scales is not None, content["varying"])
    written: list[Path] = []
    if command in ("run", "curve") and (lines := _lines(directory, cases, command == "curve")):
        stem = "sweep_curves" if command == "curve" else "sweep_series"
        written += draw_overlay(lines, varying, parts, units[0], target, page, stem, group)
    if command == "run" or any(case["values"].get("zeros") for case in cases):
        written += _draw_parameters(cases, command == "run", varying, parts, group, target, page)
    if not written:
        drawn = command in ("run", "curve", "critical")
        has = "no zero of dU to draw over a number that varies" if drawn else "its pictures in the folders of its cases"
        raise InputError(str(directory), "", None, f"is a sweep of `pairsim {command}`, which has {has}")
    return written


def _lines(directory: Path, cases: Sequence[Mapping[str, Any]], curve: bool) -> list[Series]:
    """Every case as its own picture shows it; a cross ends the line of a case that failed."""
    lines: list[Series] = []
    for case in cases:
        failed = case["status"] != "finished"
        with suppress(InputError):  # a case that failed before its first row has nothing to show
            lines += lines_of(directory / case["folder"], case["units"], case["parameters"], curve=curve, failed=failed)
    return lines


@printing()
def _draw_parameters(
    cases: Sequence[Mapping[str, Any]],
    run: bool,
    varying: Sequence[str],
    parts: Sequence[str],
    group: str | None,
    out: Path,
    page: Page,
) -> list[Path]:
    """The last value of the quantity, or the zeros of dU, over the number or quantity with the most values.

    The others choose colours, styles and panels. Nothing is drawn where no number varies.
    """
    known = {name: measured([case["parameters"].get(name) for case in cases]) for name in varying}
    numbers = {name: pair for name, pair in known.items() if pair is not None and len(set(pair[0])) > 1}
    if not numbers:
        return []
    free = [name for name in numbers if name != group] or list(numbers)
    name = max(free, key=lambda each: len(set(numbers[each][0])))
    others, (places, unit) = [other for other in varying if other != name], numbers[name]
    encoding = Encoding.of([case["parameters"] for case in cases], others, group if group in others else None)
    results = {key for case in cases for key in case["values"]}
    quantity = next((each + end for each in MOTION for end in ("", "_1") if each + end in results), "dU")
    named = cases[0]["units"].axis_label
    words = named([quantity], " at the end") if run else named(["d_cr"])
    series = _ends(cases, places, quantity, encoding) if run else _zeros(cases, places)
    figure, _ = draw_chart(page, {0: Panel(parameter_label(name, unit), words, "x")}, series, parts, encoding)
    return page.save(figure, out, "sweep_parameters" if run else "sweep_zeros")


def _ends(
    cases: Sequence[Mapping[str, Any]], places: Sequence[float], quantity: str, encoding: Encoding
) -> list[Series]:
    """The last values with their errors; lines join cases that have all other parameters in common."""
    lines: dict[Any, tuple[Mapping[str, Any], list[tuple[float, float, float]]]] = {}
    for place, case in zip(places, cases, strict=True):
        if case["status"] == "finished" and quantity in case["values"]:
            size, values = case["units"].factor(column(quantity).unit), case["values"]
            rest = tuple(hashable(case["parameters"].get(key)) for key in encoding.values)
            row = place, size * values[quantity], size * values.get(error_of(quantity), np.nan)
            lines.setdefault(rest, (case["parameters"], []))[1].append(row)
    found = []
    for parameters, rows in lines.values():
        x, y, error = np.array(sorted(rows)).T
        found.append(Series(0, x, y, error, mark=POINT, parameters=parameters, look=encoding.look(parameters)))
    return found


def _zeros(cases: Sequence[Mapping[str, Any]], places: Sequence[float]) -> list[Series]:
    """The zeros of dU with their errors."""
    found = []
    for place, case in zip(places, cases, strict=True):
        zeros, stable, errors = (case["values"].get(kind) or [] for kind in ("zeros", "stable", "zeros_error"))
        size = case["units"].factor(LENGTH)
        for d, kind, error in zip_longest(zeros, stable, errors):
            bar = None if error is None else size * error
            found.append(point(0, place, size * d, ZEROS[kind], bar, parameters=case["parameters"]))
    return found
