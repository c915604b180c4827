"""Says which pictures of the documents are stale at the last commit, and makes them.

usage: scripts/pictures [--make] [WORD]

docs/images/pictures.yaml has the commands that make pictures and the files that decide what they show; the state of
these when a picture was made is in docs/images/made.csv. A picture is stale if one of its own files has changed. If
only the numerics have (physics, fem, solvers), it is old: its numbers are the same within their errors. --make makes
those that are stale and whose name contains WORD: seconds for those of configs/quickstart.yaml, hours for those of the
paper.

Exit code 0: none is stale; 1: some are.
"""

from __future__ import annotations

import argparse
import hashlib
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import pandas as pd
import yaml
from book.computing import DOCS, ROOT, pairsim

from pairsim.results.output import write_text

RULES, MADE = DOCS / "images" / "pictures.yaml", DOCS / "images" / "made.csv"
NUMERICS = ("pairsim/physics", "pairsim/fem", "pairsim/solvers")


def state(paths: Sequence[str], commit: str = "HEAD") -> str:
    """What files and folders contain at a commit, but for statements, which draw nothing, as a short hash."""
    words = ["git", "-C", str(ROOT), "ls-tree", "-r", commit, "--", *paths]
    lines = subprocess.run(words, check=True, capture_output=True, text=True).stdout.splitlines()
    return hashlib.sha256("\n".join(each for each in lines if "statements" not in each).encode()).hexdigest()[:12]


def pictures() -> Iterator[tuple[str, str, list[str]]]:
    """Every picture with its command and its files; of several rules the first counts."""
    seen = set()
    for pattern, rule in yaml.safe_load(RULES.read_text()).items():
        for path in sorted(ROOT.glob(pattern)):
            name = str(path.relative_to(ROOT))
            if name not in seen:
                seen.add(name)
                shows = [each.format(stem=path.stem) for each in rule["shows"]]
                yield name, rule["make"].format(stem=path.stem), shows


def judged() -> pd.DataFrame:
    """All pictures with their state now and when they were made, and what follows."""
    made = pd.read_csv(MADE, index_col="picture") if MADE.is_file() else pd.DataFrame(columns=["shows", "numerics"])
    rows = []
    for name, make, shows in pictures():
        now = state(shows), state(NUMERICS)
        then = tuple(made.loc[name, ["shows", "numerics"]]) if name in made.index else ("", "")
        word = "stale" if now[0] != then[0] else "old" if now[1] != then[1] else "made at this commit"
        rows.append({"picture": name, "is": word, "make": make, "shows": now[0], "numerics": now[1], "then": then})
    return pd.DataFrame(rows).set_index("picture")


def make(command: str) -> None:
    """Run a command; for a case file run and draw it, or a tutorial by its test, and take their pictures."""
    program, *words = shlex.split(command)
    with tempfile.TemporaryDirectory() as folder:
        if program.endswith(".md"):
            name = Path(program).stem
            test = f"tests/commands/test_tutorials.py::test_tutorial[{name}]"
            options = ["-q", "-n", "0", f"--basetemp={folder}/out"]
            subprocess.run([sys.executable, "-m", "pytest", test, *options], cwd=ROOT, check=True)
            shutil.copy(next(Path(folder, "out").glob(f"*/{words[0]}")), DOCS / "images" / f"{name}.png")
            return
        if program != "pairsim":
            subprocess.run([str(ROOT / program), *words], cwd=ROOT, check=True)
            return
        for line in (("run", ROOT / words[0], "-o", f"{folder}/out"), ("plot", f"{folder}/out")):
            pairsim(*line)
        for path in Path(folder, "out").glob("*.png"):
            shutil.copy(path, DOCS / "images" / f"{Path(words[0]).stem}-{path.name}")


def main() -> int:
    """List pictures, and make those that are stale."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="pictures", description=__doc__, formatter_class=form)
    parser.add_argument("word", nargs="?", default="", metavar="WORD", help="only pictures whose name contains it")
    parser.add_argument("--make", action="store_true", help="make those that are stale")
    arguments = parser.parse_args()
    found = judged()
    named = found.index.str.contains(arguments.word, regex=False)
    chosen = found[named & (found["is"] == "stale")]
    if arguments.make:
        for command in dict.fromkeys(chosen["make"]):
            make(command)
        found.loc[found["make"].isin(chosen["make"]), "is"] = "made at this commit"
        kept = found["is"] != "made at this commit"
        found.loc[kept, ["shows", "numerics"]] = found.loc[kept, "then"].tolist()
        write_text(MADE, found[["shows", "numerics"]].to_csv())
    for name, row in found.iterrows():
        print(f"{row['is']:20} {name}  ({row['make']})")
    return int((found["is"] == "stale").any())


if __name__ == "__main__":
    sys.exit(main())
