"""The picture of a master curve."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from pairsim.results.columns import relative_velocities
from pairsim.results.output import read_series
from pairsim.results.run_plots import axis_label, case_title, finish_axis, read_case
from pairsim.runtime.errors import InputError
from pairsim.solvers.curve_interpolant import curve_interpolant


def plot_curve(directory: Path, out: Path) -> list[Path]:
    """Draw curve.png: dU over d with its error as a band and the zeros, and D of the particles.

    Args:
        directory: Folder of a curve, finished or not.
        out: Folder of the picture, made if needed.

    Returns:
        The file written; none for a single particle or places that differ in their gaps.

    Raises:
        InputError: The folder is not that of a curve, or holds no point yet.
    """
    table = read_series(directory / "curve.csv")
    gaps = [name for name in table if name == "d" or name.startswith("d_")]
    if not len(next(iter(table.values()))):
        raise InputError(str(directory / "curve.csv"), "", None, "has no points yet")
    if not gaps or any(not np.array_equal(table[gaps[0]], table[gap]) for gap in gaps):
        return []
    out.mkdir(parents=True, exist_ok=True)
    d = table[gaps[0]]
    fine = np.geomspace(d[0], d[-1], 400)
    figure = Figure(figsize=(10.5, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    relative = relative_velocities(table)
    shown = []
    for i, name in enumerate(relative):
        gap, colour = name.removeprefix("dU"), f"C{i}"
        values = table[name]
        if len(d) > 1:
            curve = curve_interpolant(d, values, table["slope" + gap])(np.log(fine))
            left.plot(fine, curve, color=colour, linewidth=1.5, label=f"gap {i + 1}")
            if "dU_error" + gap in table:  # not in folders of earlier versions
                error = np.interp(np.log(fine), np.log(d), table["dU_error" + gap])
                left.fill_between(fine, curve - error, curve + error, color=colour, alpha=0.25, linewidth=0)
        left.plot(d, values, ".", color=colour, markersize=5)
        shown.append(values)
    for zero, stable in _zeros(directory / "equilibria.csv"):
        left.plot([zero], [0], "o", color="k", fillstyle="full" if stable else "none", markersize=8, zorder=5)
    finish_axis(left, axis_label(gaps[:1]), axis_label(relative), shown, legend=len(relative) > 1)
    shapes = [name for name in table if name.startswith("D_")]
    for name in shapes:
        right.plot(d, table[name], ".-", label=f"${name}$")
    finish_axis(right, axis_label(gaps[:1]), axis_label(shapes), [table[name] for name in shapes], legend=True)
    if d[-1] > 4 * d[0]:
        for axis in (left, right):
            axis.set_xscale("log")
            axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            axis.xaxis.set_major_formatter("{x:g}")
            axis.xaxis.set_minor_formatter("")
    note = "band: error of dU by the mesh;  filled circle: stable zero, open circle: unstable"
    figure.suptitle(f"{case_title(read_case(directory / 'case.yaml'))}\n{note}", fontsize=10)
    path = out / "curve.png"
    figure.savefig(path, dpi=160)
    return [path]


def _zeros(path: Path) -> list[tuple[float, bool]]:
    if not path.is_file():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return [(float(row["d"]), row["stable"] == "true") for row in csv.DictReader(file)]
