"""Tables and figure of docs/explanation/accuracy.md, from the results of `scripts/accuracy`."""

from __future__ import annotations

import csv
import datetime
import json
import math
import statistics
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import yaml
from accuracy_rows import Rows, base, graded_rows, has_equal_cells, key, number, percent, rows_of, short
from markdown_tables import put, table
from matplotlib import pyplot
from measuring import machine

from pairsim.config.accuracy import SETTINGS, Cells, is_level
from pairsim.results.output import write_text

ROOT = Path(__file__).resolve().parent.parent
STUDIES = ROOT / "configs" / "accuracy"
PAGE, PICTURE = ROOT / "docs" / "explanation" / "accuracy.md", ROOT / "docs" / "images" / "accuracy.png"
SCENES = {
    "newtonian": "Newtonian, soft",
    "De1": "De 1, soft",
    "De2-rigid": "De 2, rigid",
    "De1-gap0.02": "De 1, soft, gap .02",
}


def curves(output: Path) -> str:
    """Table of the errors of all master curves on all meshes."""
    parts = []
    for elastic in (False, True):
        found = {s: graded_rows(output / s.stem) for s in sorted(STUDIES.glob("curve-*.yaml"))}
        found = {s: rows for s, rows in found.items() if rows and (base(s)["De"] > 0) == elastic}
        if not found:
            continue
        meshes = sorted({key(row) for rows in found.values() for row in rows}, key=lambda m: (int(m[0]), -float(m[1])))
        lines = []
        for study, rows in found.items():
            place = base(study)
            errors = {key(row): number(row, "relative_error") for row in rows if row["reference"] == "false"}
            name = f"beta {place['beta']}, De {place['De']}, Ca_e {place['Ca_e']}"
            exact = next((key(row) for row in rows if row["reference"] == "true"), None)
            cells = ["reference" if mesh == exact else percent(errors.get(mesh, math.nan)) for mesh in meshes[:-1]]
            lines.append([name, *cells])
        ended = [row for rows in found.values() for row in rows if row.get("wall_time")]
        same = [[row for row in ended if key(row) == mesh] for mesh in meshes[:-1]]
        repeated = any(number(row, "wall_time_spread") > 0 for row in ended)
        for title, chosen, column in (
            (f"seconds for {points()} points, mean", statistics.mean, "wall_time"),
            *((("largest spread of repeated ones", max, "wall_time_spread"),) if repeated else ()),
        ):
            lines.append(
                [title, *(f"{chosen([number(r, column) for r in rows]):.1f}" if rows else "" for rows in same)]
            )
        parts.append(table(["% of the curve's peak", *(f"{a}, {b}" for a, b in meshes[:-1])], lines))
    return "\n".join(parts)


def points() -> str:
    """Number of points of the curves, as text."""
    counts = {len(yaml.safe_load(study.read_text())["at"]) for study in STUDIES.glob("curve-*.yaml")}
    return " or ".join(map(str, sorted(counts)))


def size(cells: Cells) -> str:
    """Np, max_size and rows of a mesh, as text."""
    bound = f" (no more than {cells.per_beta:g} beta)" if cells.per_beta < math.inf else ""
    return f"{cells.Np}, {cells.max_size:g}{bound}, {cells.rows:g}"


def settings(output: Path) -> str:
    """Table of the settings of each value of `accuracy`, with the largest error that was measured."""
    lines = []
    for name, chosen in SETTINGS.items():
        line = [f"`{name}`"]
        for elastic in (False, True):
            cells = chosen.thinning if elastic else chosen.newtonian
            rows = [
                row
                for study in STUDIES.glob("curve-*.yaml")
                if (base(study)["De"] > 0) == elastic
                for row in graded_rows(output / study.stem)
                if key(row) == (str(cells.Np), f"{cells.largest(base(study)['beta']):g}") and row.get("wall_time")
            ]
            worst = max(
                (number(row, "relative_error") for row in rows if row["reference"] == "false"), default=math.nan
            )
            seconds = statistics.mean(number(row, "wall_time") for row in rows) if rows else math.nan
            measured = "the reference itself" if math.isnan(worst) else percent(worst)
            line += [size(cells), f"{measured} ({seconds:.0f} s)" if rows else ""]
        lines.append([*line, size(chosen.hardening), f"{chosen.time_tol:g}", f"{chosen.curve_tol:g}"])
    head = ["accuracy"]
    for liquid in ("Newtonian", "viscoelastic"):
        head += [
            f"Np, max_size and rows of `mesh`, {liquid}",
            f"worst of its curves, % (mean time of {points()} points)",
        ]
    head += ["the same in a liquid that hardens in extension"]
    return table([*head, "`tol` of `time`", "`tol` of a curve"], lines)


