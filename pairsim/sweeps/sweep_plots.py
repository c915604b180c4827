"""`pairsim plot` of a sweep: all its curves in one picture, the results against the parameters, and how cases ended."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Hashable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from pairsim.results.columns import column
from pairsim.results.output import read_series
from pairsim.runtime.errors import InputError
from pairsim.sweeps.ledger import read_sweep

SYMBOLS = {"beta": r"$\beta$", "De": r"$\mathrm{De}$", "Ca_e": r"$\mathrm{Ca}_e$", "d0": "$d_0$", "mesh.Np": "$N_p$"}
QUANTITIES = ("dU", "dU_1", "U_1", "dp")
STILL = 1e-8  # a relative velocity below this is zero to rounding
MOST_LABELS = 8  # more values of a parameter get a colour bar in place of a legend
MOST_PANELS = 6
WIDE = 8.0  # ratio of a parameter's values from which its axis is logarithmic
MAP = ListedColormap(mpl.colormaps["viridis"](np.linspace(0, 0.92, 256)))  # without its yellow end, faint on white
OUTCOMES = {
    "separating": ("tab:blue", "^"),
    "neither": ("0.55", "s"),
    "approaching": ("tab:orange", "v"),
    "contact": ("tab:red", "o"),
}
FAILURES = ("x", "+", "1", "2", "3", "4", "*")


@dataclass(frozen=True)
class _Sweep:
    """A sweep's ledger and what the pictures need of it.

    Attributes:
        numeric: Varying keys whose values are all numbers.
        quantity: Column that is drawn.
        group: Key that chooses colours, "" if nothing varies.
    """

    directory: Path
    name: str
    command: str
    cases: list[dict[str, Any]]
    numeric: list[str]
    quantity: str
    group: str

    def colour(self, case: dict[str, Any]) -> Any:
        """Colour of a case by the group's key."""
        scale, places = self._scale()
        value = case["parameters"].get(self.group)
        return scale.to_rgba(value if self.group in self.numeric else places[_hashable(value)])

    def _scale(self) -> tuple[Any, dict[Hashable, int]]:
        values = [case["parameters"].get(self.group) for case in self.cases]
        places = {value: i for i, value in enumerate(dict.fromkeys(map(_hashable, values)))}
        if self.group in self.numeric:
            low, high = min(values), max(values)
            norm = LogNorm(low, high) if low > 0 and high / low >= WIDE else Normalize(low, high)
        else:
            norm = Normalize(0, max(len(places) - 1, 1))
        return ScalarMappable(norm, MAP), places

    def key(self, figure: Figure, axes: list[Axes]) -> None:
        """Legend or colour bar of the group, if there is one."""
        if not self.group:
            return
        scale, places = self._scale()
        values = sorted(places) if self.group in self.numeric else list(places)  # type: ignore[type-var]
        if len(values) > MOST_LABELS and self.group in self.numeric:
            figure.colorbar(scale, ax=axes, label=_symbol(self.group))
            return
        for value in values[: 3 * MOST_LABELS]:
            colour = scale.to_rgba(value if self.group in self.numeric else places[value])
            axes[-1].plot([], [], color=colour, label=_shown(value))
        axes[-1].legend(title=_symbol(self.group), frameon=False, fontsize="small")


def plot_sweep(directory: Path, out: Path | None = None, group: str | None = None) -> list[Path]:
    """Draw a sweep, finished or not.

    Args:
        directory: Folder of the sweep.
        out: Folder of the pictures, made if needed; the sweep's own by default.
        group: Varying key that chooses the colours; the first one by default.

    Returns:
        The files written: of runs sweep_series.png (every case against t and d), of curves sweep_curves.png (all of
        them); where a numeric parameter varies, sweep_parameters.png of runs (the last dU) or sweep_zeros.png of curves
        and critical distances (the zeros of dU); and sweep_map.png where two or more do.

    Raises:
        InputError: The folder is not that of a sweep, has nothing to draw, or `group` does not vary.
    """
    sweep = _read(directory, group)
    target = out or directory
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(str(target), "-o", None, f"cannot be used as a folder ({error.strerror})") from error
    written = []
    gap = {"dU": "d", "dU_1": "d_1"}.get(sweep.quantity)
    if sweep.command == "curve":
        written.append(_draw_lines(sweep, "curve.csv", (gap,) if gap else (), target / "sweep_curves.png"))
    if sweep.command == "run":
        written.append(_draw_lines(sweep, "series.csv", ("t", gap) if gap else ("t",), target / "sweep_series.png"))
        if sweep.numeric:
            written.append(_draw_parameters(sweep, target / "sweep_parameters.png"))
    elif sweep.numeric and any(json.loads(case["values"].get("zeros") or "[]") for case in sweep.cases):
        written.append(_draw_zeros(sweep, target / "sweep_zeros.png"))
    if len(sweep.numeric) > 1:
        written.append(_draw_map(sweep, target / "sweep_map.png"))
    if not written:
        raise InputError(str(directory), "", None, "has no zero of dU to draw over a number that varies")
    return written


