"""Runs every case of configs/hard, and forty scenes at random, and reports how each one ended.

usage: scripts/hard [-o runs/hard] [--workers 2] [--case-timeout 600] [--only WORD] [--table]

The files run-*.yaml, the files curve-*.yaml and the random scenes, single points of curves with default settings, are
three sweeps. After an interruption the same command continues. Writes
hard.csv and hard.md into the output folder; `scripts/accuracy --hard DIR` takes them into docs/results/accuracy.

Exit code 0: every case finished or failed for a documented reason, and all numbers are finite; 1: some did not; 2: the
input is invalid.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from book import pages
from book.computing import CONFIGS, pairsim, parser_of

import pairsim as api
from pairsim.results.output import write_text

SEED, SCENES = 44, 40
LAWS: dict[str, tuple[str, float, float]] = {
    "newtonian": ("", 0, 0),
    "giesekus": ("alpha", 0.02, 0.5),
    "oldroyd-b": ("", 0, 0),
    "fene-p": ("L2", 20, 1000),
    "ptt-linear": ("epsilon", 0.01, 0.5),
    "ptt-exp": ("epsilon", 0.01, 0.5),
}
"""Laws of random scenes, each with its parameter and the range of that."""
UNTYPED = ("error", "crashed", "refused", "not_started", "out_of_memory", "case_timeout", "disk_full")
"""Reasons that the sweep assigns to cases that did not report their own end."""
WORST = {"largest tr c": ("c_max", "max"), "least eigenvalue of c": ("c_min", "min")}
WORST |= {"change of s in a cell": ("s_jump", "max"), "distortion": ("distortion", "min")}
HEAD = ["case", "outcome", "reason", "largest tr c", "least eigenvalue of c", "change of s in a cell", "volume error"]
HEAD += ["distortion", "steps or points", "wall s", "announced s", "t", "d", "warnings", "all finite"]


def random_scenes() -> Iterator[dict[str, Any]]:
    """Single points over the allowed ranges: laws, De, softness, sizes and distances."""
    random = np.random.default_rng(SEED)

    def between(least: float, most: float) -> float:
        return float(f"{least * (most / least) ** random.random():.3g}")

    for number in range(SCENES):
        law = str(random.choice(list(LAWS)))
        parameter, least, most = LAWS[law]
        own = {parameter: between(least, most)} if parameter else {}
        betas = [round(beta, 3) for beta in random.uniform(0.15, 0.75, 2).tolist()]
        scene = {"name": f"random-{number:02}-{law}", "liquid": law, **own}
        scene |= {
            "De": between(0.2, 5) if law != "newtonian" else 0,
            "Ca_e": float(random.choice([0, 1, 1])) * between(0.01, 0.3),
        }
        scene |= {"beta": betas if random.random() < 0.25 else betas[0], "d": [between(0.03, 1)]}
        yield scene | {"ends": "developed", "length": "auto"}


def row_of(case: Any) -> dict[str, Any]:
    """How a case ended, and its worst indicators."""
    table = case.table
    row = {"case": case.folder.name.rpartition("-")[0], "outcome": case.status, "reason": case.reason}
    announced = case.command.estimate(api.load(case.folder / "case.yaml", kind=case.command.name)).seconds
    row |= {"steps or points": len(table), "wall s": case.record.get("wall_time"), "announced s": announced}
    row["all finite"] = "nothing"
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
    files = {kind: sorted((CONFIGS / "hard").glob(f"{kind}-*.yaml")) for kind in ("run", "curve")}
    kinds = {kind: [{"name": path.stem, **yaml.safe_load(path.read_text())} for path in files[kind]] for kind in files}
    for kind, every in (kinds | {"random": list(random_scenes())}).items():
        cases = [case for case in every if arguments.only in case["name"]]
        if cases and not arguments.table:
            output.mkdir(parents=True, exist_ok=True)
            grid = {"command": kind if kind in files else "curve", "name": f"hard-{kind}", "cases": cases}
            write_text(output / f"{kind}.yaml", yaml.safe_dump(grid, sort_keys=False))
            limits = ("--cold", "--case-timeout", arguments.case_timeout, "--workers", arguments.workers)
            pairsim("sweep", output / f"{kind}.yaml", "-o", output / kind, *limits)
        if (output / kind / "sweep.json").is_file():
            rows += [row_of(case) for case in api.open(output / kind).cases]
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
