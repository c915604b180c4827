"""Pictures of a sweep: all its lines in one, the results against the parameters, and how cases ended."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.lines import Line2D

from pairsim.cases.merging import flat
from pairsim.cases.physical import BLOCK
from pairsim.plots.chart import POINT, ZEROS, Panel, Series, draw_chart, point
from pairsim.plots.encoding import Encoding
from pairsim.plots.labels import case_parts, hashable, measured, parameter_label, read_case
from pairsim.plots.lines import Line, lines_of
from pairsim.plots.overlay import draw_overlay
from pairsim.plots.style import COLOURS, Page, printing
from pairsim.plots.units import Units
from pairsim.results.columns import column
from pairsim.results.curve_table import Zero
from pairsim.runtime.errors import InputError
from pairsim.sweeps.folder import read_sweep

QUANTITIES = ("dU", "dU_1", "U_1", "dp")
STILL = 1e-8  # a relative velocity below this is zero to rounding
OF_MAP = 3  # values of a parameter from which a map says more than a table
OUTCOMES = {
    "separating": (COLOURS[0], "^"),
    "neither": ("0.55", "s"),
    "approaching": (COLOURS[4], "v"),
    "contact": (COLOURS[1], "o"),
    "a zero of dU": (COLOURS[2], "D"),
}
FAILURES = ("x", "+", "1", "2", "3", "4", "*")


@dataclass(frozen=True)
class _Sweep:
    """The cases of a sweep, and what the pictures need of it.

    Attributes:
        varying: Keys that vary, without those that follow from others.
        drawn: The units of each case, by its folder.
        numbers: Values of each case, by those keys that are numbers or quantities of one unit; and the units.
        quantity: Column that is drawn.
        group, panels: Keys that choose colours and panels, None where they were not chosen.
    """

    directory: Path
    command: str
    cases: Sequence[dict[str, Any]]
    varying: Sequence[str]
    drawn: Mapping[str, Units]
    numbers: Mapping[str, Sequence[float]]
    units: Mapping[str, str]
    quantity: str
    group: str | None
    panels: str | None

    def zeros(self, case: Mapping[str, Any]) -> tuple[Zero, ...]:
        """The zeros of dU of a case, as they are drawn."""
        return self.drawn[case["folder"]].zeros(_zeros(case))

    @property
    def units_of_all(self) -> Units:
        """Those of the first case: what the axes are labelled with."""
        return self.drawn[self.cases[0]["folder"]]

    @property
    def parts(self) -> list[str]:
        """The parameters that all cases share; what a quantity of an experiment changes is not among them."""
        ordered = sorted(self.cases, key=lambda entry: -float(entry["parameters"].get("De") or 0))
        chosen = [ordered[0], self.cases[0], self.cases[-1]]  # what does not vary is in the most elastic one
        paths = [self.directory / each["folder"] / "case.yaml" for each in chosen]
        full = [content for path in paths if (content := read_case(path))] or [{}]
        cases = list(map(flat, full)) if any(key.startswith(BLOCK) for key in self.varying) else [{}]
        changed = {name for name in cases[0] for case in cases if case.get(name) != cases[0][name]}
        return case_parts(full[0], {*self.varying, *changed})


def plot_sweep(
    directory: Path,
    out: Path | None = None,
    group: str | None = None,
    page: Page | None = None,
    panels: str | None = None,
) -> list[Path]:
    """Draw a sweep, finished or not.

    Args:
        directory: Folder of the sweep.
        out: Folder of the pictures, made if needed; the sweep's own by default.
        group: Varying key that chooses the colours; the first one by default.
        page: What they are drawn for.
        panels: Varying key whose values have a panel each.

    Returns:
        The files written: of runs `sweep_series` (every case against t and d), of curves `sweep_curves` (all of them);
        where a parameter is a number, `sweep_parameters` of runs (the last dU) or `sweep_zeros` of curves and critical
        distances (the zeros of dU) over the one with the most values; and `sweep_map` where two have at least
        three and cases end in different ways.

    Raises:
        InputError: The folder is not that of a sweep, has nothing to draw, or `group` or `panels` does not vary.
    """
    page, target = page or Page(), out or directory
    sweep = _read(directory, group, panels, page.physical)
    written: list[Path] = []
    if sweep.command in ("run", "curve"):
        written += _draw_lines(sweep, target, page)
    if sweep.numbers and (sweep.command == "run" or any(map(_zeros, sweep.cases))):
        written += _draw_parameters(sweep, target, page)
    wide = [name for name, values in sweep.numbers.items() if len(set(values)) >= OF_MAP]
    if len(wide) > 1 and len({outcome(case, sweep.quantity) for case in sweep.cases}) > 1:
        written += _draw_map(sweep, wide, target, page)
    if not written:
        raise InputError(str(directory), "", None, "has no zero of dU to draw over a number that varies")
    return written


def _read(directory: Path, group: str | None, panels: str | None, physical: bool | None) -> _Sweep:
    content = read_sweep(directory)
    cases = [case for case in content["cases"] if case["status"] in ("finished", "failed")]
    if not any(case["status"] == "finished" for case in cases):
        raise InputError(str(directory), "", None, "has no finished case yet; pairsim status shows how it stands")
    varying = _independent(content["varying"], cases, {group, panels})
    drawn = {case["folder"]: Units.of(directory / case["folder"], physical) for case in cases}
    if any(units.scales is None for units in drawn.values()):
        drawn = dict.fromkeys(drawn, Units())
    Encoding.of([case["parameters"] for case in cases], varying, group, panels)  # refuses keys that do not vary
    known = {name: measured([case["parameters"].get(name) for case in cases]) for name in varying}
    found = {name: pair for name, pair in known.items() if pair is not None and len(set(pair[0])) > 1}
    numbers = {name: values for name, (values, _) in found.items()}
    units = {name: unit for name, (_, unit) in found.items()}
    kind, quantity = content["command"], quantity_of(cases)
    return _Sweep(directory, kind, cases, varying, drawn, numbers, units, quantity, group, panels)


def _independent(
    varying: Sequence[str], cases: Sequence[Mapping[str, Any]], chosen: Collection[str | None]
) -> list[str]:
    """The keys that vary, without numbers that follow from varying quantities of an experiment, unless chosen."""
    quantities = [key for key in varying if key.startswith(BLOCK)]

    def kinds(*keys: str) -> int:
        return len({tuple(hashable(case["parameters"].get(key)) for key in keys) for case in cases})

    follows = {key for key in varying if key not in quantities and kinds(*quantities, key) == kinds(*quantities)}
    return [key for key in varying if key in chosen or not (quantities and key in follows)]


def quantity_of(cases: Sequence[Mapping[str, Any]]) -> str:
    """The column of results.csv that tells best what cases do."""
    return next(
        (name for name in QUANTITIES if any({name, f"{name}_peak"} & set(case["values"]) for case in cases)), "dU"
    )


def _draw_lines(sweep: _Sweep, out: Path, page: Page) -> list[Path]:
    """Every case as its own picture shows it; a cross ends the line of a case that failed."""
    lines: list[Line] = []
    curve = sweep.command == "curve"
    for case in sweep.cases:
        failed, units = case["status"] != "finished", sweep.drawn[case["folder"]]
        try:
            lines += lines_of(sweep.directory / case["folder"], case["parameters"], units, curve=curve, failed=failed)
        except InputError:
            continue  # a case that failed before its first row has nothing to show
    if not lines:
        return []
    stem = "sweep_curves" if curve else "sweep_series"
    return draw_overlay(lines, sweep.varying, sweep.parts, out, page, stem, sweep.group, sweep.panels)


@printing()
def _draw_parameters(sweep: _Sweep, out: Path, page: Page) -> list[Path]:
    """The last value of the quantity, or the zeros of dU, over the number with the most values.

    The others choose colours, styles and panels.
    """
    free = [name for name in sweep.numbers if name not in (sweep.group, sweep.panels)] or list(sweep.numbers)
    name = max(free, key=lambda each: len(set(sweep.numbers[each])))
    others = [other for other in sweep.varying if other != name]
    group, panels = (wanted if wanted in others else None for wanted in (sweep.group, sweep.panels))
    encoding = Encoding.of([case["parameters"] for case in sweep.cases], others, group, panels)
    run = sweep.command == "run"
    named = sweep.units_of_all.axis_label
    label = named([sweep.quantity], " at the end") if run else named(["d_cr"])
    places = [Panel(parameter_label(name, sweep.units[name]), label, each, "x", like=0) for each in encoding.titles]
    table = (_ends if run else _zero_points)(sweep, name, encoding)
    figure, _ = draw_chart(page, places, table, sweep.parts, encoding)
    return page.save(figure, out, "sweep_parameters" if run else "sweep_zeros")


def _ends(sweep: _Sweep, name: str, encoding: Encoding) -> list[Series]:
    """The last values; lines join cases that differ in this parameter alone."""
    lines: dict[tuple[Any, ...], list[tuple[float, float]]] = defaultdict(list)
    parameters: dict[tuple[Any, ...], Mapping[str, Any]] = {}
    for x, case in zip(sweep.numbers[name], sweep.cases, strict=True):
        if case["status"] == "finished" and sweep.quantity in case["values"]:
            rest = tuple((k, hashable(v)) for k, v in case["parameters"].items() if k != name)
            factor = sweep.drawn[case["folder"]].factor(column(sweep.quantity).unit)
            lines[rest].append((x, factor * case["values"][sweep.quantity]))
            parameters[rest] = case["parameters"]
    found = []
    for rest, points in lines.items():
        x, y = np.array(sorted(points)).T
        look = {**encoding.look(parameters[rest]), "markersize": 3}
        found.append(Series(encoding.panel_of(parameters[rest]), x, y, look, marked=range(len(x))))
    return found


def _zeros(case: Mapping[str, Any]) -> list[Zero]:
    zeros, stable = (case["values"].get(kind) or [] for kind in ("zeros", "stable"))
    errors = case["values"].get("zeros_error") or [None] * len(zeros)
    return [Zero(*each) for each in zip(zeros, stable, errors, strict=True)]


def _zero_points(sweep: _Sweep, name: str, encoding: Encoding) -> list[Series]:
    """The zeros of dU with their errors."""
    found = []
    for x, case in zip(sweep.numbers[name], sweep.cases, strict=True):
        look = encoding.look(case["parameters"])
        look = {"color": look["color"], "marker": look["marker"].replace(".", "o")}
        panel = encoding.panel_of(case["parameters"])
        found += [point(panel, x, zero.d, ZEROS[zero.stable], look, zero.error) for zero in sweep.zeros(case)]
    return found


def outcome(case: Mapping[str, Any], quantity: str) -> str:
    """How a case ended, in a word: a motion, contact, or the reason of its failure."""
    if case["status"] != "finished":
        return f"{case['status']}: {case['reason']}"
    if case["reason"] == "contact":
        return "contact"
    values = case["values"]
    if zeros := _zeros(case):
        return "a zero of dU" if len(zeros) == 1 else f"{len(zeros)} zeros of dU"
    value = values.get(quantity, values.get(f"{quantity}_peak"))
    if value is None or abs(value) < STILL:
        return "neither"
    return "separating" if value > 0 else "approaching"


@printing()
def _draw_map(sweep: _Sweep, numbers: Sequence[str], out: Path, page: Page) -> list[Path]:
    """Outcomes over the first two of some parameters, a panel for each value of the third."""
    x, y, *more = sorted(numbers, key=lambda name: -len(set(sweep.numbers[name])))
    found = [outcome(case, sweep.quantity) for case in sweep.cases]
    kinds = [*(kind for kind in OUTCOMES if kind in found), *sorted(set(found) - set(OUTCOMES))]
    pairs = {kind: OUTCOMES.get(kind, ("black", FAILURES[i % len(FAILURES)])) for i, kind in enumerate(kinds)}
    looks: dict[str, dict[str, Any]] = {
        kind: {"color": colour, "marker": marker, "markersize": 5} for kind, (colour, marker) in pairs.items()
    }
    encoding = Encoding.of([case["parameters"] for case in sweep.cases], more[:1], panels=(*more, None)[0])
    points = zip(sweep.numbers[x], sweep.numbers[y], sweep.cases, found, strict=True)
    table = [point(encoding.panel_of(c["parameters"]), a, b, POINT, looks[kind]) for a, b, c, kind in points]
    labels = {name: parameter_label(name, sweep.units[name]) for name in (x, y)}
    axes = Panel(labels[x], labels[y], wide="xy", like=0, margins=(0.08, 0.08))
    words = {kind: kind.replace("dU", r"$\Delta U$") for kind in kinds}
    handles = [Line2D([], [], label=words[kind], linestyle="", **look) for kind, look in looks.items()]
    unseen = [f"all values of {name}" for name in sweep.varying if name not in (x, y, *more[:1])]
    panels = [replace(axes, title=title) for title in encoding.titles]
    figure, _ = draw_chart(page, panels, table, [*sweep.parts, *unseen], handles=handles)
    return page.save(figure, out, "sweep_map")
