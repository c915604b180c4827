"""Says which pictures of the documents are stale at the last commit, and makes them.

usage: scripts/pictures [--make] [WORD]

docs/images/pictures.yaml has the commands that make pictures and the files that decide what they show; the state of
these when a picture was made is in docs/images/made.csv. A picture is stale if one of its own files has changed. If
only the numerics have (physics, fem, solvers), it is old: its numbers are the same within their errors. --make makes
those that are stale and whose name contains WORD, which takes seconds for those of configs/quickstart.yaml, and hours
for those of the paper.

Exit code 0: none is stale; 1: some are.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from book import yaml_files
from book.computing import DOCS, ROOT

from pairsim.record.folder import write_text

RULES, MADE = DOCS / "images" / "pictures.yaml", DOCS / "images" / "made.csv"
NUMERICS = ("pairsim/physics", "pairsim/fem", "pairsim/solvers")


def state(paths: Sequence[str], commit: str = "HEAD") -> str:
    """A short hash of the content of files and folders at a commit, without that of statements, which draw nothing."""
    words = ["git", "-C", str(ROOT), "ls-tree", "-r", commit, "--", *paths]
    lines = subprocess.run(words, check=True, capture_output=True, text=True).stdout.splitlines()
    return hashlib.sha256("\n".join(each for each in lines if "statements" not in each).encode()).hexdigest()[:12]


def pictures() -> Iterator[tuple[str, str, str]]:
    """Every picture with its command and the state of its files, once for each rule that matches it."""
    for pattern, rule in yaml_files.read(RULES).items():
        for path in sorted(ROOT.glob(pattern)):
            shows = [each.format(stem=path.stem) for each in rule["shows"]]
            yield str(path.relative_to(ROOT)), rule["make"].replace("{stem}", path.stem), state(shows)


def judged() -> pd.DataFrame:
    """All pictures with their state now and when they were made, and the verdict; the first rule counts."""
    found = pd.DataFrame(pictures(), columns=["picture", "make", "shows"]).drop_duplicates("picture")
    found = found.assign(numerics=state(NUMERICS)).set_index("picture")
    found = found.join(pd.read_csv(MADE, index_col="picture", dtype=str).add_suffix("_then"))
    conditions = [found["shows"] != found["shows_then"], found["numerics"] != found["numerics_then"]]
    return found.assign(verdict=np.select(conditions, ["stale", "old"], "made at this commit"))


def make(command: str, names: Sequence[str]) -> None:
    """Run the command of some pictures in a shell, in which `python` and `pairsim` are those of this Python.

    Raises:
        SystemExit: The command has failed, or has left one of them as it was.
    """
    before = {name: (ROOT / name).stat().st_mtime_ns for name in names}
    with tempfile.TemporaryDirectory() as folder:
        path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
        environment = os.environ | {"FOLDER": folder, "PATH": path, "OMP_NUM_THREADS": "1"}
        code = subprocess.run(command, shell=True, cwd=ROOT, env=environment, check=False).returncode
    left = [name for name, time in before.items() if (ROOT / name).stat().st_mtime_ns == time]
    if code or left:
        raise SystemExit(f"exit code {code}, {', '.join(left) or 'no picture'} not made: {command}")


def main() -> int:
    """List pictures, and make those that are stale."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="pictures", description=__doc__, formatter_class=form)
    parser.add_argument("word", nargs="?", default="", metavar="WORD", help="only pictures whose name contains it")
    parser.add_argument("--make", action="store_true", help="make those that are stale")
    arguments = parser.parse_args()
    found = judged()
    chosen = found[found.index.str.contains(arguments.word, regex=False) & (found["verdict"] == "stale")]
    if arguments.make:
        for command, own in chosen.groupby("make", sort=False):
            make(str(command), list(own.index))
        fresh = found["make"].isin(chosen["make"])
        found.loc[fresh, "verdict"] = "made at this commit"
        found.loc[fresh, ["shows_then", "numerics_then"]] = found.loc[fresh, ["shows", "numerics"]].to_numpy()
        made = found[["shows_then", "numerics_then"]].set_axis(["shows", "numerics"], axis=1)
        write_text(MADE, made.to_csv())
    for name, row in found.iterrows():
        print(f"{row['verdict']:20} {name}  ({row['make']})")
    return int((found["verdict"] == "stale").any())


if __name__ == "__main__":
    sys.exit(main())
