"""Error bars of dU against errors, of quasi-steady solutions or, with --runs, of runs in time.

usage: scripts/error_bars [-o runs/error_bars] [--runs] [--only WORD] [--workers N] [--table]

Solves every scene of configs/error_bars/scenes.yaml on three meshes, with the error,
and integrates every case of runs.yaml at two values of `accuracy`; both also on two fine meshes of different kinds,
which give the truth. Some three hours, and twenty minutes for runs; the same command goes on after any kind of end. An
error is judged if the two truths agree to a fifth of it, and if it is not below .02 % of the largest |dU|. On half of
the scenes the factors are fixed with which the bars cover 95 % of the errors, on the others they are judged. Writes
every error to errors.csv and the judgement to errors.md.

Exit code 0: all was solved and judged; 1: a scene could not be solved.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from book import pages
from book.cases import Case, Cases
from book.computing import CONFIGS, pairsim, parser_of

from pairsim.results.output import write_text

# All meshes of scenes have equal arcs: the table of docs/explanation/error-estimate.md is older than graded ones.
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
# Meshes and tolerances of the truth of runs.
FINE_RUNS = {
    False: {
        "fine 1": {"mesh": {"Np": 80, "max_size": 0.1}, "time.tol": 5e-5},
        "fine 2": {"mesh": {"Np": 64, "max_size": 0.14, "growth": 0.1}, "time.tol": 8e-5},
    },
    True: {
        "fine 1": {"mesh": {"Np": 48, "max_size": 0.03, "rows": 0.5, "grading": 1.0}, "time.tol": 1e-4},
        "fine 2": {
            "mesh": {"Np": 44, "max_size": 0.035, "growth": 0.1, "rows": 1.0, "grading": 1.0},
            "time.tol": 1.5e-4,
        },
    },
}
FINE = ("fine 1", "fine 2")
PEAK_AT = [0.03, 0.1, 0.3, 0.8]
"""Distances at which, with its own, the largest dU of a scene's curve is looked for, on its coarsest mesh."""
TIMES = 10
"""Times at which runs are judged."""
KNOWN, NEGLIGIBLE, COVERED = 0.2, 2e-4, 0.95
SHARED: dict[str, Any] = {"ends": "developed", "length": "auto"}
BARS = {"dU_error": 1.0, "dU_error, fixed": None}
"""Bars, and their factors; None: fixed on half of the scenes."""


def scene_cases(name: str, scene: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """A scene on all meshes; small particles in viscoelastic liquids have smaller cells, as the defaults have them."""
    beta = scene["beta"]
    scale = min(1.0, 5 * min(beta if isinstance(beta, list) else [beta])) if scene["De"] else 1.0
    for kind, mesh in (VISCOELASTIC if scene["De"] else NEWTONIAN).items():
        cells = mesh | {"max_size": mesh["max_size"] * scale}
        point = SHARED | scene | {"mesh": cells, "d": [scene["d"]], "max_points": 1}
        yield {"name": f"{name}+{kind}".replace(" ", "."), **point}
        if kind == "coarse":
            places = sorted({*PEAK_AT, scene["d"]})
            yield {"name": f"{name}+peak", **point, "d": places, "max_points": len(places), "tol": 1}


def run_cases(name: str, case: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """A run in all discretisations."""
    times = [round(case["time"]["end"] * k / TIMES, 10) for k in range(1, TIMES + 1)]
    same = SHARED | case | {"output": {"fields": False, "times": times}}
    for accuracy in ("5%", "1%"):
        yield {"name": f"{name}+{accuracy[:-1]}", **same, "accuracy": accuracy, "dU_error": True}
    for kind, settings in FINE_RUNS[bool(case["De"])].items():
        yield {"name": f"{name}+{kind}".replace(" ", "."), **same, **settings}


def sorted_out(output: Path, scenes: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Case]]]:
    """Finished cases by scene and discretisation, of scenes whose truth is there."""
    found: dict[str, dict[str, Case]] = {}
    for case in Cases(output.parent, []).of(output.name):
        scene, _, kind = case.folder.name.rpartition("-")[0].partition("+")
        found.setdefault(scene, {})[kind.replace(".", " ")] = case
    for name in (name for name in scenes if set(FINE) <= found.get(name, {}).keys()):
        same = (found.get(other, {}).get("peak") for other in scenes if alone(scenes[other]) == alone(scenes[name]))
        yield name, {"peak": peak} | found[name] if (peak := next(filter(None, same), None)) else found[name]


