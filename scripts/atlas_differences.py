"""Give the curves of the atlases that ship their derivatives by the difference of the diameters.

    .venv/bin/python scripts/atlas_differences.py runs/differences     an hour and a half on one core

Curves with sensitivities are computed at places that span the box, kept in the folder, and interpolated to the places
of all curves. Curves of `pairsim atlas` bring these derivatives themselves: those that ship are older than these.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

import pairsim
from pairsim.atlas.atlas import PARAMETERS, SHIPPED, SMOOTH, Atlas, scaled
from pairsim.atlas.kriging import Kriging

BOX = {"beta": [0.2, 0.5], "De": [0.0, 1.0], "Ca_e": [0.0, 0.1]}
PLACES = [
    *((beta, 0.0, Ca_e) for Ca_e in (0.0, 0.05, 0.1) for beta in (0.2, 0.3, 0.4, 0.5)),
    *((beta, De, 0.0) for De in (1.0, 0.3, 0.1) for beta in (0.4, 0.3, 0.5)),
    *((beta, 1.0, 0.1) for beta in (0.4, 0.3, 0.5)),
    (0.4, 0.3, 0.1),
]
DISTANCES = np.geomspace(0.02, 2.0, 12).round(5).tolist()
COARSE = {"mesh": {"Np": 16}, "tol": 1}  # derivatives are within 1 % of those of finer meshes, and no points are added
NOISE = 1e-3  # of the derivatives, over their scatter; chosen


def curve_at(beta: float, De: float, Ca_e: float, folder: Path) -> pd.DataFrame:
    """The table of a curve with its sensitivities, computed unless it is in its folder."""
    if not (folder / "run.json").exists():
        liquid = {"liquid": {"law": "giesekus", "alpha": 0.2}, "xi": 0.09} if De else {}
        case = {"beta": beta, "De": De, "Ca_e": Ca_e, "d": DISTANCES, **COARSE, **liquid}
        pairsim.curve(case, folder=folder, sensitivities=True).check()
        print(folder, flush=True)
    return pairsim.open(folder).table


def main() -> None:
    """Compute what is not there, and write the atlases anew."""
    folder = Path(sys.argv[1])
    places = np.array(PLACES)
    tables = [curve_at(*place, folder / "-".join(f"{each:g}" for each in place)) for place in PLACES]
    for path in SHIPPED:
        atlas = Atlas.load(path)
        inside = places[:, 1] <= atlas.box["De"][1]
        x = np.log(atlas.d)
        values = np.array([CubicSpline(np.log(table["d"]), table["by_difference"])(x) for table in tables])[inside]
        values = values / places[inside, :1] ** 2
        mean = values.mean(axis=0)
        data = np.full((1 + len(PARAMETERS), *values.shape), np.nan)
        data[0] = values - mean
        errors = np.full(data.shape[:2], NOISE * values.std(axis=0).max())
        smooth = Kriging.of(scaled(BOX, places[inside])[0], data, errors, SMOOTH, ())
        there = atlas.curves.places
        differences = there[:, :1] ** 2 * (smooth(scaled(BOX, there)[0])[0][0] + mean)
        replace(atlas, curves=replace(atlas.curves, differences=differences)).save(path)


if __name__ == "__main__":
    main()
