"""Runs every case of configs/hard and reports how each one ended.

usage: scripts/hard [-o runs/hard] [--workers 2] [--case-timeout 600] [--only WORD] [--table]

The files run-*.yaml and the files curve-*.yaml are two sweeps. After an interruption the same command continues. Writes
hard.csv and hard.md into the output folder; `scripts/accuracy --hard DIR` takes them into docs/results/accuracy.

Exit code 0: every case finished or failed for a documented reason, and all numbers are finite; 1: some did not; 2: the
input is invalid.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import pandas as pd
import yaml
from book import pages
from book.computing import CONFIGS, pairsim, parser_of

import pairsim as api
from pairsim.results.output import write_text

UNTYPED = ("error", "crashed", "refused", "not_started", "out_of_memory", "case_timeout", "disk_full")
"""Reasons that the sweep assigns to cases that did not report their own end."""
WORST = {"largest tr c": ("c_max", "max"), "least eigenvalue of c": ("c_min", "min")}
WORST |= {"change of s in a cell": ("s_jump", "max"), "distortion": ("distortion", "min")}
HEAD = ["case", "outcome", "reason", "largest tr c", "least eigenvalue of c", "change of s in a cell", "volume error"]
HEAD += ["distortion", "steps or points", "wall s", "t", "d", "warnings", "all finite"]


def row_of(case: Any) -> dict[str, Any]:
    """How a case ended, and its worst indicators."""
    table = case.table
    row = {"case": case.folder.name.rpartition("-")[0], "outcome": case.status, "reason": case.reason}
    row |= {"steps or points": len(table), "wall s": case.record.get("wall_time"), "all finite": "nothing"}
    if len(table):
        row |= {name: getattr(table[key], how)() for name, (key, how) in WORST.items() if key in table}
        row["volume error"] = table["volume_error"].abs().max()
        gaps = [name for name in table if re.fullmatch(r"d(_\d+)?", name)]
        last = table.iloc[-1:] if "t" in table else table
        row |= {"t": last["t"].iloc[0] if "t" in table else None, "d": last[gaps].min(axis=None)}
        text = (case.folder / f"{case.command.tables[0]}.csv").read_text()
        row["all finite"] = "NO" if re.search(r"\b(nan|inf)\b", text) else "yes"
    return row | {"warnings": "; ".join(re.split("[,:]", warning)[0] for warning in case.warnings)}


def main() -> int:
    """Compute, and write the tables."""
    parser = parser_of("hard", __doc__, "runs/hard")
    parser.add_argument("--case-timeout", type=float, default=600.0, help="seconds")
    parser.add_argument("--only", default="", metavar="WORD", help="only cases whose name has it; give another -o")
    arguments = parser.parse_args()
    output: Path = arguments.output
    rows = []
    for command in ("run", "curve"):
        files = [path for path in sorted((CONFIGS / "hard").glob(f"{command}-*.yaml")) if arguments.only in path.stem]
        if files and not arguments.table:
            output.mkdir(parents=True, exist_ok=True)
            cases = [{"name": path.stem, **yaml.safe_load(path.read_text())} for path in files]
            grid = {"command": command, "name": f"hard-{command}", "cases": cases}
            write_text(output / f"{command}.yaml", yaml.safe_dump(grid, sort_keys=False))
            limits = ("--cold", "--case-timeout", arguments.case_timeout, "--workers", arguments.workers)
            pairsim("sweep", output / f"{command}.yaml", "-o", output / command, *limits)
        if (output / command / "sweep.json").is_file():
            rows += [row_of(case) for case in api.open(output / command).cases]
    found = pd.DataFrame(rows).reindex(columns=HEAD)
    text = found.map(lambda cell: f"{cell:.3g}" if isinstance(cell, float) else str(cell)).replace(["nan", "None"], "")
    write_text(output / "hard.csv", text.to_csv(index=False))
    write_text(output / "hard.md", pages.markdown(text))
    ended = found["outcome"].isin(["finished", "failed", "timeout"])
    wrong = found[found["reason"].isin(UNTYPED) | ~ended | (found["all finite"] == "NO")]
    finished = int((found["outcome"] == "finished").sum())
    print(f"{len(found)} cases: {finished} finished, {len(found) - finished} did not; see {output / 'hard.md'}")
    if len(wrong):
        print("failed without a documented reason, or with values that are not finite:", ", ".join(wrong["case"]))
    return int(bool(len(wrong)))


if __name__ == "__main__":
    sys.exit(main())
