"""Pictures of a sweep: all its lines in one, the results against the parameters, and how cases ended."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from pairsim.plots.encoding import MOST_PANELS, Encoding, hashable, is_number
from pairsim.plots.labels import axis_label, case_parts, equation, finish, parameter_label, read_case, spread
from pairsim.plots.lines import Line, lines_of, zero_notes
from pairsim.plots.overlay import draw_overlay
from pairsim.plots.style import COLOURS, Page, key, key_above, printing, small_print
from pairsim.runtime.errors import InputError
from pairsim.sweeps.ledger import read_sweep

QUANTITIES = ("dU", "dU_1", "U_1", "dp")
STILL = 1e-8  # a relative velocity below this is zero to rounding
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
    """A sweep's ledger and what the pictures need of it.

    Attributes:
        varying: Keys that vary.
        numeric: Those whose values are all numbers.
        quantity: Column that is drawn.
        group, panels: Keys that choose colours and panels, None where they were not chosen.
    """

    directory: Path
    command: str
    cases: list[dict[str, Any]]
    varying: list[str]
    numeric: list[str]
    quantity: str
    group: str | None
    panels: str | None

    @property
    def case(self) -> dict[str, Any]:
        """A case in full, one with a viscoelastic liquid if there is any: what does not vary is in it."""
        for entry in sorted(self.cases, key=lambda entry: -float(entry["parameters"].get("De") or 0)):
            if content := read_case(self.directory / entry["folder"] / "case.yaml"):
                return content
        return {}

    @property
    def parts(self) -> list[str]:
        """The parameters that all cases share."""
        return case_parts(self.case, self.varying)


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
        panels: Varying key whose values have a panel each in the picture of all lines.

    Returns:
        The files written: of runs `sweep_series` (every case against t and d), of curves `sweep_curves` (all of them);
        where a numeric parameter varies, `sweep_parameters` of runs (the last dU) or `sweep_zeros` of curves and
        critical distances (the zeros of dU); and `sweep_map` where two or more do.

    Raises:
        InputError: The folder is not that of a sweep, has nothing to draw, or `group` or `panels` does not vary.
    """
    sweep, target, page = _read(directory, group, panels), out or directory, page or Page()
    written: list[Path] = []
    if sweep.command in ("run", "curve"):
        written += _draw_lines(sweep, target, page)
    if sweep.command == "run" and sweep.numeric:
        written += _draw_parameters(sweep, target, page)
    elif sweep.numeric and any(map(_zeros, sweep.cases)):
        written += _draw_zeros(sweep, target, page)
    if len(sweep.numeric) > 1:
        written += _draw_map(sweep, target, page)
    if not written:
        raise InputError(str(directory), "", None, "has no zero of dU to draw over a number that varies")
    return written


def _read(directory: Path, group: str | None, panels: str | None) -> _Sweep:
    content = read_sweep(directory)
    cases = [case for case in content["cases"] if case["status"] in ("finished", "failed", "timeout")]
    if not any(case["status"] == "finished" for case in cases):
        raise InputError(str(directory), "", None, "has no finished case yet; pairsim status shows how it stands")
    varying: list[str] = content["varying"]
    Encoding.of([case["parameters"] for case in cases], varying, group, panels)  # refuses keys that do not vary
    numeric = [name for name in varying if all(is_number(case["parameters"].get(name)) for case in cases)]
    numeric = [name for name in numeric if len({case["parameters"][name] for case in cases}) > 1]
    return _Sweep(directory, content["command"], cases, varying, numeric, quantity_of(cases), group, panels)


def quantity_of(cases: list[dict[str, Any]]) -> str:
    """The column of results.csv that tells best what cases do."""
    return next(
        (name for name in QUANTITIES if any({name, f"{name}_peak"} & set(case["values"]) for case in cases)), "dU"
    )


def _draw_lines(sweep: _Sweep, out: Path, page: Page) -> list[Path]:
    """Every case as its own picture shows it; a cross ends the line of a case that failed."""
    lines: list[Line] = []
    curve = sweep.command == "curve"
    for case in sweep.cases:
        failed = case["status"] != "finished"
        try:
            lines += lines_of(sweep.directory / case["folder"], case["parameters"], curve=curve, failed=failed)
        except InputError:
            continue  # a case that failed before its first row has nothing to show
    if not lines:
        return []
    stem = "sweep_curves" if curve else "sweep_series"
    return draw_overlay(lines, sweep.varying, sweep.case, out, page, stem, sweep.group, sweep.panels)


