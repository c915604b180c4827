"""Error against processor time of pairsim, of an earlier pairsim, and of pyoomph: a part for each mesh.

The scene is that of pyoomph_pair.py: a point at d .1, and a run from rest to t = 1. Each row is the median of three
processes, the codes taking turns; seconds are the processor's, without loading of libraries and compilers. Those of
pairsim contain meshes and scenes; pyoomph makes its mesh and its equations before it solves, which is kept apart. With
the medians goes their spread: half of what the longest process took more than the shortest one, over the median.
Errors are relative to pairsim at N_p 80. README.md says how pyoomph and the earlier version are installed; where they
are not, the meshes are left out that they have, too.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import pandas as pd
from book.computing import ROOT
from book.kept import Kept
from book.other_codes import PYOOMPH, by_pyoomph, installed
from book.study import Part, Row, Unavailable
from book.uses import in_time, steady

import pairsim

USES = tuple(dict.fromkeys((*steady("newtonian", "neo_hookean"), *in_time("newtonian", "neo_hookean"))))
KEPT = Kept(USES, 2400.0)
SCENE: dict[str, Any] = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": "auto"}
OWN, EARLIER, PEER = "pairsim", "pairsim 0.1", "pyoomph"
RUNS = {20: (1e-3,), 28: (1e-3,), 40: (3e-4,), 56: (1e-4,)}
CALL = """
import json, sys, time, pairsim
case, tol, coarse = json.loads(sys.argv[1])
def solve(case):
    return pairsim.run(case | {"d0": 0.1, "time": {"end": 1.0, "tol": tol}}) if tol else pairsim.curve(case)
pairsim.curve(coarse)  # loads libraries and forms
begin = time.process_time()
table = solve(case).table
dU = float(table["dU_held" if "dU_held" in table else "dU"].iloc[-1])  # of a point at held distance, as pyoomph's
print(json.dumps([dU, time.process_time() - begin]))
"""


@dataclass(frozen=True)
class Code:
    """A code that is measured.

    Attributes:
        name: Its name.
        variable: The variable of the environment that says where it is, with the place where it is looked for else.
        cells: Cells on a half-circle of its meshes.
        tolerances: Of time steps by mesh, where runs are made.
        solve: dU of that code at a place, for cells and a tolerance, 0 for a point; with processor seconds, and those
            of a set-up that is no part of them.
    """

    name: str
    variable: tuple[str, Path]
    cells: Sequence[int]
    tolerances: Mapping[int, Sequence[float]]
    solve: Callable[[Path, int, float], tuple[float, float, float]]

    @property
    def place(self) -> Path:
        """Where it is.

        Raises:
            Unavailable: It is not there.
        """
        return installed(self.name, self.variable)


def _pairsim(sources: Path, cells: int, tol: float) -> tuple[float, float, float]:
    """dU and processor seconds of a version of pairsim, set-up included."""
    case = {**SCENE, "mesh": {"Np": cells}} | ({} if tol else {"d": [0.1]})
    coarse = SCENE | {"d": [0.3], "mesh": {"Np": 8}}
    environment = os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": str(sources)}
    command = [sys.executable, "-P", "-W", "ignore", "-c", CALL, json.dumps([case, tol, coarse])]
    done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    dU, seconds = json.loads(done.stdout.splitlines()[-1])
    return dU, seconds, 0.0


def _pyoomph(python: Path, cells: int, tol: float) -> tuple[float, float, float]:
    """dU, processor seconds of the solution and of the set-up of pyoomph."""
    what = ["--tol", tol] if tol else ["--no-transient"]
    row = by_pyoomph("pyoomph_pair.py", ["--cells", cells, *what], python).iloc[-1]
    return float(row["dU"]), float(row["total"]), float(row["set_up"])


CODES = (
    Code(OWN, ("PAIRSIM_SOURCES", ROOT), (10, 14, 20, 28, 40), RUNS, _pairsim),
    Code(EARLIER, ("PAIRSIM_EARLIER", ROOT / "peer" / "pairsim-0.1"), (20, 28, 40, 56), RUNS, _pairsim),
    Code(PEER, PYOOMPH, (10, 20, 40, 80), {20: (1e-3, 3e-4, 1e-4)}, _pyoomph),
)


def parts(quick: bool) -> list[Part]:
    """All meshes, or one that pairsim has alone, once, beside one with twice the cells."""
    if quick:
        return [_part(10, CODES[:1], 1, 20)]
    cells = sorted({count for code in CODES for count in code.cells})
    return [_part(count, [code for code in CODES if count in code.cells], 3, 80) for count in cells]


def _part(cells: int, codes: Sequence[Code], repeats: int, exact: int) -> Part:
    asked = [(code.name, code.tolerances.get(cells, ())) for code in codes]
    what = {"codes": asked, "repeats": repeats, "exact": exact, "seconds": ["solution", "set-up"]}
    identity = json.dumps({**SCENE, "cells": cells, **what})
    return Part(f"{cells} cells", identity, partial(_rows, cells, codes, repeats, exact))


def _rows(cells: int, codes: Sequence[Code], repeats: int, exact: int, folder: Path) -> list[Row]:
    """Medians of dU and processor seconds, the spread of the latter, and the errors."""
    places = {code.name: code.place for code in codes}
    asked = [(code, tol) for code in codes for tol in (0.0, *code.tolerances.get(cells, ()))]
    rows = []
    for _, (code, tol) in product(range(repeats), asked):
        try:
            dU, seconds, set_up = code.solve(places[code.name], cells, tol)
        except subprocess.CalledProcessError as failed:
            last = str(failed.stderr or "").strip().rpartition("\n")[2]
            raise Unavailable(f"{code.name} ended with exit code {failed.returncode}: {last}") from failed
        what = "run" if tol else "point"
        rows.append({"what": what, "by": code.name, "tol": tol, "seconds": seconds, "set_up": set_up, "dU": dU})
    medians = with_spread(pd.DataFrame(rows))
    truths = dict(_exact(sorted(set(medians["what"])), exact, folder))
    error = (100 * (medians["dU"] / medians["what"].map(truths) - 1)).abs()
    found: Any = medians.assign(cells=cells, error=error).to_dict("records")
    return list(found)


def with_spread(measured: pd.DataFrame) -> pd.DataFrame:
    """The medians of repetitions, with the spread of seconds and set-up together; it is NaN of one repetition."""
    whole = measured.assign(whole=measured["seconds"] + measured["set_up"])
    grouped = whole.groupby(["what", "by", "tol"], as_index=False)
    medians, times = grouped.median(), grouped["whole"]
    spread = (times.max()["whole"] - times.min()["whole"]) / (2 * medians["whole"])
    return medians.drop(columns="whole").assign(spread=spread.where(times.size()["size"] > 1))


def _exact(whats: Sequence[str], cells: int, folder: Path) -> Iterator[tuple[str, float]]:
    """dU of pairsim on fine meshes, of a point and of a run."""
    case = {**SCENE, "mesh": {"Np": cells}}
    for what in whats:
        if what == "point":
            checked = pairsim.load(case | {"d": [0.1]}, kind="curve")
            yield what, float(KEPT.result("curve", checked, folder).table["dU_held"].iloc[-1])
        else:
            checked = pairsim.load(case | {"d0": 0.1, "time": {"end": 1.0, "tol": 2e-5}}, kind="run")
            yield what, float(KEPT.result("run", checked, folder).table["dU"].iloc[-1])
