"""Error bars of dU against errors: fixes the safety factor of dU_error on half of the scenes, judges it on the others.

usage: scripts/error_bars [-o runs/error_bars] [--only WORD] [--table]

Solves every scene of configs/error_bars/scenes.yaml on three meshes, with the estimate of the error and with the
coarser mesh that mesh_error asks for, and on two fine meshes of different kinds that give its truth. One process, some
three hours in all, the cheapest scenes first; the same command goes on after any kind of end, with the scene and mesh
that it was at. Writes error_bars.csv, a row a gap and mesh, and error_bars.md into the folder; with --table it only
judges the scenes that are there, and lists those that are not.

Exit code 0: all was solved and judged; 1: a scene could not be solved (its reason is in the table).
"""

from __future__ import annotations

import argparse
import csv
import math
import statistics
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from measuring import with_one_thread

from pairsim.results.output import write_table, write_text

SCENES = Path(__file__).resolve().parent.parent / "configs" / "error_bars" / "scenes.yaml"
COLUMNS = ["scene", "mesh", "gap", "unknowns", "seconds", "dU", "dU_correction", "spread_dU", "newton_dU"]
COLUMNS += ["mesh_error", "reason"]
# Meshes that are judged, and the two that give the truth; cells near the ends of the latter's ranges differ in kind.
NEWTONIAN = {
    "coarse": {"Np": 20, "max_size": 0.2},
    "middle": {"Np": 28, "max_size": 0.2},
    "default": {"Np": 40, "max_size": 0.2},
    "fine 1": {"Np": 80, "max_size": 0.1},
    "fine 2": {"Np": 72, "max_size": 0.14, "growth": 0.1},
}
VISCOELASTIC = {
    "coarse": {"Np": 14, "max_size": 0.1, "rows": 0.5},
    "middle": {"Np": 20, "max_size": 0.07, "rows": 0.5},
    "default": {"Np": 28, "max_size": 0.05, "rows": 0.5},
    "fine 1": {"Np": 56, "max_size": 0.03, "rows": 0.5},
    "fine 2": {"Np": 48, "max_size": 0.025, "growth": 0.1, "rows": 1.0},
}
JUDGED, FINE, PEAK = ("coarse", "middle", "default"), ("fine 1", "fine 2"), "peak"
# Distances at which the largest dU of a scene's curve is looked for, on its coarsest mesh.
PEAK_AT = (0.03, 0.1, 0.3, 0.8)
# The truth must be known to this part of an error that is judged, and errors below this part of the peak do not count.
KNOWN, NEGLIGIBLE = 0.2, 2e-4
COVERED = 0.95
Row = dict[str, Any]


def meshes_of(scene: dict[str, Any]) -> dict[str, dict[str, float]]:
    """The meshes of a scene; small particles in viscoelastic liquids have smaller cells, as the defaults have them."""
    if not scene["De"]:
        return NEWTONIAN
    beta = scene["beta"]
    scale = min(1.0, 5 * min(beta if isinstance(beta, list) else [beta]))
    return {name: mesh | {"max_size": mesh["max_size"] * scale} for name, mesh in VISCOELASTIC.items()}