def _over_parameters(
    sweep: _Sweep,
    page: Page,
    y: str,
    draw: Callable[[Axes, str, Encoding], None],
    more: list[Any],
    *,
    joined: bool,
) -> Any:
    """A panel for each numeric parameter; the other parameters choose colours and styles.

    Args:
        sweep: The sweep.
        page: What it is drawn for.
        y: Label of the ordinate.
        draw: Draws over a parameter.
        more: Further entries of the legend.
        joined: Whether points are joined by lines.
    """
    if len(sweep.numeric) == 1:
        page = page.alone()
    figure, axes = page.panels(len(sweep.numeric), height=66, extra=14)
    parameters = [case["parameters"] for case in sweep.cases]
    for axis, name in zip(axes, sweep.numeric, strict=True):
        others = [other for other in sweep.varying if other != name]
        encoding = Encoding.of(parameters, others, sweep.group if sweep.group in others else None)
        draw(axis, name, encoding)
        spread(axis, "x", [case[name] for case in parameters])
        finish(axis, parameter_label(name), y, [])
        encoding.bar(figure, [axis])
        key_above(figure, axis, encoding.handles(lines=joined, points=True), page)
    key(figure, more)
    small_print(figure, sweep.parts)
    return figure


@printing()
def _draw_parameters(sweep: _Sweep, out: Path, page: Page) -> list[Path]:
    """The last value of the quantity against each numeric parameter; lines join cases that differ in it alone."""
    finished = [case for case in sweep.cases if case["status"] == "finished" and sweep.quantity in case["values"]]

    def draw(axis: Axes, name: str, encoding: Encoding) -> None:
        lines: dict[Hashable, list[dict[str, Any]]] = defaultdict(list)
        for case in finished:
            rest = {k: hashable(v) for k, v in case["parameters"].items() if k != name}
            lines[tuple(rest.items())].append(case)
        for line in lines.values():
            line.sort(key=lambda case: case["parameters"][name])
            parameters = line[0]["parameters"]
            look: dict[str, Any] = {"color": encoding.colour_of(parameters), "linestyle": encoding.line_of(parameters)}
            y = [case["values"][sweep.quantity] for case in line]
            marker = encoding.marker_of(parameters)
            axis.plot([case["parameters"][name] for case in line], y, marker=marker, markersize=3, **look)

    figure = _over_parameters(sweep, page, axis_label([sweep.quantity], " at the end"), draw, [], joined=True)
    return page.save(figure, out, "sweep_parameters")


def _zeros(case: dict[str, Any]) -> list[tuple[float, bool]]:
    found = (case["values"].get(kind) or [] for kind in ("zeros", "stable"))
    zeros, stable = (json.loads(each) if isinstance(each, str) else each for each in found)  # text in early versions
    return list(zip(zeros, stable, strict=True))


@printing()
def _draw_zeros(sweep: _Sweep, out: Path, page: Page) -> list[Path]:
    """The zeros of dU against each numeric parameter, filled where they are stable."""
    zeros = {case["folder"]: _zeros(case) for case in sweep.cases}

    def draw(axis: Axes, name: str, encoding: Encoding) -> None:
        for case in sweep.cases:
            parameters = case["parameters"]
            colour, marker = encoding.colour_of(parameters), encoding.marker_of(parameters) if encoding.line else "o"
            for zero, stable in zeros[case["folder"]]:
                face = colour if stable else "white"
                axis.plot(parameters[name], zero, marker, color=colour, markerfacecolor=face, markersize=4.5)

    notes = zero_notes([zero for found in zeros.values() for zero in found])
    figure = _over_parameters(sweep, page, axis_label(["d_cr"]), draw, notes, joined=False)
    return page.save(figure, out, "sweep_zeros")


def outcome(case: dict[str, Any], quantity: str) -> str:
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
def _draw_map(sweep: _Sweep, out: Path, page: Page) -> list[Path]:
    """Outcomes over the first two numeric parameters, a panel for each value of the third."""
    x, y, *more = sweep.numeric
    third = more[0] if more else None
    values = sorted({case["parameters"][third] for case in sweep.cases}) if third else [None]
    if len(values) > MOST_PANELS:
        values = values[:: -(-len(values) // MOST_PANELS)]
    found = {case["folder"]: outcome(case, sweep.quantity) for case in sweep.cases}
    kinds = [kind for kind in OUTCOMES if kind in found.values()]
    kinds += sorted(set(found.values()) - set(OUTCOMES))
    looks = {kind: OUTCOMES.get(kind, ("black", FAILURES[i % len(FAILURES)])) for i, kind in enumerate(kinds)}
    figure, axes = (page if len(values) > 1 else page.alone()).panels(len(values), height=60, extra=14)
    for axis, value in zip(axes, values, strict=True):
        for case in sweep.cases:
            if third is None or case["parameters"][third] == value:
                colour, marker = looks[found[case["folder"]]]
                axis.plot(case["parameters"][x], case["parameters"][y], marker, color=colour, markersize=5)
        for name, parameter in (("x", x), ("y", y)):
            spread(axis, name, [case["parameters"][parameter] for case in sweep.cases])
        finish(axis, parameter_label(x), parameter_label(y), [])
        axis.margins(0.08)
        if third:
            axis.set_title(equation(third, value))
    words = {kind: kind.replace("dU", r"$\Delta U$") for kind in kinds}
    key(figure, [Line2D([], [], linestyle="", color=c, marker=m, label=words[k]) for k, (c, m) in looks.items()])
    unseen = [f"all values of {name}" for name in (*more[1:], *(k for k in sweep.varying if k not in sweep.numeric))]
    small_print(figure, [*sweep.parts, *unseen])
    return page.save(figure, out, "sweep_map")
