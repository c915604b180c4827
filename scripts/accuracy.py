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
import yaml
from book import pages
from book.cases import Cases, first
from book.computing import CONFIGS, DOCS, made, pairsim, parser_of
from matplotlib import pyplot

import pairsim as api
from pairsim.config.accuracy import SETTINGS
from pairsim.results.output import write_text

STUDIES = {path.stem: yaml.safe_load(path.read_text()) for path in sorted((CONFIGS / "accuracy").glob("*.yaml"))}
PAGE, PICTURE = DOCS / "explanation" / "accuracy.md", DOCS / "images" / "accuracy.png"
SCENES = {
    "newtonian": "Newtonian, soft",
    "De1": "De 1, soft",
    "De2-rigid": "De 2, rigid",
    "De1-gap0.02": "De 1, soft, gap .02",
}
# Steps with a new matrix in every iteration, and how many of them, the last ones, are evaluated; chosen.
PLAIN_STEPS, PLAIN_COUNTED = 20, 5
MESH = ["mesh.Np", "mesh.max_size"]
KEYS = dict.fromkeys([*MESH, "accuracy", "time.tol", "ends"], str)


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
    from pairsim.drivers.problems import problem_of
    from pairsim.solvers.nonlinear.renewal import MatrixPolicy
    from pairsim.solvers.transient.transient import Transient

    paper = next(row for row in study["discretisations"] if "time.fixed_step" in row)
    end = PLAIN_STEPS * paper["time.fixed_step"]
    settings = {key: value for key, value in paper.items() if key != "repeat"} | {"time.end": end}
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


def rows(output: Path, study: str) -> pd.DataFrame:
    """The rows of study.csv, empty without it, with what tells them apart.

    `equal`: whether arcs or cells across the tube are equal where `accuracy` grades them; `adapted`: whether the
    accuracy is kept by adaptation; `graded`: neither.
    """
    path = output / study / "study.csv"
    table = pd.read_csv(path, dtype=KEYS) if path.is_file() else pd.DataFrame(columns=[*KEYS, "reference", "error"])
    table = table.reindex(columns=list(dict.fromkeys([*table.columns, *KEYS])))
    grades = table.reindex(columns=["mesh.grading", "mesh.row_grading"]).astype(float)
    table["equal"], table["adapted"] = (grades == 1).any(axis=1), ~table["accuracy"].isin(list(SETTINGS))
    table["graded"] = ~table["equal"] & ~table["adapted"]
    extra = ["time.fixed_step", "wall_time_spread", "relative_error", "wall_time"]
    return table.reindex(columns=list(dict.fromkeys([*table.columns, *extra])))


def short(value: float) -> str:
    """A number with two significant digits, or as an integer from 100 on; empty for NaN."""
    return "" if math.isnan(value) else f"{value:.0f}" if value >= 100 else f"{value:.2g}"


def percent(value: float) -> str:
    """A part in percent."""
    return "" if math.isnan(value) else f"{100 * value:.2g}"


def wall(row: Any, digits: str = ".2g") -> str:
    """The wall time of a row, with its spread where it was repeated."""
    spread = row["wall_time_spread"]
    seconds = (
        f"{row['wall_time']:.0f}" if row["wall_time"] >= 100 and digits == ".2g" else f"{row['wall_time']:{digits}}"
    )
    return seconds + (f" ({spread:.1g})" if spread > 0 else "")


def curve_rows(output: Path, elastic: bool) -> pd.DataFrame:
    """The graded rows of the curves in Newtonian or in viscoelastic liquids, with the names of their scenes."""
    found = []
    for name, study in STUDIES.items():
        place, table = study["base"], rows(output, name)
        if name.startswith("curve-") and (place["De"] > 0) == elastic and len(table):
            scene = f"beta {place['beta']}, De {place['De']}, Ca_e {place['Ca_e']}"
            found.append(table[table["graded"]].assign(study=name, scene=scene, beta=place["beta"]))
    return pd.concat(found) if found else pd.DataFrame()