def solve(name: str, scene: dict[str, Any], mesh: str) -> list[Row]:
    """A row for every gap of a scene on a mesh; for the peak, with the largest dU of all distances."""
    from mpi4py import MPI

    import pairsim.runtime.fenicsx  # noqa: F401 - orders MPI ahead of everything compiled
    from pairsim.config.case_file import curve_from_dict
    from pairsim.config.form_kinds import forms_of
    from pairsim.drivers.problems import solution_order, steady_problem
    from pairsim.fem.form_cache import ensure_compiled
    from pairsim.runtime.errors import RunFailure
    from pairsim.solvers.branch import Branch
    from pairsim.solvers.parameters import Parameters

    distances = PEAK_AT if mesh == PEAK else (scene["d"],)
    cells = meshes_of(scene)[JUDGED[0] if mesh == PEAK else mesh]
    keys = {"ends": "developed", "length": "auto", "mesh": cells, **scene, "d": distances}
    case = curve_from_dict(keys, name)
    ensure_compiled(MPI.COMM_SELF, forms_of(case))
    places, begin = solution_order(case), time.perf_counter()
    start = Parameters(places[0], case.Ca_es, case.De)
    try:
        branch = Branch(MPI.COMM_SELF, steady_problem(case, min(distances)), start, mesh_error=mesh in JUDGED)
        points = [branch.at(Parameters(place, case.Ca_es, case.De)) for place in places]
        unknowns = branch.fine.constraints.size
        branch.close()
        seconds = time.perf_counter() - begin
    except RunFailure as failure:
        return [{"scene": name, "mesh": mesh, "gap": 1, "reason": failure.message}]
    rows = []
    for gap in range(case.n - 1):
        largest = max(points, key=lambda point: abs(point.dUs[gap]))
        row = {"scene": name, "mesh": mesh, "gap": gap + 1, "unknowns": unknowns, "seconds": round(seconds, 2)}
        estimate = largest.estimate
        values = {"dU": largest.dUs, "dU_correction": estimate.dU, "newton_dU": estimate.newton_dU}
        values["spread_dU"] = estimate.spread_dU
        if largest.mesh_errors is not None:
            values["mesh_error"] = largest.mesh_errors
        rows.append(row | {key: float(value[gap]) for key, value in values.items()})
    return rows


def read(path: Path) -> list[Row]:
    """The table so far."""
    if not path.is_file():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def compute(scenes: dict[str, dict[str, Any]], path: Path, only: str) -> None:
    """Solve what has not been solved, and write the table after each solution."""
    rows = read(path)
    done = {(row["scene"], row["mesh"]) for row in rows}
    for name, scene in scenes.items():
        for mesh in (PEAK, *JUDGED, *FINE):
            if only in name and (name, mesh) not in done:
                rows += solve(name, scene, mesh)
                write_table(path, COLUMNS, [{key: row.get(key, "") for key in COLUMNS} for row in rows])
                print(*(f"{key} {value}" for key, value in rows[-1].items()), sep="  ", flush=True)


@dataclass(frozen=True)
class Judged:
    """An error that is known well enough to judge its bars.

    Attributes:
        scene, mesh, gap: Where.
        error: Exact minus discrete dU.
        correction, spread, newton, mesh_error: What is said of it.
    """

    scene: str
    mesh: str
    gap: int
    error: float
    correction: float
    spread: float
    newton: float
    mesh_error: float


def judged(rows: list[Row]) -> tuple[list[Judged], list[str], list[str]]:
    """Errors that can be judged; those that are undecided because of their truth; those that are negligible."""
    values = {(row["scene"], int(row["gap"]), row["mesh"]): row for row in rows if not row["reason"]}
    known, undecided, negligible = [], [], []
    for (scene, gap, mesh), row in values.items():
        others = [values.get((scene, gap, other)) for other in (*FINE, PEAK)]
        if mesh not in JUDGED or any(other is None for other in others):
            continue
        first, second, peak = (float(other["dU"]) for other in others if other is not None)
        error, where = (first + second) / 2 - float(row["dU"]), f"{scene}, {mesh}, gap {gap}"
        if abs(error) < NEGLIGIBLE * abs(peak):
            negligible.append(where)
        elif abs(first - second) > KNOWN * abs(error):
            undecided.append(f"{where}: error {error:.1e}, truth known to {abs(first - second):.1e}")
        else:
            correction, spread, newton, coarser = (
                float(row[key]) for key in ("dU_correction", "spread_dU", "newton_dU", "mesh_error")
            )
            known.append(Judged(scene, mesh, gap, error, correction, spread, abs(newton), coarser))
    return known, undecided, negligible


