"""Runs every case of configs/hard and reports how each one ended.

usage: scripts/hard [-o runs/hard] [-n 2] [--case-timeout 600] [--only WORD] [--table]

The files run-*.yaml and the files curve-*.yaml are two sweeps, under mpirun if -n is above 1 and mpirun is found.
After an interruption the same command continues. Writes hard.csv and hard.md into the output folder.

Exit code 0: every case finished or failed for a documented reason, and all numbers are finite; 1: some did not; 2: the
input is invalid.
"""

from __future__ import annotations

import argparse
import csv
import io
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

from markdown_tables import table

from pairsim.config.yaml_file import read_yaml, yaml_text
from pairsim.results.folders import read_record
from pairsim.results.output import plain, write_text
from pairsim.runtime.child_process import module_command
from pairsim.runtime.launcher import find_mpirun
from pairsim.sweeps.ledger import read_sweep

HARD = Path(__file__).resolve().parent.parent / "configs" / "hard"
UNTYPED = ("error", "crashed", "refused", "not_started", "out_of_memory", "case_timeout", "disk_full")
"""Reasons that the sweep assigns to cases that did not report their own end."""
HEAD = {
    "case": "case",
    "outcome": "outcome",
    "reason": "reason",
    "c_max": "largest tr c",
    "c_min": "least eigenvalue of c",
    "s_jump": "change of s in a cell",
    "volume_error": "volume error",
    "distortion": "distortion",
    "count": "steps or points",
    "wall_time": "wall s",
    "t": "t",
    "d": "d",
    "warnings": "warnings",
    "finite": "all finite",
}
WORST = {"c_max": max, "s_jump": max, "c_min": min, "distortion": min}


def sweep(command: str, arguments: argparse.Namespace) -> Path | None:
    """Run or continue the sweep of one command; returns its folder, or None if no case is selected."""
    files = [path for path in sorted(HARD.glob(f"{command}-*.yaml")) if arguments.only in path.stem]
    if not files:
        return None
    grid = arguments.output / f"{command}.yaml"
    folder: Path = arguments.output / command
    if arguments.table:
        return folder
    arguments.output.mkdir(parents=True, exist_ok=True)
    cases = [{"name": path.stem, **read_yaml(path)} for path in files]
    content = {"command": command, "name": f"hard-{command}", "cases": cases}
    write_text(grid, yaml_text(plain(content)))
    mpirun = find_mpirun() if arguments.n > 1 else None
    words = [mpirun, "-n", str(arguments.n)] if mpirun else []
    words += module_command("pairsim", "sweep", str(grid), "-o", str(folder), "--cold")
    code = subprocess.run([*words, "--case-timeout", f"{arguments.case_timeout:g}"], check=False).returncode
    if code not in (0, 3):
        sys.exit(code)
    return folder


def case_rows(folder: Path) -> list[dict[str, Any]]:
    """Rows of the table for the cases of a sweep."""
    rows = []
    for case in read_sweep(folder)["cases"]:
        values = case["values"]
        row = {"case": case["folder"].rpartition("-")[0], "outcome": case["status"], "reason": case["reason"]}
        said = read_record(folder / case["folder"])  # has the wall time also of cases of an earlier sweep
        row |= {"count": values.get("steps", values.get("points")), "wall_time": said.get("wall_time", case["seconds"])}
        row |= health(folder / case["folder"])
        row["warnings"] = "; ".join(w.partition(",")[0].partition(":")[0] for w in said.get("warnings", []))
        rows.append(row)
    return rows


def health(directory: Path) -> dict[str, Any]:
    """Worst indicators over the rows of a case, its last time and smallest distance, and whether all are finite."""
    table = next((path for path in (directory / "series.csv", directory / "curve.csv") if path.is_file()), None)
    if table is None:
        return {"finite": "nothing"}
    with table.open(encoding="utf-8", newline="") as file:
        rows = [{key: float(value) for key, value in row.items() if value} for row in csv.DictReader(file)]
    if not rows:
        return {"finite": "nothing"}
    found: dict[str, Any] = {
        "finite": "yes" if all(map(math.isfinite, (v for r in rows for v in r.values()))) else "NO"
    }
    for name, worst in WORST.items():
        values = [row[name] for row in rows if name in row]
        found[name] = worst(values) if values else None
    found["volume_error"] = max(abs(row["volume_error"]) for row in rows)
    if table.name == "series.csv":
        found["t"] = rows[-1]["t"]
        gaps = [value for key, value in rows[-1].items() if key == "d" or key.removeprefix("d_").isdigit()]
    else:
        gaps = [row.get("d", row.get("d_1", math.nan)) for row in rows]
    found["d"] = min(gaps, default=None)
    return found


def cell(value: Any) -> str:
    """Format a value for the table."""
    return "" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value).replace("|", r"\|")


def main() -> int:
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="hard", description=__doc__, formatter_class=form)
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/hard"))
    parser.add_argument("-n", type=int, default=2, help="processes")
    parser.add_argument("--case-timeout", type=float, default=600.0, help="seconds")
    parser.add_argument(
        "--only", default="", metavar="WORD", help="only cases whose name contains WORD; give another -o"
    )
    parser.add_argument("--table", action="store_true", help="write the tables of existing results without computing")
    arguments = parser.parse_args()
    folders = [sweep(command, arguments) for command in ("run", "curve")]
    rows = [row for folder in folders if folder is not None and folder.is_dir() for row in case_rows(folder)]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(HEAD), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(arguments.output / "hard.csv", text.getvalue())
    lines = [[cell(row.get(name)) for name in HEAD] for row in rows]
    write_text(arguments.output / "hard.md", table(list(HEAD.values()), lines))
    ended = ("finished", "failed", "timeout")
    wrong = [r["case"] for r in rows if r["reason"] in UNTYPED or r["outcome"] not in ended or r.get("finite") == "NO"]
    finished = sum(row["outcome"] == "finished" for row in rows)
    print(f"{len(rows)} cases: {finished} finished, {len(rows) - finished} did not; see {arguments.output / 'hard.md'}")
    if wrong:
        print("failed without a documented reason, or with values that are not finite:", ", ".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
