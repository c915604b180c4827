"""Wall time against error: a part for each master curve, for each pair in time, and for each run beside its curve.

The part of a curve solves it in all discretisations of its file. That of a pair in time does so with its run and its
point, and evaluates some steps of the discretisation of the paper (fixed steps of 7.5e-4 on 1e4 triangles) with a new
matrix in every Newton iteration. Times can be compared where parts are computed one after the other.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from book import yaml_files
from book.apart import apart
from book.cases import Case
from book.kept import Kept
from book.study import Part, Row
from book.uses import in_time, solvers, steady

import pairsim
from pairsim.cases.accuracy import SETTINGS
from pairsim.sweeps.grid import SweepCase, read_grid
from pairsim.sweeps.study import read_study, study_table

LAWS = ("newtonian", "giesekus", "neo_hookean")
USES = tuple(dict.fromkeys((*steady(*LAWS), *in_time(*LAWS), *solvers("errors"))))
KEPT = Kept(USES, 7200.0)
CASES = Path(__file__).with_name("cases")
SCENES = ("newtonian", "De1", "De2-rigid", "De1-gap0.02")
"""The pairs in time, each with a file for its run and one for its point."""
PLAIN_STEPS, PLAIN_COUNTED = 20, 5
"""Steps with a new matrix in every iteration, and how many of them, the last ones, are evaluated; chosen."""
BESIDE = (0.02, 0.05, 0.1, 0.2, 0.3, 0.5)
"""Distances of the curve beside a run, with that which the run reaches."""


def parts(quick: bool) -> list[Part]:
    """All parts, or coarse ones of a curve and of a pair in time."""
    folder = CASES / "quick" if quick else CASES
    found = [_part(path.stem, [path], _curve) for path in sorted(folder.glob("curve-*.yaml"))]
    for scene in SCENES[:1] if quick else SCENES:
        found.append(_part(f"scene-{scene}", [folder / f"{kind}-{scene}.yaml" for kind in ("run", "point")], _scene))
    return found if quick else [*found, *_moving()]


def _part(name: str, files: list[Path], rows: Any) -> Part:
    identity = json.dumps([yaml_files.read(path) for path in files], sort_keys=True)
    return Part(name, identity, partial(rows, *files))


def _curve(path: Path, folder: Path) -> list[Row]:
    """The rows of a curve."""
    return list(_rows("curve", path.stem, compared(path, folder)))


def _scene(run: Path, point: Path, folder: Path) -> list[Row]:
    """The rows of a run and of a point, whose errors are parts of the largest |dU| of the run, and of plain steps."""
    of_run, of_point = compared(run, folder), compared(point, folder)
    largest = (of_run["error"] / of_run["relative_error"]).dropna().iloc[0]
    of_point["relative_error"] = of_point["error"] / largest
    paper = of_run[of_run["time.fixed_step"].notna()].iloc[0]
    steps = apart(plain, yaml_files.read(run))
    row: Row = {"kind": "plain", "study": run.stem, "step_seconds": float(np.median(steps))}
    row = {**row, "spread": max(steps) - min(steps), "seconds": float(np.median(steps)) * paper["steps"]}
    return [*_rows("run", run.stem, of_run), *_rows("point", point.stem, of_point), row]


def compared(path: Path, folder: Path) -> pd.DataFrame:
    """The table of `pairsim study` of a file, with the keys of its discretisations."""
    file, grid = read_study(path)
    cases = folder / path.stem
    cases.mkdir(parents=True)
    for each in grid.cases:
        result = KEPT.result(grid.question.name, each.case, folder)
        (cases / each.folder).symlink_to(Path(result.folder).resolve())
    table = study_table(file, grid, cases)
    wanted = ["mesh.Np", "mesh.max_size", "accuracy", "time.fixed_step"]
    return table.assign(**{name: np.nan for name in wanted if name not in table})


def _rows(kind: str, study: str, table: pd.DataFrame) -> Iterator[Row]:
    """The rows of the discretisations of a study, with what tells their cells apart.

    `adapted`: the accuracy is kept by adaptation; `paper`: the steps are fixed; `graded`: neither. Beside adapted cells
    are the graded ones of the fewest unknowns that are as good; `inf` where none of the study are.
    """
    adapted = table["accuracy"].notna() & ~table["accuracy"].isin([*SETTINGS])
    conditions = [table["time.fixed_step"].notna(), adapted]
    table = table.assign(cells=np.select(conditions, ["paper", "adapted"], "graded"))
    for row in table.to_dict("records"):
        found: dict[str, Any] = {
            "kind": kind,
            "study": study,
            "cells": row["cells"],
            "Np": row["mesh.Np"],
            "max_size": row["mesh.max_size"],
            "wanted": row["accuracy"] if row["cells"] == "adapted" else None,
            "percent": 100 * row["relative_error"],
            "reference": bool(row["reference"]),
            "unknowns": row["unknowns"],
            "seconds": row["wall_time"],
            "steps": row.get("steps"),
            "iterations": row.get("newton_iterations"),
            "factorisations": row.get("factorisations"),
        }
        if row["cells"] == "adapted":
            found |= _as_good(table[(table["cells"] == "graded") & ~table["reference"]], row["error"])
        yield found


def _as_good(table: pd.DataFrame, error: float) -> dict[str, float]:
    """Unknowns and seconds of the fewest unknowns with no larger error; `inf` without."""
    good = table[table["error"] <= error].nsmallest(1, "unknowns")[["unknowns", "wall_time"]]
    unknowns, seconds = good.iloc[0] if len(good) else (math.inf, math.inf)
    return {"graded_unknowns": unknowns, "graded_seconds": seconds}


def plain(study: Mapping[str, Any]) -> list[float]:
    """Wall time per Newton iteration with a new matrix [s], in `PLAIN_COUNTED` steps of the paper's discretisation."""
    import pairsim.runtime.fenicsx  # orders MPI ahead of everything compiled
    from pairsim.computing.problems import problem_of
    from pairsim.solvers.nonlinear.jacobian_lagging import MatrixPolicy
    from pairsim.solvers.transient.transient import Transient

    paper = next(row for row in study["discretisations"] if "time.fixed_step" in row)
    end = PLAIN_STEPS * paper["time.fixed_step"]
    problem = problem_of(pairsim.load(study["base"], kind="run", **(paper | {"time.end": end})))
    every = MatrixPolicy(slow=0.0, other_step=-1.0, far=0.0)
    transient = Transient(replace(problem, newton=replace(problem.newton, matrix=every)))
    seconds, begin = [], time.perf_counter()
    for step in transient.steps(iter([end])):
        now = time.perf_counter()
        seconds.append((now - begin) / step.report.iterations)
        begin = now
    transient.close()
    return seconds[-PLAIN_COUNTED:]


