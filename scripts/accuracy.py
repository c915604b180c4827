"""Measures wall time against error: the tables and the picture of docs/explanation/accuracy.md.

usage: scripts/accuracy [-o runs/accuracy] [--only WORD] [--hard DIR] [--table] [--page]

Runs every study of configs/accuracy in one process after the other, so that wall times are comparable (about an hour
and a half); some steps of the discretisation of the paper (fixed steps of 7.5e-4 on 1e4 triangles) with a new matrix in
every Newton iteration; and the runs of configs/accuracy/moving, beside which curves are judged. The same command
goes on after any kind of end. Then the tables for which there are results are stored in docs/results/accuracy, and the
page is written from what is stored: with --page without anything else. --table computes nothing. --hard adds the
results of scripts/hard. The comparison of codes is stored by scripts/peers/codes.py.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from book import pages, yaml_files
from book.cases import Cases
from book.computing import CONFIGS, DOCS, made, pairsim, parser_of
from matplotlib import pyplot

import pairsim as api
from pairsim.cases.accuracy import SETTINGS, Cells
from pairsim.record.folder import write_text

STUDIES = {path.stem: yaml_files.read(path) for path in sorted((CONFIGS / "accuracy").glob("*.yaml"))}
PAGE, PICTURE = DOCS / "explanation" / "accuracy.md", DOCS / "images" / "accuracy.png"
SCENES = {
    "newtonian": "Newtonian, soft",
    "De1": "De 1, soft",
    "De2-rigid": "De 2, rigid",
    "De1-gap0.02": "De 1, soft, gap .02",
}
# Steps with a new matrix in every iteration, and how many of them, the last ones, are evaluated; chosen.
PLAIN_STEPS, PLAIN_COUNTED = 20, 5
TEXT = dict.fromkeys(["mesh.Np", "mesh.max_size", "accuracy"], str)
NUMBERS = ["mesh.grading", "mesh.row_grading", "time.fixed_step", "error", "relative_error"]
"""Columns that not every study.csv has."""


def compute(output: Path, only: str) -> None:
    """Run what has no results yet."""
    for name in (name for name in STUDIES if only in name):
        pairsim("study", CONFIGS / "accuracy" / f"{name}.yaml", "-o", output / name)
    for scene in (scene for scene in SCENES if only in f"plain-{scene}"):
        if not (path := output / f"plain-{scene}.json").is_file():
            write_text(path, json.dumps(plain(STUDIES[f"run-{scene}"])))
    if only in "moving":
        pairsim("sweep", CONFIGS / "accuracy" / "moving" / "runs.yaml", "-o", output / "moving")


def plain(study: dict[str, Any]) -> list[float]:
    """Wall time per Newton iteration with a new matrix [s], in PLAIN_COUNTED steps of the paper's discretisation."""
    import pairsim.runtime.fenicsx  # noqa: F401 - orders MPI ahead of everything compiled
    from pairsim.computing.problems import problem_of
    from pairsim.solvers.nonlinear.jacobian_lagging import MatrixPolicy
    from pairsim.solvers.transient.transient import Transient

    paper = next(row for row in study["discretisations"] if "time.fixed_step" in row)
    end = PLAIN_STEPS * paper["time.fixed_step"]
    settings = paper | {"time.end": end}
    problem = problem_of(api.load(study["base"], kind="run", **settings))
    every = MatrixPolicy(slow=0.0, other_step=-1.0, far=0.0)
    transient = Transient(replace(problem, newton=replace(problem.newton, matrix=every)))
    seconds, begin = [], time.perf_counter()
    for step in transient.steps(iter([end])):
        now = time.perf_counter()
        seconds.append((now - begin) / step.report.iterations)
        begin = now
    transient.close()
    return seconds[-PLAIN_COUNTED:]


