"""Plot a study: error against wall time, with the Pareto front."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pairsim.runtime.errors import InputError
from pairsim.sweeps.study_file import TABLE

MARKERS = "osD^vP*X<>"


def plot_study(directory: Path, out: Path | None = None) -> list[Path]:
    """Draw study.png from study.csv.

    Args:
        directory: Folder of a study, finished or not.
        out: Folder for the picture, created if needed; default: that of the study.

    Returns:
        Path of the picture; empty while no error is known.

    Raises:
        InputError: The folder is not that of a study.
    """
    try:
        with (directory / TABLE).open(encoding="utf-8", newline="") as file:
            table = list(csv.DictReader(file))
    except OSError as error:
        raise InputError(str(directory), "", None, f"must be the folder of a study ({error})") from error
    settings = list(table[0])[: list(table[0]).index("status")]
    points = [row for row in table if float(row.get("error") or 0) > 0 and row.get("wall_time")]
    if not points:
        return []
    figure = Figure(figsize=(8, 5.2), layout="constrained")
    axes = figure.subplots()
    time_settings = [key for key in settings if key == "command" or key.startswith("time.")]
    series: dict[str, list[dict[str, Any]]] = {}
    for row in points:
        series.setdefault(_label(row, time_settings), []).append(row)
    others = [key for key in settings if key not in time_settings]
    for i, (label, rows) in enumerate(series.items()):
        x, y = [float(row["wall_time"]) for row in rows], [float(row["error"]) for row in rows]
        axes.plot(x, y, MARKERS[i % len(MARKERS)], color=f"C{i % 10}", label=label or None, markersize=7)
        for row, place in zip(rows, zip(x, y, strict=True), strict=True):
            axes.annotate(_label(row, others), place, (6, 4), textcoords="offset points", fontsize=7, color="0.3")
    front = sorted((float(row["wall_time"]), float(row["error"])) for row in points if row["pareto"] == "true")
    if front:  # empty if the only row in front has no error, which a logarithmic axis cannot show
        axes.step(
            *zip(*front, strict=True), where="post", color="0.4", linewidth=1, zorder=0, label="cheapest for its error"
        )
    axes.set(xscale="log", yscale="log", xlabel="wall time [s]", ylabel="error")
    axes.margins(0.1)
    axes.grid(which="both", color="0.92")
    axes.legend(frameon=False, fontsize=8)
    target = out or directory
    target.mkdir(parents=True, exist_ok=True)
    path = target / "study.png"
    figure.savefig(path, dpi=130)
    return [path]


def _label(row: dict[str, Any], keys: list[str]) -> str:
    """Label of some settings, such as Np 20, tol 0.0003."""
    return ", ".join(f"{key.rpartition('.')[2]} {row[key]}" for key in keys if row[key])