def curves(output: Path) -> Iterator[tuple[str, pd.DataFrame]]:
    """Errors of all master curves on all meshes but the finest, and their times."""
    for kind in ("newtonian", "viscoelastic"):
        table = curve_rows(output, kind == "viscoelastic")
        if table.empty:
            continue
        keys = table[MESH].drop_duplicates()
        order = sorted(keys.itertuples(index=False), key=lambda mesh: (int(mesh[0]), -float(mesh[1])))[:-1]
        table["mesh"] = table["mesh.Np"] + ", " + table["mesh.max_size"]
        names = [f"{Np}, {size}" for Np, size in order]
        table["cell"] = table["relative_error"].map(percent).where(~table["reference"], "reference")
        cells = table.pivot_table(index="scene", columns="mesh", values="cell", aggfunc="first", sort=False)
        by_mesh = table[table["wall_time"].notna()].groupby("mesh")
        cells.loc["seconds, mean"] = by_mesh["wall_time"].mean().map("{:.1f}".format)
        if (table["wall_time_spread"] > 0).any():
            cells.loc["largest spread of repeated ones"] = by_mesh["wall_time_spread"].max().map("{:.1f}".format)
        cells.index.name = "% of the curve's peak"
        yield f"curves-{kind}", cells.reindex(columns=names).fillna("").reset_index()


def settings(output: Path) -> pd.DataFrame:
    """Settings of each level of `accuracy`, with the largest error that was measured and the mean time."""
    lines = []
    for name, chosen in SETTINGS.items():
        line = {"accuracy": f"`{name}`"}
        for kind, cells in (("newtonian", chosen.in_time.newtonian), ("viscoelastic", chosen.in_time.thinning)):
            table = curve_rows(output, kind == "viscoelastic")
            if len(table):
                same = table["beta"].map(lambda beta, cells=cells: f"{cells.largest(beta):g}") == table["mesh.max_size"]
                table = table[(table["mesh.Np"] == str(cells.Np)) & same & table["wall_time"].notna()]
            worst = table.loc[~table["reference"], "relative_error"].max() if len(table) else math.nan
            measured = "the reference itself" if math.isnan(worst) else percent(worst)
            line[f"Np, max_size and rows of `mesh`, {kind}"] = size(cells)
            text = f"{measured} ({table['wall_time'].mean():.0f} s)" if len(table) else ""
            line[f"worst curve, % (mean time), {kind}"] = text
        hard = {"the same in a liquid that hardens": size(chosen.in_time.hardening)}
        lines.append(line | hard | {"`tol` of `time`": f"{chosen.time_tol:g}"})
    return pd.DataFrame(lines)


def size(cells: Any) -> str:
    """Np, max_size and rows of a mesh, as text."""
    bound = f" (no more than {cells.per_beta:g} beta)" if cells.per_beta < math.inf else ""
    return f"{cells.Np}, {cells.max_size:g}{bound}, {cells.rows:g}"


def promises(output: Path) -> pd.DataFrame:
    """What `accuracy: X%` reached, beside the fewest unknowns of fixed cells for the same error.

    Single points are left out: the errors of their studies are parts of their own dU, not of the largest |dU|.
    """
    lines = []
    for name in (name for name in STUDIES if name.startswith(("curve-", "run-"))):
        table = rows(output, name)
        table = table[(table["reference"] == False) & table["error"].notna() & table["time.fixed_step"].isna()]  # noqa: E712
        for _, row in table[table["adapted"]].iterrows():
            line = {"study": name, "wanted": row["accuracy"], "unknowns": str(int(row["unknowns"]))}
            line |= {"s": f"{row['wall_time']:.3g}", "error, %": percent(row["relative_error"])}
            for title in ("graded", "equal"):
                fixed = table[table[title] & ~table["adapted"]]
                good = fixed[fixed["error"] <= row["error"]].nsmallest(1, "unknowns")
                found = [f"{int(r['unknowns'])}, {r['wall_time']:.3g}" for _, r in good.iterrows()]
                line[f"{title} cells: unknowns, s"] = found[0] if found else "none" if len(fixed) else ""
            lines.append(line)
    return pd.DataFrame(lines)


