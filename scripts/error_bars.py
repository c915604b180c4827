"""Error bars of dU against errors: fixes the safety factor of dU_error on half of the scenes, judges it on the others.

usage: scripts/error_bars [-o runs/error_bars] [--only WORD] [--table] [--runs]

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
from typing import TYPE_CHECKING, Any

import error_bars_runs
import yaml
from measuring import with_one_thread

from pairsim.results.output import write_table, write_text
from pairsim.solvers.errors.estimate import CANCELLING, SAFETY

if TYPE_CHECKING:
    from pairsim.config.curve_case import CurveCase

SCENES = Path(__file__).resolve().parent.parent / "configs" / "error_bars" / "scenes.yaml"
COLUMNS = ["scene", "mesh", "gap", "unknowns", "seconds", "dU", "dU_correction", "spread_dU", "newton_dU"]
COLUMNS += ["scatter_dU", "ends_dU", "s_jump", "mesh_error", "reason"]
ESTIMATED = ("dU_correction", "spread_dU", "scatter_dU", "mesh_error")
# Meshes that are judged, and the two that give the truth; cells near the ends of the latter's ranges differ in kind.
# All have equal arcs: the table of docs/explanation/error-estimate.md is older than graded ones.
NEWTONIAN = {
    "coarse": {"Np": 20, "max_size": 0.2},
    "middle": {"Np": 28, "max_size": 0.2},
    "default": {"Np": 40, "max_size": 0.2},
    "fine 1": {"Np": 80, "max_size": 0.1},
    "fine 2": {"Np": 72, "max_size": 0.14, "growth": 0.1},
}
VISCOELASTIC = {
    "coarse": {"Np": 14, "max_size": 0.1, "rows": 0.5, "grading": 1.0},
    "middle": {"Np": 20, "max_size": 0.07, "rows": 0.5, "grading": 1.0},
    "default": {"Np": 28, "max_size": 0.05, "rows": 0.5, "grading": 1.0},
    "fine 1": {"Np": 56, "max_size": 0.03, "rows": 0.5, "grading": 1.0},
    "fine 2": {"Np": 48, "max_size": 0.025, "growth": 0.1, "rows": 1.0, "grading": 1.0},
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


def case_of(name: str, scene: dict[str, Any], mesh: str) -> CurveCase:
    """The curve of a scene on a mesh: one distance or, for the peak, those at which it is looked for."""
    from pairsim.commands import COMMANDS
    from pairsim.inputs.case_files import parse_case

    distances = PEAK_AT if mesh == PEAK else (scene["d"],)
    cells = meshes_of(scene)[JUDGED[0] if mesh == PEAK else mesh]
    return parse_case(
        COMMANDS["curve"], {"ends": "developed", "length": "auto", "mesh": cells, **scene, "d": distances}, name
    )


def solve(name: str, scene: dict[str, Any], mesh: str) -> list[Row]:
    """A row for every gap of a scene on a mesh; for the peak, with the largest dU of all distances."""

    import pairsim.runtime.fenicsx  # noqa: F401 - orders MPI ahead of everything compiled
    from pairsim.config.form_kinds import forms_of
    from pairsim.drivers.problems import solution_order, steady_problem
    from pairsim.fem.form_cache import ensure_compiled
    from pairsim.runtime.errors import RunFailure
    from pairsim.solvers.curves.branch import Branch
    from pairsim.solvers.parameters import Parameters

    case = case_of(name, scene, mesh)
    ensure_compiled(forms_of(case), print)
    places, begin = solution_order(case), time.perf_counter()
    start = Parameters(places[0], case.solid_models, case.liquid_model)
    try:
        narrowest = min(place[0] for place in places)
        branch = Branch(steady_problem(case, narrowest), start, mesh_error=mesh in JUDGED)
        points = [branch.at(Parameters(place, case.solid_models, case.liquid_model)) for place in places]
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
        values = {
            "dU": largest.held_dUs,
            "dU_correction": estimate.dU,
            "newton_dU": estimate.newton_dU,
        }
        values |= {"spread_dU": estimate.spread_dU, "scatter_dU": estimate.scatter_dU, "ends_dU": estimate.ends_dU}
        if largest.mesh_errors is not None:
            values["mesh_error"] = largest.mesh_errors
        if (conformation := largest.observation.conformation) is not None:
            row["s_jump"] = conformation.s_jump
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
    from pairsim.commands import COMMANDS

    rows = read(path)
    done = {(row["scene"], row["mesh"]) for row in rows}

    def expense(name: str) -> float:
        return max(COMMANDS["curve"].estimate(case_of(name, scenes[name], mesh)).seconds for mesh in FINE)

    for name in sorted(scenes, key=expense):
        scene = scenes[name]
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
        said: The columns that say something of it.
    """

    scene: str
    mesh: str
    gap: int
    error: float
    said: dict[str, float]

    def __str__(self) -> str:
        return f"{self.scene}, {self.mesh}, gap {self.gap}"


def correction(e: Judged) -> float:
    """The signed estimate alone, as a bar."""
    return abs(e.said["dU_correction"])