def _read(directory: Path, group: str | None) -> _Sweep:
    content = read_sweep(directory)
    cases = [case for case in content["cases"] if case["status"] in ("finished", "failed", "timeout")]
    if not any(case["status"] == "finished" for case in cases):
        raise InputError(str(directory), "", None, "has no finished case yet; pairsim status shows how it stands")
    varying: list[str] = content["varying"]
    if group is not None and group not in varying:
        allowed = f"must be a parameter that varies: {', '.join(varying) or 'none does'}"
        raise InputError("--group", "", group, allowed)

    def is_number(value: Any) -> bool:
        return isinstance(value, int | float) and not isinstance(value, bool)

    numeric = [key for key in varying if all(is_number(case["parameters"].get(key)) for case in cases)]
    numeric = [key for key in numeric if len({case["parameters"][key] for case in cases}) > 1]
    quantity = next(
        (name for name in QUANTITIES if any({name, f"{name}_peak"} & set(case["values"]) for case in cases)), "dU"
    )
    colours = group or (varying[0] if varying else "")
    return _Sweep(directory, content["name"], content["command"], cases, numeric, quantity, colours)


def _hashable(value: Any) -> Hashable:
    return tuple(value) if isinstance(value, list) else str(value) if isinstance(value, dict) else value


def _shown(value: Any) -> str:
    if isinstance(value, tuple):
        return ", ".join(map(_shown, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _symbol(key: str) -> str:
    return SYMBOLS.get(key, key.replace("_", r"\_") if "$" in key else key)


def _label(name: str) -> str:
    entry = column(name)
    return f"${entry.symbol}$" + (f"   [${entry.unit}$]" if entry.unit else "")


def _polish(axis: Axes) -> None:
    low, high = axis.get_ylim()
    if low < 0 < high:
        axis.axhline(0, color="0.6", linewidth=0.8, zorder=0)
    if axis.get_yscale() == "linear":
        axis.ticklabel_format(axis="y", style="sci", scilimits=(-2, 4))
    axis.grid(color="0.92")
    axis.set_axisbelow(True)


def _spread(axis: Axes, name: str, values: list[float]) -> None:
    """A logarithmic axis with plain numbers for values that span a wide range."""
    low, high = min(values), max(values)
    if low > 0 and high / low >= WIDE:
        direction: Axis = axis.xaxis if name == "x" else axis.yaxis
        (axis.set_xscale if name == "x" else axis.set_yscale)("log")
        direction.set_major_locator(LogLocator(subs=(1, 2, 5)))
        direction.set_major_formatter(StrMethodFormatter("{x:g}"))
        direction.set_minor_formatter(NullFormatter())


def _draw_lines(sweep: _Sweep, table: str, against: tuple[str, ...], path: Path) -> Path:
    """One line a case; a cross ends the line of a case that failed."""
    figure = Figure(figsize=(5.4 * len(against) + 0.6, 4.3), layout="constrained")
    axes = list(figure.subplots(1, len(against), squeeze=False)[0])
    drawn = 0
    for case in sweep.cases:
        try:
            rows = read_series(sweep.directory / case["folder"] / table)
        except InputError:
            continue  # a case that failed before its first row has nothing to show
        if sweep.quantity not in rows or not len(rows[sweep.quantity]):
            continue
        drawn += 1
        for axis, x in zip(axes, against, strict=True):
            colour = sweep.colour(case) if sweep.group else "tab:blue"
            axis.plot(rows[x], rows[sweep.quantity], color=colour, linewidth=1.2)
            if case["status"] != "finished":
                axis.plot(rows[x][-1], rows[sweep.quantity][-1], "x", color=colour, markersize=6)
    for axis, x in zip(axes, against, strict=True):
        axis.set(xlabel=_label(x), ylabel=_label(sweep.quantity))
        _polish(axis)
    sweep.key(figure, axes)
    figure.suptitle(f"{sweep.name}: {drawn} cases")
    figure.savefig(path, dpi=160)
    return path


def _draw_parameters(sweep: _Sweep, path: Path) -> Path:
    """The last value of the quantity against each numeric parameter; lines join cases that differ in it alone."""
    finished = [case for case in sweep.cases if case["status"] == "finished" and sweep.quantity in case["values"]]
    count = len(sweep.numeric)
    figure = Figure(figsize=(4.9 * count + 0.6, 4.1), layout="constrained")
    axes = list(figure.subplots(1, count, squeeze=False)[0])
    for axis, key in zip(axes, sweep.numeric, strict=True):
        other = sweep.group if sweep.group != key else next((k for k in sweep.numeric if k != key), "")
        colours = replace(sweep, group=other)
        lines: dict[Hashable, list[dict[str, Any]]] = defaultdict(list)
        for case in finished:
            rest = {k: _hashable(v) for k, v in case["parameters"].items() if k != key}
            lines[tuple(rest.items())].append(case)
        for line in lines.values():
            line.sort(key=lambda case: case["parameters"][key])
            x = [case["parameters"][key] for case in line]
            y = [case["values"][sweep.quantity] for case in line]
            axis.plot(x, y, "o-", color=colours.colour(line[0]) if other else "tab:blue", linewidth=1.1, markersize=4)
        _spread(axis, "x", [case["parameters"][key] for case in sweep.cases])
        axis.set(xlabel=_symbol(key), ylabel=f"{_label(sweep.quantity)} at the end")
        _polish(axis)
        colours.key(figure, [axis])
    figure.suptitle(sweep.name)
    figure.savefig(path, dpi=160)
    return path


def _draw_zeros(sweep: _Sweep, path: Path) -> Path:
    """The zeros of dU against each numeric parameter, filled where they are stable."""
    figure = Figure(figsize=(4.9 * len(sweep.numeric) + 0.6, 4.1), layout="constrained")
    axes = list(figure.subplots(1, len(sweep.numeric), squeeze=False)[0])
    for axis, key in zip(axes, sweep.numeric, strict=True):
        other = sweep.group if sweep.group != key else next((k for k in sweep.numeric if k != key), "")
        colours = replace(sweep, group=other)
        for case in sweep.cases:
            colour = colours.colour(case) if other else "tab:blue"
            zeros, stable = (json.loads(case["values"].get(name) or "[]") for name in ("zeros", "stable"))
            for zero, filled in zip(zeros, stable, strict=True):
                face = colour if filled else "none"
                axis.plot(case["parameters"][key], zero, "o", color=colour, markerfacecolor=face, markersize=5)
        _spread(axis, "x", [case["parameters"][key] for case in sweep.cases])
        axis.set(xlabel=_symbol(key), ylabel=_label("d_cr"))
        _polish(axis)
        colours.key(figure, [axis])
    figure.suptitle(f"{sweep.name}: dU = 0 (filled: stable)")
    figure.savefig(path, dpi=160)
    return path


def outcome(case: dict[str, Any], quantity: str) -> str:
    """How a case ended, in a word: a motion, contact, or the reason of its failure."""
    if case["status"] != "finished":
        return f"{case['status']}: {case['reason']}"
    if case["reason"] == "contact":
        return "contact"
    values = case["values"]
    if zeros := json.loads(values.get("zeros") or "[]"):
        return "a zero of dU" if len(zeros) == 1 else f"{len(zeros)} zeros of dU"
    value = values.get(quantity, values.get(f"{quantity}_peak"))
    if value is None or abs(value) < STILL:
        return "neither"
    return "separating" if value > 0 else "approaching"


def _draw_map(sweep: _Sweep, path: Path) -> Path:
    """Outcomes over the first two numeric parameters, a panel for each value of the third."""
    x, y, *more = sweep.numeric
    third = more[0] if more else None
    values = sorted({case["parameters"][third] for case in sweep.cases}) if third else [None]
    if len(values) > MOST_PANELS:
        values = [values[i] for i in np.linspace(0, len(values) - 1, MOST_PANELS).round().astype(int)]
    found = {case["folder"]: outcome(case, sweep.quantity) for case in sweep.cases}
    kinds = [kind for kind in OUTCOMES if kind in found.values()]
    kinds += sorted(set(found.values()) - set(OUTCOMES))
    figure = Figure(figsize=(4.6 * len(values) + 1.8, 4.2), layout="constrained")
    axes = list(figure.subplots(1, len(values), squeeze=False, sharex=True, sharey=True)[0])
    for axis, value in zip(axes, values, strict=True):
        for i, kind in enumerate(kinds):
            colour, marker = OUTCOMES.get(kind, ("black", FAILURES[i % len(FAILURES)]))
            points = [
                (case["parameters"][x], case["parameters"][y])
                for case in sweep.cases
                if found[case["folder"]] == kind and (third is None or case["parameters"][third] == value)
            ]
            axis.scatter(*np.array(points, dtype=float).reshape(-1, 2).T, c=colour, marker=marker, s=55, label=kind)
        for name, key in (("x", x), ("y", y)):
            _spread(axis, name, [case["parameters"][key] for case in sweep.cases])
            axis.set(**{f"{name}label": _symbol(key)})
        if third:
            axis.set_title(f"{_symbol(third)} = {value:g}", size="medium")
        axis.grid(color="0.92")
        axis.set_axisbelow(True)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right center", frameon=False)
    unseen = more[1:]
    figure.suptitle(sweep.name + (f" (all values of {', '.join(unseen)})" if unseen else ""))
    figure.savefig(path, dpi=160)
    return path