def scenes(output: Path) -> pd.DataFrame:
    """Cost relative to the discretisation of the paper, and the picture of error against wall time."""
    known = {}
    for scene in SCENES:
        run, point = rows(output, f"run-{scene}"), rows(output, f"point-{scene}")
        if run["time.fixed_step"].notna().any() and len(point) and (output / f"plain-{scene}.json").is_file():
            known[scene] = run, point, json.loads((output / f"plain-{scene}.json").read_text())
    if not known:
        return pd.DataFrame()
    columns = min(len(known), 2)
    size = -(-len(known) // columns)
    figure, axes = pyplot.subplots(size, columns, figsize=(5 * columns, 3.75 * size), squeeze=False)
    lines = []
    for (scene, (run, point, plain_steps)), axis in zip(known.items(), axes.flat, strict=False):
        paper = run[run["time.fixed_step"].notna()].iloc[0]
        own = run[run["time.fixed_step"].isna() & (run["error"] > 0)]
        point = point[point["error"] > 0]
        # Both errors are relative to the largest |dU| of the transient, since dU at d_0 may be much smaller.
        largest = float((own["error"] / own["relative_error"]).iloc[0])
        own, point = own.assign(part=own["error"] / largest), point.assign(part=point["error"] / largest)
        step = float(np.median(plain_steps))
        whole = step * paper["steps"], float(paper["wall_time"])
        draw(axis, SCENES[scene], own, point, whole, float(paper["relative_error"]))
        line = {"scene": SCENES[scene], "unknowns": str(int(paper["unknowns"])), "steps": str(int(paper["steps"]))}
        line["iterations, factorisations"] = f"{int(paper['newton_iterations'])}, {int(paper['factorisations'])}"
        line["s, factorisation reused"] = f"{paper['wall_time']:.0f}"
        spread = max(plain_steps) - min(plain_steps)
        line["one factorisation per step: s each (spread), s in all"] = f"{step:.2f} ({spread:.2f}), {whole[0]:.0f}"
        line["error, %"] = percent(paper["relative_error"])
        line["our transient"] = beside(own, paper["relative_error"], whole)
        lines.append(line | {"our quasi-steady point": beside(point, paper["relative_error"], whole)})
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
    spread = f" (spread {short(row['wall_time_spread'])})" if row["wall_time_spread"] > 0 else ""
    parts = ", ".join(f"1/{seconds / row['wall_time']:.0f}" for seconds in whole)
    return f"{row['wall_time']:.3g} s{spread} at {percent(row['part'])} %: {parts}"


def moving(output: Path) -> pd.DataFrame:
    """dU of curves at the distances that runs have reached, where the pair moves and where it is held."""
    lines = []
    for run in Cases(output, []).of("moving"):
        keys = {key: first(run.parameters[key]) for key in ("beta", "De", "Ca_e")}
        same = keys | {"ends": "developed", "length": "auto", "mesh": {"Np": 28}, "tol": 1}
        d, dU, error = (run.last(name) for name in ("d", "dU", "dU_error"))
        table = api.curve(same, d=sorted({d, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5})).check().table
        point = table.iloc[int((table["d"] - d).abs().argmin())]
        peak = table.loc[table["d"] >= min(d, 0.05), "dU"].abs().max()
        line = {key: f"{value:g}" for key, value in keys.items()} | {"d_0": f"{first(run.parameters['d0']):g}"}
        line |= {"t": f"{run.last('t'):g}", "d": f"{d:.4f}", "t_relax": f"{point['t_relax']:.2g}"}
        line |= {"dU of the run": f"{dU:.4e}", "its dU_error": f"{error:.1e}", "dU": f"{point['dU']:.4e}"}
        line |= {"dU_error": f"{point['dU_error']:.1e}", "dU_held": f"{point['dU_held']:.4e}"}
        line["run less dU_held, % of the peak"] = f"{100 * (dU - point['dU_held']) / peak:.2f}"
        line["run less dU, % of the peak"] = f"{100 * (dU - point['dU']) / peak:.2f}"
        lines.append(line | {"run less dU, in dU_error": f"{(dU - point['dU']) / point['dU_error']:.1f}"})
    return pd.DataFrame(lines)


def blocks() -> dict[str, str]:
    """What stands between the marks of the page, from the stored tables; not all of them are shown."""
    stored = pages.stored("accuracy")
    text = {"made": pages.prose(stored.pop("made")["made"].iloc[0])}
    made = {name: pages.markdown(table) for name, table in stored.items()}
    return text | made | {"curves": made["curves-newtonian"] + "\n" + made["curves-viscoelastic"]}


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
        times = [path.stat().st_mtime for path in output.glob("*/study.csv")]
        found = {"made": pd.DataFrame({"made": [made(times)]})} if times else {}
        found |= dict(curves(output)) | {"settings": settings(output)}
        found |= {each.__name__: each(output) for each in (promises, scenes, moving)}
        if arguments.hard:
            found["hard"] = pd.read_csv(arguments.hard / "hard.csv", dtype=str, keep_default_na=False)
        pages.save("accuracy", found)
    pages.write(PAGE, blocks())
    return 0


if __name__ == "__main__":
    sys.exit(main())