def factor_for(errors: Iterable[Judged], bar: Callable[[Judged], float]) -> float:
    """The least factor of a bar with which it covers the wanted part of the errors."""
    needed = sorted(max(abs(e.error) - e.newton, 0.0) / bar(e) if bar(e) else math.inf for e in errors)
    return needed[math.ceil(COVERED * len(needed)) - 1] if needed else math.nan


def summary(errors: list[Judged], bar: Callable[[Judged], float], factor: float) -> str:
    """Cells of the table: coverage with a factor, and how the bar itself compares with the error."""
    if not errors:
        return "0 | | | |"
    ratios = [bar(e) / abs(e.error) for e in errors]
    covered = sum(factor * bar(e) + e.newton >= abs(e.error) for e in errors)
    within = sum(0.5 <= ratio <= 2 for ratio in ratios)
    parts = [f"{100 * count / len(errors):.0f} %" for count in (covered, within)]
    parts += [f"{statistics.median(ratios):.2f}", f"{min(ratios):.2g} to {max(ratios):.2g}"]
    return " | ".join([str(len(errors)), *parts])


def page(scenes: Iterable[str], rows: list[Row]) -> str:
    """The judgement."""
    errors, undecided, negligible = judged(rows)
    half = {name: place % 2 for place, name in enumerate(scenes)}
    fixing, judging = ([e for e in errors if half[e.scene] == part] for part in (0, 1))
    lines = ["| bar | scenes | factor | errors | covered | within [.5, 2] | median of bar/error | least to largest |"]
    lines += ["|---|---|---|---|---|---|---|---|"]
    bars: dict[str, Callable[[Judged], float]] = {
        "dU_correction": lambda e: abs(e.correction),
        "dU_correction and spread_dU": lambda e: abs(e.correction) + abs(e.spread),
        "mesh_error": lambda e: e.mesh_error,
    }
    for name, bar in bars.items():
        factor = factor_for(fixing, bar)
        groups = {"fixing": fixing, "judging": judging}
        for kind in ("newtonian", "giesekus", "other laws"):
            named = [e for e in errors if e.scene.startswith(kind)]
            rest = [e for e in errors if not e.scene.startswith(("newtonian", "giesekus"))]
            groups[kind] = rest if kind == "other laws" else named
        for title, group in groups.items():
            lines.append(f"| {name} | {title} | {factor:.2f} | {summary(group, bar, factor)} |")
        missed = [e for e in judging if factor * bar(e) + e.newton < abs(e.error)]
        lines += [""] * bool(missed) + [
            f"{name} misses {e.scene}, {e.mesh}, gap {e.gap}: error {e.error:.2e}, bar {factor * bar(e):.2e}"
            for e in missed
        ]
    signs = sum(e.correction * e.error > 0 for e in errors)
    better = sum(abs(e.error - e.correction) < abs(e.error) for e in errors)
    lines += ["", f"Signs that are right: {signs} of {len(errors)}; dU better with its correction: {better}."]
    for title, places in (("Undecided", undecided), ("Negligible", negligible)):
        lines += ["", f"{title}: {len(places)}", *places]
    failures = [f"{row['scene']}, {row['mesh']}: {row['reason']}" for row in rows if row["reason"]]
    lines += ["", f"Not solved: {len(failures)}", *failures]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Compute, then judge."""
    with_one_thread()
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="error_bars", description=__doc__, formatter_class=form)
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/error_bars"))
    parser.add_argument("--only", default="", metavar="WORD", help="scenes whose name contains it")
    parser.add_argument("--table", action="store_true", help="judge what there is, compute nothing")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    scenes, table = yaml.safe_load(SCENES.read_text()), arguments.output / "error_bars.csv"
    if not arguments.table:
        compute(scenes, table, arguments.only)
    rows = read(table)
    text = page(scenes, rows)
    write_text(arguments.output / "error_bars.md", text)
    print(text)
    return int(any(row["reason"] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