def all_rows(output: Path) -> pd.DataFrame:
    """The rows of all studies that have results, with keys of their scenes and what tells meshes apart.

    `equal`: arcs or cells across the tube are equal where `accuracy` grades them; `adapted`: the accuracy is kept by
    adaptation; `graded`: neither.
    """
    found = [pd.DataFrame(columns=["study", "scene", "beta", "De", "reference", *TEXT, *NUMBERS])]
    for name, study in STUDIES.items():
        if (path := output / name / "study.csv").is_file():
            scene = {key: study["base"][key] for key in ("beta", "De", "Ca_e")}
            label = ", ".join(map(str, scene.values()))
            found.append(pd.read_csv(path, dtype=TEXT).assign(study=name, scene=label, **scene))
    table = pd.concat(found, ignore_index=True).astype(dict.fromkeys(NUMBERS, float))
    equal, adapted = (table[["mesh.grading", "mesh.row_grading"]] == 1).any(axis=1), ~table["accuracy"].isin(SETTINGS)
    return table.assign(equal=equal, adapted=adapted, graded=~equal & ~adapted, reference=table["reference"].eq(True))


def number(value: float, digits: int = 2) -> str:
    """A number with so many digits, as an integer from 100 on; empty for NaN."""
    return "" if math.isnan(value) else f"{value:.0f}" if value >= 100 else f"{value:.{digits}g}"


def percent(value: float) -> str:
    """A part in percent."""
    return number(100 * value)


