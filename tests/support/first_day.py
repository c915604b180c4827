"""What a user does on the first day, in an empty folder: every command of pairsim, coarse and short.

`python first_day.py ROOT` runs the lines in one process, with the code that the interpreter finds; ROOT is the copy of
the project, in place of `{root}`. Every line but those of ENDS succeeds. It imports nothing but what the standard
library and pairsim have.
"""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import sys
from pathlib import Path

COARSE = "--set mesh.Np=8 --set mesh.max_size=0.2"
STUDY = """
command: run
base: {beta: 0.4, De: 0, Ca_e: 0, d0: 0.1, time: {end: 0.01}}
discretisations: [{mesh.Np: 8}, {mesh.Np: 10}]
"""
LINES = (
    *("--version", "init beads", "schema run --json", "doctor"),
    f"run beads.yaml -o run --set time.end=0.02 {COARSE} --set output.times=[0.01]",
    *("status run", "table run -o run.csv", "plot run", "plot run --animate", "report run"),
    "init near --kind curve",
    f"curve near.yaml -o curve --set d=[0.1,0.2] --set tol=1 {COARSE}",
    *("travel curve --from 0.2 --to 0.1", "plot curve -o both --format png,pdf", "mesh beads.yaml -o pair.vtu"),
    *("init one --kind shape", f"shape one.yaml -o shape --set along=null {COARSE}"),
    *("init drop --kind pressure", f"pressure drop.yaml -o pressure --set along=null {COARSE}"),
    "study study.yaml -o study",
    "units --tube 50um --particle 20um --flow 1ul/min --modulus 5kPa --viscosity 1Pa.s -o gel.yaml",
    "ask gel.yaml --at 8um",
    "atlas explore -o page.html",
    "fit {root}/docs/how-to/films/tracks.csv gel.yaml --fps 1000 --pixel 0.65um --particles 3,5",
    "check-law my_laws.py:FeneCR",
    *(f"{name} {{root}}/configs/{name}.yaml --dry-run" for name in ("critical", "focus", "stream", "sweep", "train")),
    "moduli no.rtdc --table no.txt",
)
ENDS = {"fit": (0, 2), "moduli": (2,)}
"""Exit codes of commands that may end otherwise: a fit of a film of other beads, and files that are not there."""


def command_of(line: str) -> str:
    return line.partition(" ")[0]


def run(root: Path) -> int:
    """Run all lines in this process; returns the number of those that fail, whose output is printed."""
    from pairsim.app.command_line import main

    failed = 0
    Path("study.yaml").write_text(STUDY)
    page = (root / "docs/tutorials/own-law.md").read_text()
    laws = re.search(r'^```python title="my_laws.py"\n(.*?)^```$', page, re.DOTALL | re.MULTILINE)
    Path("my_laws.py").write_text(laws[1] if laws else "")
    for line in LINES:
        sys.argv = ["pairsim", *shlex.split(line.format(root=root))]
        said, code = io.StringIO(), 0
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            try:
                main()
            except SystemExit as ended:
                code = int(ended.code or 0)
        if code not in ENDS.get(command_of(line), (0,)):
            failed += 1
            print(f"pairsim {line}: exit code {code}\n{said.getvalue()}")
    return failed


if __name__ == "__main__":
    sys.exit(run(Path(sys.argv[1])))
