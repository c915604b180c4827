"""The picture of critical distances."""

from __future__ import annotations

import csv
import itertools
from pathlib import Path

from matplotlib.figure import Figure

from pairsim.results.columns import column
from pairsim.results.run_plots import axis_label, case_title, finish_axis, read_case
from pairsim.runtime.errors import InputError

# The parameter that a picture is drawn over, and the one that tells its lines apart.
OTHER = {"Ca_e": "De", "De": "Ca_e"}


def plot_critical(directory: Path, out: Path) -> list[Path]:
    """Draw critical.png: d_cr over the parameter that was followed, one line a branch.

    Args:
        directory: Folder of critical distances.
        out: Folder of the picture, made if needed.

    Returns:
        The file written; none where no parameter was followed.

    Raises:
        InputError: The folder is not that of critical distances.
    """
    case = read_case(directory / "case.yaml")
    path = directory / "critical.csv"
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
    except OSError as error:
        raise InputError(str(path), "", None, f"cannot be read ({error.strerror})") from None
    if not case.get("along"):
        return []
    name = next(iter(case["along"]))
    figure = Figure(figsize=(6.4, 4.4), layout="constrained")
    axis = figure.subplots()
    others = sorted({float(row[OTHER[name]]) for row in rows})
    labelled: set[str] = set()
    for branch in dict.fromkeys(row["branch"] for row in rows):
        points = [row for row in rows if row["branch"] == branch]
        other = float(points[0][OTHER[name]])
        colour = f"C{others.index(other)}"
        for first, second in itertools.pairwise(points):
            # What vanishes is neither: the other end tells.
            end = second if first["kind"] == "vanishes" else first
            style = "-" if end["stable"] == "true" else "--"
            axis.plot(
                [float(first[name]), float(second[name])],
                [float(first["d_cr"]), float(second["d_cr"])],
                style,
                color=colour,
                linewidth=1.4,
            )
        label = f"${column(OTHER[name]).symbol} = {other:g}$"
        for kind, marker in (("wanted", "o"), ("vanishes", "X"), ("edge", "s")):
            x, y = ([float(row[key]) for row in points if row["kind"] == kind] for key in (name, "d_cr"))
            shown = label if kind == "wanted" and label not in labelled else None
            axis.plot(x, y, marker, color=colour, markersize=5 if kind == "wanted" else 8, label=shown)
        labelled.add(label)
    finish_axis(axis, axis_label([name]), axis_label(["d_cr"]), [], legend=bool(rows))
    note = "dashed: unstable, solid: stable;  cross: a stable and an unstable one meet;  square: leaves the range"
    replaced = {*case["along"], *(case.get("lines") or {})}
    title = case_title({key: value for key, value in case.items() if key not in replaced})
    figure.suptitle(f"{title}\n{note}", fontsize=9)
    out.mkdir(parents=True, exist_ok=True)
    figure.savefig(out / "critical.png", dpi=160)
    return [out / "critical.png"]