def curves(table: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """Errors of all master curves on all graded meshes but the finest, and their times."""
    for kind, of_kind in (("newtonian", table["De"] == 0), ("viscoelastic", table["De"] > 0)):
        here = table[of_kind & table["graded"] & table["study"].str.startswith("curve-")].copy()
        if here.empty:
            continue
        here["mesh"] = here["mesh.Np"] + ", " + here["mesh.max_size"]
        here["cell"] = here["relative_error"].map(percent).where(~here["reference"], "reference")
        cells = here.pivot_table(index="scene", columns="mesh", values="cell", aggfunc="first", sort=False)
        by_mesh = here[here["wall_time"].notna()].groupby("mesh")
        cells.loc["mean s"] = by_mesh["wall_time"].mean().map("{:.1f}".format)
        cells.index.name = "beta, De, Ca_e"
        order = sorted(cells.columns, key=lambda mesh: (int(mesh.split(", ")[0]), -float(mesh.split(", ")[1])))[:-1]
        yield f"curves-{kind}", cells[order].fillna("").reset_index()


def settings(table: pd.DataFrame) -> pd.DataFrame:
    """Cells of runs by `accuracy`, with the largest error of a curve on them that was measured and the mean time."""
    lines, curves = [], table[table["study"].str.startswith("curve-") & table["graded"] & table["wall_time"].notna()]
    for name, chosen in SETTINGS.items():
        line, cells = {"`accuracy`": f"`{name}`"}, chosen.in_time
        for kind, own, of_kind in (
            ("Newtonian", cells["newtonian"], curves["De"] == 0),
            ("viscoelastic", cells["thinning"], curves["De"] > 0),
        ):
            same = curves["beta"].map(lambda beta, own=own: f"{own.largest(beta):g}") == curves["mesh.max_size"]
            here = curves[of_kind & same & (curves["mesh.Np"] == str(own.Np))]
            worst = percent(here.loc[~here["reference"], "relative_error"].max()) or "reference"
            line[kind] = size(own)
            line[f"{kind}: worst curve, % (mean s)"] = f"{worst} ({here['wall_time'].mean():.0f})" if len(here) else ""
        lines.append(line | {"hardening": size(cells["hardening"]), "`time.tol`": f"{chosen.time_tol:g}"})
    return pd.DataFrame(lines)


def size(cells: Cells) -> str:
    """Np, max_size with its bound, and rows of a mesh, as text."""
    bound = f" ({cells.per_beta:g} beta)" if cells.per_beta < math.inf else ""
    return f"{cells.Np}, {cells.max_size:g}{bound}, {cells.rows:g}"


def promises(table: pd.DataFrame) -> pd.DataFrame:
    """What `accuracy: X%` reached, beside the fewest unknowns of fixed cells for the same error.

    Single points are left out: the errors of their studies are parts of their own dU, not of the largest |dU|.
    """
    table = table[~table["study"].str.startswith("point-") & ~table["reference"]]
    table = table[table["error"].notna() & table["time.fixed_step"].isna()]
    lines = []
    for _, row in table[table["adapted"]].iterrows():
        line = {"study": row["study"], "wanted": row["accuracy"], "error, %": percent(row["relative_error"])}
        line["unknowns, s"] = f"{row['unknowns']:.0f}, {number(row['wall_time'], 3)}"
        for kind in ("graded", "equal"):
            fixed = table[table[kind] & ~table["adapted"] & (table["study"] == row["study"])]
            good = fixed[fixed["error"] <= row["error"]].nsmallest(1, "unknowns")
            found = [f"{unknowns:.0f}, {number(s, 3)}" for unknowns, s in good[["unknowns", "wall_time"]].to_numpy()]
            line[f"{kind} cells: unknowns, s"] = found[0] if found else "none" if len(fixed) else ""
        lines.append(line)
    return pd.DataFrame(lines)


def scenes(table: pd.DataFrame, output: Path) -> pd.DataFrame:
    """Cost relative to the discretisation of the paper, and the picture of error against wall time."""
    plain_steps = {scene: output / f"plain-{scene}.json" for scene in SCENES}
    needed = {f"{kind}-{scene}" for kind in ("run", "point") for scene in SCENES}
    if not needed <= set(table["study"]) or not all(path.is_file() for path in plain_steps.values()):
        return pd.DataFrame()
    figure, axes = pyplot.subplots(2, 2, figsize=(10, 7.5))
    lines = []
    for (scene, title), axis in zip(SCENES.items(), axes.flat, strict=True):
        run, point = (table[table["study"] == f"{kind}-{scene}"] for kind in ("run", "point"))
        paper = run[run["time.fixed_step"].notna()].iloc[0]
        own, point = run[run["time.fixed_step"].isna() & (run["error"] > 0)], point[point["error"] > 0]
        # Both errors are relative to the largest |dU| of the transient, since dU at d_0 may be much smaller.
        largest = (own["error"] / own["relative_error"]).iloc[0]
        own, point = (each.assign(part=each["error"] / largest) for each in (own, point))
        steps = json.loads(plain_steps[scene].read_text())
        whole, error = (np.median(steps) * paper["steps"], paper["wall_time"]), paper["relative_error"]
        draw(axis, title, own, point, whole, error)
        line = {"scene": title, "unknowns": f"{paper['unknowns']:.0f}", "steps": f"{paper['steps']:.0f}"}
        line["iterations, factorisations"] = f"{paper['newton_iterations']:.0f}, {paper['factorisations']:.0f}"
        line["s, factorisation reused"] = f"{paper['wall_time']:.0f}"
        each = f"{np.median(steps):.2f} ({max(steps) - min(steps):.2f})"
        line |= {"one factorisation per step: s each (spread), s in all": f"{each}, {whole[0]:.0f}"}
        line |= {"error, %": percent(error), "our transient": beside(own, error, whole)}
        lines.append(line | {"our point": beside(point, error, whole)})
    handles = axes.flat[0].get_legend_handles_labels()
    figure.legend(*handles, loc="lower center", ncol=3, frameon=False, fontsize="small")
    figure.tight_layout(rect=(0, 0.06, 1, 1))
    figure.savefig(PICTURE, dpi=110)
    return pd.DataFrame(lines)


def draw(
    axis: Any, title: str, run: pd.DataFrame, point: pd.DataFrame, whole: tuple[float, float], error: float
) -> None:
    """Error against wall time of a scene."""
    for table, look, label in ((run, "oC0", "transient"), (point, "sC1", "quasi-steady point")):
        for adapted, fill in ((False, look[1:]), (True, "none")):
            part = table[(table["adapted"] == adapted) & ~table["equal"]]
            name = f"{label}, accuracy: X%" if adapted else label
            axis.loglog(part["wall_time"], 100 * part["part"], look, markerfacecolor=fill, linestyle="none", label=name)
    for marker, seconds, label in zip("*P", whole, ("one factorisation per step", "factorisation reused"), strict=True):
        axis.loglog([seconds], [100 * error], marker, markersize=10, label=f"discretisation of the paper, {label}")
    axis.set(title=title, xlabel="wall time [s]", ylabel="error of $\\Delta U$ [% of its largest]")


def beside(table: pd.DataFrame, error: float, whole: tuple[float, float]) -> str:
    """The fastest row whose error is no larger, or else the most accurate one, with its cost relative to `whole`."""
    good = table[table["part"] <= error]
    row = (good.nsmallest(1, "wall_time") if len(good) else table.nsmallest(1, "part")).iloc[0]
    parts = ", ".join(f"1/{seconds / row['wall_time']:.0f}" for seconds in whole)
    return f"{number(row['wall_time'], 3)} s, {percent(row['part'])} %: {parts}"


def moving(output: Path) -> pd.DataFrame:
    """dU of curves at the distances that runs have reached, where the pair moves and where it is held."""
    lines = []
    for run in Cases(output, []).of("moving"):
        keys = {key: run.parameters[key] for key in ("beta", "De", "Ca_e")}
        same = keys | {"ends": "developed", "length": "auto", "mesh": {"Np": 28}, "tol": 1}
        d, dU, error = (run.last(name) for name in ("d", "dU", "dU_error"))
        table = api.curve(same, d=sorted({d, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5})).check().table
        point = table.iloc[int((table["d"] - d).abs().argmin())]
        peak = table.loc[table["d"] >= min(d, 0.05), "dU"].abs().max()
        line = {key: f"{value:g}" for key, value in keys.items()} | {"d_0": f"{run.parameters['d0']:g}"}
        line |= {"t": f"{run.last('t'):g}", "d": f"{d:.4f}", "t_relax": f"{point['t_relax']:.2g}"}
        line |= {"dU of the run": f"{dU:.4e}", "its dU_error": f"{error:.1e}", "dU": f"{point['dU']:.4e}"}
        line |= {"dU_error": f"{point['dU_error']:.1e}", "dU_held": f"{point['dU_held']:.4e}"}
        line["run less dU_held, % of the peak"] = f"{100 * (dU - point['dU_held']) / peak:.2f}"
        line["run less dU, % of the peak"] = f"{100 * (dU - point['dU']) / peak:.2f}"
        lines.append(line | {"run less dU, in dU_error": f"{(dU - point['dU']) / point['dU_error']:.1f}"})
    return pd.DataFrame(lines)


def blocks() -> dict[str, str]:
    """What stands between the marks of the page, from the stored tables; not all that is stored is shown."""
    stored = pages.stored("accuracy")
    both = (pages.markdown(stored[f"curves-{kind}"]) for kind in ("newtonian", "viscoelastic"))
    codes, met = stored["codes"], stored["promises"]
    codes["what, tol"] = codes["what"].where(codes["tol"] == "0", codes["what"] + ", " + codes["tol"])
    codes["cell"] = codes["seconds"] + ", " + codes["error, %"]
    met["cell"] = met["error, %"] + ": " + met["unknowns, s"] + " (" + met["graded cells: unknowns, s"] + ")"
    shown = {name: stored[name] for name in ("settings", "scenes")}
    shown["codes"] = codes.pivot(index=["what, tol", "cells"], columns="code", values="cell").fillna("").reset_index()
    by_study = met.pivot(index="study", columns="wanted", values="cell").iloc[:, ::-1]
    shown["promises"] = by_study.fillna("").reset_index()
    text = {"made": pages.prose(stored["made"]["made"].iloc[0]), "curves": "\n".join(both)}
    return text | {name: pages.markdown(table) for name, table in shown.items()}


def main() -> int:
    """Compute, store, and write the page."""
    parser = parser_of("accuracy", __doc__, "runs/accuracy")
    parser.add_argument("--only", default="", metavar="WORD", help="only studies whose name contains WORD; no page")
    parser.add_argument("--hard", type=Path, help="output folder of scripts/hard")
    parser.add_argument("--page", action="store_true", help="write the page from what is stored")
    arguments = parser.parse_args()
    output: Path = arguments.output
    output.mkdir(parents=True, exist_ok=True)
    if not (arguments.table or arguments.page):
        compute(output, arguments.only)
        if arguments.only:
            return 0
    if not arguments.page:
        times, table = [path.stat().st_mtime for path in output.glob("*/study.csv")], all_rows(output)
        found = {"made": pd.DataFrame({"made": [made(times)]})} if times else {}
        if len(table):
            found |= dict(curves(table)) | {"settings": settings(table), "promises": promises(table)}
        found |= {"scenes": scenes(table, output), "moving": moving(output)}
        if arguments.hard:
            found["hard"] = pd.read_csv(arguments.hard / "hard.csv", dtype=str, keep_default_na=False)
        pages.save("accuracy", found)
    pages.write(PAGE, blocks())
    return 0


if __name__ == "__main__":
    sys.exit(main())