def of_cells(e: Judged) -> float:
    """What dU_error multiplies by the safety factor, without the ends: all meshes of a scene have the same tube."""
    return max(correction(e) + abs(e.said["spread_dU"]), e.said["scatter_dU"])


def coarser(e: Judged) -> float:
    """The difference from the coarser mesh."""
    return e.said["mesh_error"]


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
            said = {key: float(row[key]) for key in ESTIMATED if row[key] != ""}
            known.append(Judged(scene, mesh, gap, error, said))
    return known, undecided, negligible


def factor_for(errors: Iterable[Judged], bar: Bar) -> float:
    """The least factor of a bar with which it covers the wanted part of the errors."""
    needed = sorted(abs(e.error) / bar(e) if bar(e) else math.inf for e in errors)
    return needed[math.ceil(COVERED * len(needed)) - 1] if needed else math.nan


def summary(errors: list[Judged], bar: Bar, factor: float) -> str:
    """Cells of the table: coverage with a factor, how the bar itself compares with the error, and the bar's width."""
    if not errors:
        return "0 | | | | |"
    ratios = [bar(e) / abs(e.error) for e in errors]
    covered = sum(factor * ratio >= 1 for ratio in ratios)
    within = sum(0.5 <= ratio <= 2 for ratio in ratios)
    parts = [f"{100 * count / len(errors):.0f} %" for count in (covered, within)]
    parts += [f"{statistics.median(ratios):.2f}", f"{min(ratios):.2g} to {max(ratios):.2g}"]
    return " | ".join([str(len(errors)), *parts, f"{factor * statistics.median(ratios):.1f}"])


def page(scenes: dict[str, dict[str, Any]], rows: list[Row]) -> str:
    """The judgement."""
    errors, undecided, negligible = judged(rows)
    half = {name: place % 2 for place, name in enumerate(scenes)}
    fixing, judging = ([e for e in errors if half[e.scene] == part] for part in (0, 1))
    groups = {"fixing": fixing, "judging": judging}
    for kind in ("newtonian", "giesekus"):
        groups[kind] = [e for e in errors if e.scene.startswith(kind)]
    groups["other laws"] = [e for e in errors if not e.scene.startswith(("newtonian", "giesekus"))]
    groups["De 2"] = [e for e in errors if scenes[e.scene]["De"] == 2]
    lines = [
        "| bar | scenes | factor | errors | covered | within [.5, 2] | median of bar/error | least to largest | "
        "median of factor bar/error |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    missed = []
    for name, bar, given in BARS:
        factor = factor_for(fixing, bar) if given is None else given
        lines += [
            f"| {name} | {title} | {factor:.2f} | {summary(group, bar, factor)} |" for title, group in groups.items()
        ]
        missed += [
            f"{name} misses {e}: error {e.error:.2e}, bar {factor * bar(e):.2e}"
            for e in (judging if given is None else errors)
            if factor * bar(e) < abs(e.error)
        ]
    signs = sum(e.said["dU_correction"] * e.error > 0 for e in errors)
    better = sum(abs(e.error - e.said["dU_correction"]) < abs(e.error) for e in errors)
    lines += ["", *missed]
    lines += ["", f"Signs that are right: {signs} of {len(errors)}; dU better with its correction: {better}."]
    cancelling = [e for e in errors if e.said["scatter_dU"] > CANCELLING * correction(e)]
    lines += ["", f"Estimates that cancel: {len(cancelling)}", *(str(e) for e in cancelling)]
    for title, places in (("Undecided", undecided), ("Negligible", negligible)):
        lines += ["", f"{title}: {len(places)}", *places]
    failures = [f"{row['scene']}, {row['mesh']}: {row['reason']}" for row in rows if row["reason"]]
    lines += ["", f"Not solved: {len(failures)}", *failures]
    there = {(row["scene"], row["mesh"]) for row in rows}
    absent = [name for name in scenes if any((name, mesh) not in there for mesh in (PEAK, *JUDGED, *FINE))]
    lines += ["", f"Not yet computed: {len(absent)}", *absent]
    return "\n".join(lines) + "\n"


type Bar = Callable[[Judged], float]
# Name, bar, and its factor; None: fixed on half of the scenes.
BARS: tuple[tuple[str, Bar, float | None], ...] = (
    ("dU_correction", correction, None),
    ("dU_error over its factor", of_cells, None),
    ("dU_error", of_cells, SAFETY),
    ("mesh_error", coarser, None),
)


def main() -> int:
    """Compute, then judge."""
    with_one_thread()
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="error_bars", description=__doc__, formatter_class=form)
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/error_bars"))
    parser.add_argument("--only", default="", metavar="WORD", help="scenes whose name contains it")
    parser.add_argument("--table", action="store_true", help="judge what there is, compute nothing")
    parser.add_argument("--runs", action="store_true", help="runs in time instead (scripts/error_bars_runs.py)")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    if arguments.runs:
        return int(error_bars_runs.judge(arguments.output, arguments.only, arguments.table) > 0)
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