@cache
def runs() -> dict[str, SweepCase]:
    """The runs beside which curves are judged, by the names of their parts."""
    cases = read_grid(CASES / "moving" / "runs.yaml").cases
    return {f"moving-{number:02d}": case for number, case in enumerate(cases, 1)}


def _moving() -> Iterator[Part]:
    for name, case in runs().items():
        yield Part(name, f"run {case.key} beside {BESIDE}", partial(_beside, case))


def _beside(case: SweepCase, folder: Path) -> list[Row]:
    """dU of a run where it ends, and that of the curve there, where the pair moves and where it is held."""
    result = KEPT.result("run", case.case, folder)
    run = Case(result)
    keys = {key: run.parameters[key] for key in ("beta", "De", "Ca_e")}
    d, dU, error = (run.last(name) for name in ("d", "dU", "dU_error"))
    same = keys | {"ends": "developed", "length": "auto", "mesh": {"Np": 28}, "tol": 1, "d": sorted({d, *BESIDE})}
    table = KEPT.result("curve", pairsim.load(same, kind="curve"), folder).table
    point = table.iloc[int((table["d"] - d).abs().argmin())]
    peak = table.loc[table["d"] >= min(d, 0.05), "dU"].abs().max()
    row: Row = {"kind": "moving", **keys, "d_0": run.parameters["d0"], "t": run.last("t"), "d": d}
    row = {**row, "dU of the run": dU, "its dU_error": error}
    row = {**row, **{name: float(point[name]) for name in ("t_relax", "dU", "dU_error", "dU_held")}}
    held, moves = (100 * (dU - float(point[name])) / peak for name in ("dU_held", "dU"))
    return [{**row, "run less dU_held, % of the peak": held, "run less dU, % of the peak": moves}]
