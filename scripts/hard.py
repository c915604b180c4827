"""Runs every case of configs/hard and reports how each one ended.

usage: scripts/hard [-o runs/hard] [--workers 2] [--case-timeout 600] [--only WORD] [--table]

run.yaml, curve.yaml and yielding.yaml are cases at the edge of what works, random.yaml are points of curves drawn at
random: four sweeps. After an interruption the same command continues. Writes hard.csv and hard.md into the output
folder; `scripts/accuracy --hard DIR` takes them into docs/results/accuracy.

Exit code 0: every case finished or failed for a documented reason, and all numbers are finite; 1: some did not; 2: the
input is invalid.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from book import pages, yaml_files
from book.computing import CONFIGS, pairsim, parser_of

import pairsim as api
from pairsim.cases.yaml_file import yaml_text
from pairsim.record.column import suffixes_in
from pairsim.record.columns import DISTANCE
from pairsim.record.folder import write_text

UNTYPED = ("error", "crashed", "refused", "not_computed", "out_of_memory", "case_timeout", "write_failed")
"""Reasons that the sweep assigns to cases that did not report their own end."""
WORST = {
    "c_max": ("largest tr c", "max"),
    "c_min": ("least eigenvalue of c", "min"),
    "s_jump": ("change of s in a cell", "max"),
    "volume_error": ("volume error", "max"),
    "distortion": ("distortion", "min"),
}
"""Columns of tables with indicators: their titles, and which value is the worst."""


def row_of(case: Any) -> dict[str, Any]:
    """How a case ended, and its worst indicators."""
    table = case.table
    known = table.drop(columns="creep", errors="ignore")  # nan where it is not asked for
    text = known.to_csv() if len(table) else ""
    last = table.iloc[-1:] if "t" in table else table
    row = {"case": case.folder.name.rpartition("-")[0], "outcome": case.status, "reason": case.reason}
    for name, (title, worst) in WORST.items():
        row[title] = getattr(table[name].abs() if worst == "max" else table[name], worst)() if name in table else None
    return row | {
        "steps or points": len(table),
        "wall s": case.record.get("wall_time"),
        "announced": case.question.estimate(api.load(case.folder / "case.yaml", kind=case.question.name)).duration,
        "t": last["t"].max() if "t" in table else None,
        "d": last[[f"d{gap}" for gap in suffixes_in(last.columns, DISTANCE)]].min(axis=None) if text else None,
        "warnings": "; ".join(re.split("[,:]", warning)[0] for warning in case.warnings),
        "all finite": "NO"
        if not np.isfinite(known.select_dtypes("number")).all(axis=None)
        else "yes"
        if text
        else "nothing",
    }


def main() -> int:
    """Compute, and write the tables."""
    parser = parser_of("hard", __doc__, "runs/hard")
    parser.add_argument("--case-timeout", type=float, default=600.0, help="seconds")
    parser.add_argument("--only", default="", metavar="WORD", help="only cases whose name has it; give another -o")
    arguments = parser.parse_args()
    output: Path = arguments.output
    rows = []
    for name in ("run", "curve", "random", "yielding"):
        grid = yaml_files.read(CONFIGS / "hard" / f"{name}.yaml")
        grid["cases"] = [case for case in grid["cases"] if arguments.only in case["name"]]
        if grid["cases"] and not arguments.table:
            output.mkdir(parents=True, exist_ok=True)
            write_text(output / f"{name}.yaml", yaml_text(grid))
            limits = ("--case-timeout", arguments.case_timeout, "--workers", arguments.workers)
            pairsim("sweep", output / f"{name}.yaml", "-o", output / name, *limits)
        if (output / name / "sweep.json").is_file():
            rows += [row_of(case) for case in api.open(output / name).cases]
    if not rows:
        print(f"{output} has no results of configs/hard yet")
        return 0
    found = pd.DataFrame(rows)
    text = found.map(lambda cell: f"{cell:.3g}" if isinstance(cell, float) else str(cell)).replace(["nan", "None"], "")
    write_text(output / "hard.csv", text.to_csv(index=False))
    write_text(output / "hard.md", pages.markdown(text))
    ended = found["outcome"].isin(["finished", "failed"])
    wrong = found[found["reason"].isin(UNTYPED) | ~ended | (found["all finite"] == "NO")]
    finished = int((found["outcome"] == "finished").sum())
    print(f"{len(found)} cases: {finished} finished, {len(found) - finished} did not; see {output / 'hard.md'}")
    if len(wrong):
        print("failed without a documented reason, or with values that are not finite:", ", ".join(wrong["case"]))
    return int(bool(len(wrong)))


if __name__ == "__main__":
    sys.exit(main())
