"""Judge an atlas by points that it was not made of: python tests/support/judge_atlas.py [ATLAS.npz [POINTS.csv]].

`fresh_points.py` computes such points; docs/validation has those by which the atlases that ship were judged.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd

from pairsim.analysis.master_curve import Curve
from pairsim.atlas import atlas as shipped
from pairsim.atlas.atlas import PARAMETERS, Atlas

POINTS = Path(__file__).parents[2] / "docs" / "validation" / "atlas.csv"
ATLAS = Path(shipped.__file__).with_name("equal-pairs.npz")


def judge(file: Path = ATLAS, points: Path = POINTS) -> pd.DataFrame:
    """A row for each point: errors and half-widths in per cent of the largest |dU| of its curve, by the atlas.

    Args:
        file: The atlas.
        points: Points of its box, with columns beta, De, Ca_e, d, dU and dU_error. Those with dU = 0 are zeros, of
            which error and half-width are in per cent of d. `own` is the half-width of the point itself.
    """
    atlas, rows = Atlas.load(file), []
    for place, held in pd.read_csv(points).groupby(list(PARAMETERS)):
        found = Curve.of_atlas(atlas, **dict(zip(PARAMETERS, place, strict=True)))
        curve, zeros, peak = found.of(), found.equilibria, np.abs(found.table["dU"]).max()
        for d, dU, own in zip(held["d"], held["dU"], held["dU_error"], strict=True):
            value, half_width = float(curve.values(d)), float(curve.half_widths(d))
            row = {**dict(zip(PARAMETERS, place, strict=True)), "d": d, "zero": dU == 0}
            row |= {"certain": abs(value) > half_width, "right": value * dU > 0}
            if dU == 0 and len(zeros["d"]):
                at = np.abs(np.log(zeros["d"] / d)).argmin()
                row |= {"error": 100 * (zeros["d"][at] / d - 1), "half_width": 100 * zeros["d_error"][at] / d}
            elif dU != 0:
                row |= {
                    "error": 100 * (value - dU) / peak,
                    "half_width": 100 * half_width / peak,
                    "own": 100 * own / peak,
                }
            rows.append(row)
    return pd.DataFrame(rows)


if __name__ == "__main__":
    found = judge(*map(Path, sys.argv[1:]))
    known = found["zero"] & (found["half_width"] < 20)
    for name, part in (("dU", found[~found["zero"]]), ("zeros that are known to 20 %", found[known])):
        if part.empty:
            continue
        error, half_width, curves = part["error"].abs(), part["half_width"], len(part.groupby(list(PARAMETERS)))
        print(f"{name}: {len(part)} of {curves} curves, {100 * (error <= half_width).mean():.1f} % inside")
        if "own" in part and part["own"].notna().all():
            both = error <= half_width + part["own"]
            own = part["own"].median()
            print(f"  by both half-widths {100 * both.mean():.1f} %; those of the points: median {own:.2g}")
        print(
            f"  errors [%]: median {error.median():.2g}, 95 % below {error.quantile(0.95):.2g}, worst {error.max():.2g}"
        )
        print(f"  half-widths: median {half_width.median():.2g}, 90 % below {half_width.quantile(0.9):.2g}")
    part = found[~found["zero"] & found["certain"]]
    print(f"zeros that are not: {(found['zero'] & ~known).sum()}")
    print(f"signs held for certain: {len(part)}, right: {part['right'].sum()}")
