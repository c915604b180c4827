"""Cases at the edge of what works, each a part; four files of `cases`.

run.yaml, curve.yaml and yielding.yaml are cases at the edge, random.yaml has points of curves drawn at random.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from book.study import Part, Row, solved

from pairsim.record.column import suffixes_in
from pairsim.record.columns import DISTANCE
from pairsim.sweeps.grid import Grid, SweepCase, read_grid

CASES = Path(__file__).with_name("cases")
FILES = ("run", "curve", "random", "yielding")
QUICK = {
    "run-Cae0.3-beta0.6": ("mesh.Np=10", "time.end=0.3"),
    "curve-Cae0.2-beta0.6": ("mesh.Np=10",),
    "random-14-newtonian": ("accuracy=5%",),
    "yielding-rigid-Bn1-d0.05": (),
}
"""Cases of the quick form, with what it replaces in them."""
LIMIT = 600.0  # wall time of a case [s]
WORST = {
    "c_max": ("largest tr c", "max"),
    "c_min": ("least eigenvalue of c", "min"),
    "s_jump": ("change of s in a cell", "max"),
    "volume_error": ("volume error", "max"),
    "distortion": ("distortion", "min"),
}
"""Columns of tables with indicators: their titles, and which value is the worst."""


@cache
def grid(file: str, settings: Sequence[str] = ()) -> Grid:
    """The cases of a file."""
    return read_grid(CASES / f"{file}.yaml", settings)


def name_of(case: SweepCase) -> str:
    """The name that a case has in its file."""
    return case.folder.rpartition("-")[0]


def parts(quick: bool) -> list[Part]:
    """All cases, or a few with coarse cells."""
    if not quick:
        return [_part(file, grid(file), case) for file in FILES for case in grid(file).cases]
    found = [(name.partition("-")[0], name, settings) for name, settings in QUICK.items()]
    grids = [(file, name, grid(file, settings)) for file, name, settings in found]
    return [_part(file, own, case) for file, name, own in grids for case in own.cases if name_of(case) == name]


def _part(file: str, own: Grid, case: SweepCase) -> Part:
    return Part(name_of(case), f"{own.question.name} {case.key}", partial(_rows, file, own.question.name, case))


def _rows(file: str, question: str, case: SweepCase, folder: Path) -> list[Row]:
    """How a case ended, and its worst indicators."""
    return [{"file": file, **row_of(solved(question, case.case, folder, LIMIT), case)}]


def row_of(result: Any, case: SweepCase) -> Row:
    """The row of a result."""
    table = result.table
    known = table.drop(columns="creep", errors="ignore")  # NaN where it is not asked for
    last = table.iloc[-1:] if "t" in table else table
    found: dict[str, str | float | bool | None] = {"outcome": result.status, "reason": result.reason}
    for name, (title, worst) in WORST.items():
        if name in table:
            found[title] = float(getattr(table[name].abs() if worst == "max" else table[name], worst)())
    gaps = [f"d{gap}" for gap in suffixes_in(last.columns, DISTANCE)]
    finite = bool(np.isfinite(known.select_dtypes("number")).all(axis=None)) if len(table) else None
    return found | {
        "steps or points": len(table),
        "wall s": result.record.wall_time,
        "announced": result.question.estimate(case.case).duration,
        "t": float(last["t"].max()) if "t" in table else None,
        "d": float(last[gaps].min(axis=None)) if gaps and len(table) else None,
        "warnings": "; ".join(re.split("[,:]", warning)[0] for warning in result.warnings) or None,
        "finite": finite,
    }
