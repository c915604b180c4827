"""Measures error against processor time of pyoomph, pairsim, and an earlier pairsim, in alternation.

usage: python scripts/peers/codes.py --pyoomph peer/bin/python [--earlier SOURCES] | --draw

The scene is that of pyoomph_pair.py: a point at d .1, and a run from rest to t = 1. Every row is the median of three
processes, the codes taking turns; seconds are the processor's, without set-up and loading of libraries. SOURCES is a
folder with the sources of another version of pairsim (`git archive`). Errors are relative to pairsim at Np 80. The
picture docs/images/codes.png is drawn from the table; --draw does only that.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from itertools import product
from pathlib import Path

import pandas as pd
from matplotlib import pyplot
from matplotlib.ticker import NullFormatter

ROOT, REPEATS = Path(__file__).resolve().parents[2], 3
CELLS = {"pyoomph": (20, 40, 80), "pairsim": (10, 14, 20, 28, 40), "pairsim 0.1": (20, 28, 40, 56)}
OWN_RUNS = {20: (1e-3,), 28: (1e-3,), 40: (3e-4,), 56: (1e-4,)}
TOLERANCES = {"pyoomph": {20: (1e-3, 3e-4, 1e-4)}, "pairsim": OWN_RUNS, "pairsim 0.1": OWN_RUNS}
EXACT_CELLS, EXACT_TOLERANCE = 80, 2e-5
TABLE, PICTURE = ROOT / "docs/results/accuracy/codes.csv", ROOT / "docs/images/codes.png"
OWN = """
import json, sys, time, pairsim
case = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": "auto", "mesh": {"Np": %d}}
tol = %g
def solve():
    if tol:
        return pairsim.run(case | {"d0": 0.1, "time": {"end": 1.0, "tol": tol}})
    return pairsim.curve(case | {"d": [0.1]})
pairsim.curve(case | {"d": [0.3], "mesh": {"Np": 8}})  # loads libraries and forms
begin = time.process_time()
table = solve().table
dU = float(table["dU_held" if "dU_held" in table else "dU"].iloc[-1])  # of a point at held distance, as pyoomph's
print(json.dumps([dU, time.process_time() - begin]))
"""


def own(sources: Path, cells: int, tol: float) -> tuple[float, float]:
    """dU and processor seconds of a version of pairsim; a point if `tol` is 0."""
    env = os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": str(sources)}
    command = [sys.executable, "-P", "-W", "ignore", "-c", OWN % (cells, tol)]
    dU, seconds = json.loads(subprocess.run(command, env=env, check=True, capture_output=True).stdout.splitlines()[-1])
    return dU, seconds


def pyoomph(python: Path, cells: int, tol: float) -> tuple[float, float]:
    """The same of pyoomph."""
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "pair.csv"
        what = ["--tol", str(tol)] if tol else ["--no-transient"]
        pair = Path(__file__).with_name("pyoomph_pair.py")
        command = [python, pair, "--cells", cells, *what, "--output", table]
        subprocess.run([*map(str, command)], check=True, capture_output=True, cwd=folder)
        row = pd.read_csv(table).iloc[-1]
    return float(row["dU"]), float(row["total"])


def measured(codes: dict[str, tuple[Callable[[Path, int, float], tuple[float, float]], Path]]) -> pd.DataFrame:
    """dU, processor seconds and error of every code, mesh and tolerance."""
    exact = {"point": own(ROOT, EXACT_CELLS, 0.0)[0], "run": own(ROOT, EXACT_CELLS, EXACT_TOLERANCE)[0]}
    rows = []
    for _, cells in product(range(REPEATS), sorted({c for each in CELLS.values() for c in each})):
        for name in (name for name in codes if cells in CELLS[name]):
            for tol in (0.0, *TOLERANCES[name].get(cells, ())):
                solve, where = codes[name]
                dU, seconds = solve(where, cells, tol)
                what = "run" if tol else "point"
                rows.append({"code": name, "what": what, "cells": cells, "tol": tol, "seconds": seconds, "dU": dU})
                print(rows[-1], flush=True)
    table = pd.DataFrame(rows).groupby(["what", "code", "cells", "tol"], as_index=False).median()
    table["error, %"] = (100 * (table["dU"] / table["what"].map(exact) - 1).abs()).map("{:.2g}".format)
    table["seconds"], table["dU"] = table["seconds"].map("{:.3g}".format), table["dU"].map("{:.6g}".format)
    return table.assign(tol=table["tol"].map("{:g}".format))


def draw(table: pd.DataFrame) -> None:
    """Error against time of points and runs."""
    figure, axes = pyplot.subplots(1, 2, figsize=(10, 3.75))
    for axis, (what, title) in zip(axes, (("point", "Quasi-steady point"), ("run", "Run to t = 1")), strict=True):
        for marker, (code, rows) in zip("os^", table[table["what"] == what].groupby("code"), strict=False):
            axis.loglog(rows["seconds"], rows["error, %"], marker, label=code)
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.set(title=title, xlabel="processor time [s]", ylabel="error of $\\Delta U$ [%]")
    axes[0].legend(frameon=False)
    figure.tight_layout()
    figure.savefig(PICTURE, dpi=110)


def main() -> None:
    """Measure, write the table, and draw it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pyoomph", type=Path, help="Python with pyoomph")
    parser.add_argument("--earlier", type=Path, help="sources of an earlier pairsim")
    parser.add_argument("--draw", action="store_true", help="draw what is stored")
    options = parser.parse_args()
    if not options.draw:
        codes = {"pyoomph": (pyoomph, options.pyoomph), "pairsim": (own, ROOT), "pairsim 0.1": (own, options.earlier)}
        measured({name: code for name, code in codes.items() if code[1]}).to_csv(TABLE, index=False)
    draw(pd.read_csv(TABLE))


if __name__ == "__main__":
    main()