def alone(scene: Mapping[str, Any]) -> dict[str, Any]:
    """A scene without its distance; scenes that differ in that alone may share the curve of the peak."""
    return {key: value for key, value in scene.items() if key != "d"}


def scene_errors(name: str, kinds: dict[str, Case]) -> Iterator[dict[str, Any]]:
    """The error of every gap on every mesh, and what is said of it."""
    for gap in range(1, kinds["fine 1"].parameters["particles"]):
        end = "" if kinds["fine 1"].parameters["particles"] == 2 else f"_{gap}"
        first, second = (kinds[kind].last(f"dU_held{end}") for kind in FINE)
        peak = float(kinds["peak"].table[f"dU_held{end}"].abs().max())
        for kind in (kind for kind in kinds if kind not in (*FINE, "peak")):
            row = {key: kinds[kind].last(f"{key}{end}") for key in ("dU_held", "dU_discrete", "dU_correction")}
            # All meshes of a scene have the same tube.
            row["dU_error"] = kinds[kind].last(f"dU_error{end}") - kinds[kind].last(f"ends_error{end}")
            truth = {"error": (first + second) / 2 - row["dU_held"], "known": abs(first - second), "peak": peak}
            cancels = not kinds[kind].last("corrected")
            yield {"scene": name, "kind": kind, "at": gap, **row, **truth, "cancels": cancels}


def run_errors(name: str, kinds: dict[str, Case]) -> Iterator[dict[str, Any]]:
    """The error at every time of a run, and what is said of it."""
    times = kinds["fine 1"].parameters["output.times"]
    at = {
        kind: case.table.iloc[[int((case.table["t"] - t).abs().argmin()) for t in times]]
        for kind, case in kinds.items()
    }
    first, second = (at[kind]["dU"].to_numpy() for kind in FINE)
    for kind in (kind for kind in kinds if kind not in FINE):
        table = at[kind][["t", "dU", "dU_correction", "dU_error", "mesh"]].reset_index(drop=True)
        table["error"], table["known"] = (first + second) / 2 - table["dU"], np.abs(first - second)
        for row in table.rename(columns={"t": "at", "mesh": "remeshings"}).to_dict("records"):
            whole = {"scene": name, "kind": kind, "peak": kinds["fine 1"].peak, "cancels": False}
            yield whole | {str(key): value for key, value in row.items()}


def verdict(row: Any) -> str:
    """Whether the interval holds the truth, as far as can be told."""
    if abs(row["error"]) < NEGLIGIBLE * row["peak"]:
        return "negligible"
    if row["known"] > KNOWN * abs(row["error"]):
        return "undecided"
    return "held" if abs(row["error"]) <= row["dU_error"] else "missed"