def scenes(output: Path) -> str:
    """Figure of error against wall time, and table of the cost relative to the discretisation of the paper."""
    known = [
        scene
        for scene in SCENES
        if any(row.get("time.fixed_step") and row.get("relative_error") for row in rows_of(output / f"run-{scene}"))
        and rows_of(output / f"point-{scene}")
        and (output / f"plain-{scene}.json").is_file()
    ]
    if not known:
        return ""
    columns = min(len(known), 2)
    size = -(-len(known) // columns)
    figure, axes = pyplot.subplots(size, columns, figsize=(5 * columns, 3.75 * size), squeeze=False)
    lines = []
    for scene, axis in zip(known, axes.flat, strict=False):
        title = SCENES[scene]
        runs, steady = rows_of(output / f"run-{scene}"), rows_of(output / f"point-{scene}")
        published = next(row for row in runs if row.get("time.fixed_step"))
        seconds, error = (number(published, k) for k in ("wall_time", "relative_error"))
        plain = json.loads((output / f"plain-{scene}.json").read_text())
        whole = statistics.median(plain) * number(published, "steps"), seconds
        own = [r for r in runs if r is not published and number(r, "error") > 0]
        steady = [row for row in steady if number(row, "error") > 0]
        # Both errors are relative to the largest |dU| of the transient, since dU at d_0 may be much smaller.
        largest = number(own[0], "error") / number(own[0], "relative_error")
        for row in own + steady:
            row["part"] = repr(number(row, "error") / largest)
        for rows, marker, color, label in ((own, "o", "C0", "transient"), (steady, "s", "C1", "quasi-steady point")):
            for adapted, fill in ((False, color), (True, "none")):
                shown = [row for row in rows if is_level(row["accuracy"]) != adapted and not has_equal_cells(row)]
                t, e = ([number(row, key) for row in shown] for key in ("wall_time", "part"))
                style = {"color": color, "markerfacecolor": fill, "linestyle": "none"}
                name = f"{label}, accuracy: X%" if adapted else label
                axis.loglog(t, [100 * part for part in e], marker, label=name, **style)
        labels = ("one factorisation per step", "factorisation reused")
        for marker, x, label in zip(("*", "P"), whole, labels, strict=True):
            axis.loglog([x], [100 * error], marker, markersize=10, label=f"discretisation of the paper, {label}")
        axis.set(title=title, xlabel="wall time [s]", ylabel="error of $\\Delta U$ [% of its largest]")
        lines.append(
            [
                title,
                published["unknowns"],
                published["steps"],
                f"{published['newton_iterations']}, {published['factorisations']}",
                f"{seconds:.0f}",
                f"{statistics.median(plain):.2f} ({max(plain) - min(plain):.2f}), {whole[0]:.0f}",
                percent(error),
                *(beside(rows, error, whole) for rows in (own, steady)),
            ]
        )
    figure.legend(
        *axes.flat[0].get_legend_handles_labels(), loc="lower center", ncol=3, frameon=False, fontsize="small"
    )
    figure.tight_layout(rect=(0, 0.06, 1, 1))
    figure.savefig(PICTURE, dpi=110)
    head = [
        "scene",
        "unknowns",
        "steps",
        "iterations, factorisations",
        "s, factorisation reused",
        "one factorisation per step: s each (spread), s in all",
        "error, %",
        "our transient",
        "our quasi-steady point",
    ]
    return table(head, lines)


def promises(output: Path) -> str:
    """Table of what `accuracy: X%` reached, beside the fewest unknowns of cells set everywhere for the same error.

    Single points are left out: the errors of their studies are parts of their own dU, not of the largest |dU|.
    """
    lines = []
    for study in [*sorted(STUDIES.glob("curve-*.yaml")), *sorted(STUDIES.glob("run-*.yaml"))]:
        rows = [row for row in rows_of(output / study.stem) if row["reference"] == "false" and row.get("error")]
        rows = [row for row in rows if not row.get("time.fixed_step")]
        for row in (row for row in rows if not is_level(row["accuracy"])):
            others = [r for r in rows if is_level(r["accuracy"])]
            beside = [[r for r in others if has_equal_cells(r) == equal] for equal in (False, True)]
            cells = [row["unknowns"], f"{number(row, 'wall_time'):.3g}", percent(number(row, "relative_error"))]
            lines.append([study.stem, row["accuracy"], *cells, *(cheapest(r, row) for r in beside)])
    if not lines:
        return ""
    head = ["study", "wanted", "unknowns", "s", "error, %", "graded cells: unknowns, s", "equal cells: unknowns, s"]
    return table(head, lines)


def cheapest(rows: Rows, like: dict[str, str]) -> str:
    """Unknowns and time of the row with the fewest unknowns whose error is no larger than that of another one."""
    good = [row for row in rows if number(row, "error") <= number(like, "error")]
    if not good:
        return "none" if rows else ""
    chosen = min(good, key=lambda row: number(row, "unknowns"))
    return f"{chosen['unknowns']}, {number(chosen, 'wall_time'):.3g}"


def beside(rows: Rows, error: float, whole: tuple[float, float]) -> str:
    """Fastest row whose error is at most `error`, or else the most accurate row, with its cost relative to `whole`."""
    good = [row for row in rows if number(row, "part") <= error]
    if good:
        chosen = min(good, key=lambda row: number(row, "wall_time"))
    else:
        chosen = min(rows, key=lambda row: number(row, "part"))
    s, spread = number(chosen, "wall_time"), number(chosen, "wall_time_spread")
    wall = f"{s:.3g} s" + (f" (spread {short(spread)})" if spread > 0 else "")
    parts = ", ".join(f"1/{seconds / s:.0f}" for seconds in whole)
    return f"{wall} at {percent(number(chosen, 'part'))} %: {parts}"


def profile(output: Path) -> str:
    """Table of the wall time of runs and curves with default settings by phase of the computation."""
    phases = ("mesh", "jit", "symbolic", "assembly", "factorisation", "solve", "other")
    lines = []
    for study, title, count in (
        ("run-newtonian", "Newtonian run, a step", "steps"),
        ("run-De1", "De 1 run, a step", "steps"),
        ("curve-newtonian", "Newtonian curve, a point", "points"),
        ("curve-De1", "De 1 curve, a point", "points"),
    ):
        elastic = "De1" in study
        cells, tol = SETTINGS["1%"].mesh("thinning" if elastic else "newtonian", [0.4]), SETTINGS["1%"].time_tol
        for row in graded_rows(output / study):
            default = key(row) == (str(cells["Np"]), f"{cells['max_size']:g}") and row.get("ends") != "periodic"
            if default and float(row.get("time.tol") or tol) == tol:
                n, wall = number(row, count), number(row, "wall_time")
                shares = [f"{100 * number(row, f'wall_{name}') / wall:.0f}" for name in phases]
                newton, factored = (number(row, k) / n for k in ("newton_iterations", "factorisations"))
                lines.append([title, row["unknowns"], f"{wall / n:.3f}", f"{newton:.1f}", f"{factored:.2f}", *shares])
    if not lines:
        return ""
    head = ["", "unknowns", "s", "Newton iterations", "factorisations", *(f"{name}, %" for name in phases)]
    return table(head, lines)


def growth_table(output: Path) -> str:
    """Tables of the cost of an iteration against the number of unknowns."""
    if not (output / "growth.json").is_file():
        return ""
    parts = []
    for title, found in json.loads((output / "growth.json").read_text()).items():
        lines = [
            [
                f"{r['unknowns']}",
                *(f"{r[k]:.3f}" for k in ("assembly", "factorisation", "solve")),
                f"{r['iteration'] / r['factorisation']:.2f}",
                f"{r['memory']:.0f}",
            ]
            for r in found["rows"]
        ]
        lines.append(
            [
                "exponent",
                *(f"{found['exponents'][k]:.2f}" for k in ("assembly", "factorisation", "solve")),
                "",
                f"{found['exponents']['memory']:.2f}",
            ]
        )
        parts.append(
            f"{title}:\n\n"
            + table(
                [
                    "unknowns",
                    "assembly, s",
                    "MUMPS's numeric factorisation, s",
                    "solve, s",
                    "iteration over factorisation",
                    "factors, MB",
                ],
                lines,
            )
        )
    return "\n".join(parts)


def peers(path: Path | None, output: Path) -> str | None:
    """Table of the Newtonian pair in pyoomph and in pairsim: times and errors of a point and a transient to t = 1."""
    own = {kind: graded_rows(output / f"{kind}-newtonian") for kind in ("point", "run")}
    if path is None or not all(own.values()):
        return None
    with path.open(newline="") as file:
        theirs = medians(list(csv.DictReader(file)))
    end = {"point": "0", "run": "1"}
    exact = {kind: number(next(r for r in rows if r["reference"] == "true"), "dU") for kind, rows in own.items()}
    lines = []
    for row in (row for row in theirs if float(row["t"]) == float(end["run"])):
        alone = next((r for r in theirs if r["cells"] == row["cells"] and float(r["t"]) == float(end["point"])), None)
        both = [*peer_cells(alone, "wall", exact["point"]), *peer_cells(row, "wall", exact["run"])]
        lines.append([f"pyoomph, {row['cells']} cells, tol {float(row['tol']):g}", *both])
    for point in own["point"]:
        rows = [
            r for r in own["run"] if key(r) == key(point) and r["ends"] == "developed" and r["reference"] == "false"
        ]
        run = min(rows, key=lambda r: number(r, "time.tol"), default=None)
        if point["reference"] == "false" and run is not None:
            cells = [*peer_cells(point, "wall_time", exact["point"]), *peer_cells(run, "wall_time", exact["run"])]
            lines.append([f"pairsim, {point['mesh.Np']} cells, tol {run['time.tol']}", *cells])
    head = ["", "unknowns", "point, s (spread)", "error, %", "unknowns", "to t = 1, s (spread)", "error of dU(1), %"]
    return table(head, lines)


def medians(rows: Rows) -> Rows:
    """One row for each group of repeated runs, with the median and the spread of their wall times."""
    same: dict[tuple[str, ...], Rows] = {}
    for row in rows:
        same.setdefault((row["cells"], row["tol"], row["t"]), []).append(row)
    found = []
    for group in same.values():
        walls = [number(row, "wall") for row in group]
        found.append(group[0] | {"wall": repr(statistics.median(walls)), "wall_spread": repr(max(walls) - min(walls))})
    return found


def peer_cells(row: dict[str, str] | None, seconds: str, exact: float) -> list[str]:
    """Cells with the number of unknowns, the wall time [s] and the error of dU [%]."""
    if row is None:
        return ["", "", ""]
    spread = number(row, f"{seconds}_spread")
    wall = short(number(row, seconds)) + (f" ({spread:.1g})" if spread > 0 else "")
    return [row["unknowns"], wall, percent(abs(number(row, "dU") / exact - 1))]


def days(output: Path) -> str:
    """Dates on which the studies were computed, as text."""
    seen = {datetime.date.fromtimestamp(path.stat().st_mtime) for path in output.glob("*/study.csv")}
    return " to ".join(dict.fromkeys(str(day) for day in (min(seen), max(seen)))) if seen else "never"


def write_page(output: Path, peers_table: Path | None, hard: Path | None) -> None:
    """Insert the tables for which there are results into the page.

    Args:
        output: Output folder of scripts/accuracy.
        peers_table: Table written by a script in scripts/peers, None without one.
        hard: Output folder of scripts/hard, None without one.
    """
    page = PAGE.read_text()
    for name, content in {
        "made": f"Computed {days(output)} on {machine()}, one thread a process.\n",
        "settings": settings(output),
        "curves": curves(output),
        "promises": promises(output),
        "scenes": scenes(output),
        "profile": profile(output),
        "growth": growth_table(output),
        "peers": peers(peers_table, output),
        "hard": (hard / "hard.md").read_text() if hard else None,
    }.items():
        page = put(page, name, content)
    write_text(PAGE, page)
