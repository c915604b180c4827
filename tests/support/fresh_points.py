"""Compute dU at random places of an atlas, each a curve of one distance, to judge it by.

    python tests/support/fresh_points.py equal-pairs 200 points.csv
    python tests/support/fresh_points.py equal-pairs 50 points.csv --De 0 .1 --beta .42 .5 --Ca_e .06 .1 --seed 2

A file that is there is continued: places that it has are not computed again. `judge_atlas.py` reads it.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import pairsim
from pairsim.atlas import atlas as shipped
from pairsim.atlas.atlas import PARAMETERS, Atlas
from pairsim.runtime.arrays import Array

ACCURACY = "0.3%"
COLUMNS = (*PARAMETERS, "d", "dU", "dU_error")


def places(atlas: Atlas, count: int, seed: int, **narrower: tuple[float, float]) -> Array:
    """Random beta, De, Ca_e and d in the box of an atlas, or in a part of it, shape (count, 4).

    All are uniform; d of every other place is uniform in log d, as otherwise half of them had d > 1, where dU is small.
    """
    ends = np.array([narrower.get(name, atlas.box[name]) for name in (*PARAMETERS, "d")], dtype=float)
    x = np.random.default_rng(seed).random((count, 4))
    found = ends[:, 0] + (ends[:, 1] - ends[:, 0]) * x
    found[1::2, 3] = ends[3, 0] * (ends[3, 1] / ends[3, 0]) ** x[1::2, 3]
    return np.array([[float(f"{value:.6g}") for value in row] for row in found])


def compute(atlas: Atlas, where: Array, accuracy: str = ACCURACY) -> Iterator[list[float]]:
    """The values of `COLUMNS` at places, shape (places, 4); one whose computation fails is left out."""
    shared = {"ends", "length", "xi", "liquid", "solid"}
    case = {key: value for key, value in atlas.provenance["case"].items() if key in shared}
    for beta, De, Ca_e, d in where.tolist():
        result = pairsim.curve(case, beta=beta, De=De, Ca_e=Ca_e, d=[d], accuracy=accuracy)
        if result.status == "finished":
            yield [beta, De, Ca_e, d, float(result.columns["dU"][0]), float(result.columns["dU_error"][0])]
        else:
            print(f"failed: {beta}, {De}, {Ca_e}, {d}: {result.message}", flush=True)


def main() -> None:
    """Append the points of a file that are missing."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("atlas", help="name of an atlas that ships, or the file of another one")
    parser.add_argument("count", type=int)
    parser.add_argument("points", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    for name in (*PARAMETERS, "d"):
        parser.add_argument(f"--{name}", type=float, nargs=2)
    given = parser.parse_args()
    file = Path(shipped.__file__).with_name(f"{given.atlas}.npz")
    atlas = Atlas.load(file if file.exists() else Path(given.atlas))
    narrower = {name: getattr(given, name) for name in (*PARAMETERS, "d") if getattr(given, name)}
    wanted = places(atlas, given.count, given.seed, **narrower)
    if not given.points.exists():
        given.points.write_text(",".join(COLUMNS) + "\n")
    with given.points.open(newline="") as file_:
        known = np.array([list(map(float, row))[:4] for row in list(csv.reader(file_))[1:]]).reshape(-1, 4)
    missing = wanted[~(wanted[:, None] == known).all(axis=2).any(axis=1)]
    with given.points.open("a", newline="") as file_:
        for row in compute(atlas, missing):
            csv.writer(file_).writerow([f"{value:.9g}" for value in row])
            file_.flush()


if __name__ == "__main__":
    main()