def groups(judged: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Errors by what is said of them: those that fix factors (of every second scene), the others, and by liquid."""
    other = ~judged["scene"].str.startswith(("newtonian", "giesekus"))
    found = {"fixing": judged[judged["fixes"]], "judging": judged[~judged["fixes"]]}
    found |= {kind: judged[judged["scene"].str.startswith(kind)] for kind in ("newtonian", "giesekus")}
    return found | {"other laws": judged[other], "De 2": judged[judged["De"] == 2]}


def bars(judged: pd.DataFrame) -> pd.DataFrame:
    """How often each bar covers the error with its factor, and how it compares with the error."""
    lines = []
    for name, given in BARS.items():
        column = name.partition(",")[0]
        if column not in judged:
            continue
        ratios = judged[column].abs() / judged["error"].abs()
        needed = (1 / ratios[judged["fixes"]]).sort_values()
        factor = given or (needed.iloc[math.ceil(COVERED * len(needed)) - 1] if len(needed) else math.nan)
        for group, part in groups(judged).items():
            own = ratios[part.index]
            line = {"bar": name, "scenes": group, "factor": f"{factor:.2f}", "errors": len(own)}
            if len(own):
                line |= {"covered": f"{100 * (factor * own >= 1).mean():.0f} %"}
                line |= {"within [.5, 2]": f"{100 * own.between(0.5, 2).mean():.0f} %", "median": f"{own.median():.2f}"}
                line |= {"least to largest": f"{own.min():.2g} to {own.max():.2g}"}
                line |= {"factor times median": f"{factor * own.median():.1f}"}
            lines.append(line)
    return pd.DataFrame(lines).fillna("")


def by_scene(errors: pd.DataFrame) -> pd.DataFrame:
    """Verdicts by scene and discretisation, with the median of what is said over the error."""
    judged = errors[errors["verdict"].isin(["held", "missed"])]
    counts = pd.crosstab([errors["scene"], errors["kind"]], errors["verdict"])
    ratio = (judged["dU_error"] / judged["error"].abs()).groupby([judged["scene"], judged["kind"]])
    text = ratio.agg(lambda part: f"{part.median():.2f} ({part.min():.2g} to {part.max():.2g})")
    counts["dU_error/error"] = text.reindex(counts.index).fillna("")
    return counts.reset_index()


def page(errors: pd.DataFrame) -> str:
    """The judgement."""
    judged = errors[errors["verdict"].isin(["held", "missed"])]
    added = judged[~judged["cancels"]]
    better = (added["error"].abs() < (added["error"] + added["dU_correction"]).abs()).sum()
    text = f"{len(judged)} errors are judged. dU_correction is added in {len(added)}, and makes dU better in {better}."
    missed = judged.loc[judged["verdict"] == "missed", ["scene", "kind", "at", "error", "dU_error"]]
    tables = [
        bars(judged),
        by_scene(errors),
        missed.map(lambda cell: f"{cell:.3g}" if isinstance(cell, float) else cell),
    ]
    return "\n".join([pages.prose(text), *(pages.markdown(table) for table in tables)])


def main() -> int:
    """Compute, then judge."""
    parser = parser_of("error_bars", __doc__, "runs/error_bars")
    parser.add_argument("--only", default="", metavar="WORD", help="scenes whose name contains it")
    parser.add_argument("--runs", action="store_true", help="runs in time instead")
    arguments = parser.parse_args()
    kind, command = ("runs", "run") if arguments.runs else ("scenes", "curve")
    scenes = yaml.safe_load((CONFIGS / "error_bars" / f"{kind}.yaml").read_text())
    output: Path = arguments.output / (f"{kind}-{arguments.only}" if arguments.only else kind)
    code, file = 0, output.parent / f"{output.name}.yaml"
    if not arguments.table:
        chosen = {name: scene for name, scene in scenes.items() if arguments.only in name}
        of = run_cases if arguments.runs else scene_cases
        grid = {"command": command, "cases": [case for name, scene in chosen.items() for case in of(name, scene)]}
        output.parent.mkdir(parents=True, exist_ok=True)
        write_text(file, yaml.safe_dump(grid, sort_keys=False))
        code = pairsim("sweep", file, "-o", output, "--workers", arguments.workers)
    found = sorted_out(output, scenes)
    rows = [row for name, kinds in found for row in (run_errors if arguments.runs else scene_errors)(name, kinds)]
    errors = pd.DataFrame(rows)
    if len(errors):
        fixing = list(scenes)[::2]
        errors["fixes"] = errors["scene"].isin(fixing)
        errors["De"] = errors["scene"].map(lambda name: scenes[name]["De"])
        errors["verdict"] = [verdict(row) for _, row in errors.iterrows()]
        write_text(output.parent / f"{kind}.csv", errors.to_csv(index=False))
        write_text(output.parent / f"{kind}.md", page(errors))
        print(page(errors))
    return int(code != 0)


if __name__ == "__main__":
    sys.exit(main())
