"""Quasi-steady dU of a soft pair at several distances by pyoomph, as a table for docs/validation.

usage: peer/bin/python scripts/studies/codes/pyoomph_curve.py [-o docs/validation/pyoomph.csv]

Runs pyoomph_pair.py for every distance and confinement below on two meshes; README.md beside it says how pyoomph is
installed. Readers of the book do not need it: the table is tracked.
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import sys
import tempfile
from pathlib import Path

SCENES = {0.4: (0.05, 0.1, 0.2, 0.4, 0.8), 0.2: (0.05, 0.1, 0.2, 0.4)}
CA_E = 0.1
CELLS = (40, 80)
KEPT = ("cells", "unknowns", "dU", "D_T", "D_L")


def main() -> None:
    """Solve everywhere and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/validation/pyoomph.csv"))
    output = parser.parse_args().output
    pair, rows = Path(__file__).with_name("pyoomph_pair.py"), []
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "pair.csv"
        for beta, distances in SCENES.items():
            for d in distances:
                scene = ["--beta", str(beta), "--d", str(d), "--Ca_e", str(CA_E)]
                cells = ["--no-transient", "--cells", *map(str, CELLS), "--output", str(table)]
                subprocess.run([sys.executable, str(pair), *scene, *cells], check=True)
                with table.open(newline="") as file:
                    found = list(csv.DictReader(file))
                rows += [{"beta": beta, "d": d, "Ca_e": CA_E} | {key: row[key] for key in KEPT} for row in found]
    with output.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
