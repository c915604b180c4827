"""Errors and half-widths of the atlases that ship where they are judged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import nan
from typing import Any

import numpy as np
import pandas as pd
from book import comparison, pages
from book.case_parts import complete
from book.half_widths import mostly_inside
from book.statements import Judged
from book.study import Part
from scipy.interpolate import CubicSpline

from pairsim.atlas.atlas import PARAMETERS, Atlas
from pairsim.lab.atlas_curve import curve_of_atlas
from studies.atlas.cases import atlas_of

KNOWN = 20.0  # half-width of a zero that is known, % of d
BY_DIFFERENCE = 2.0  # allowed error of derivatives by the difference of the diameters, % of the largest of their curve


def judge(atlas: Atlas, points: pd.DataFrame) -> pd.DataFrame:
    """A row for each point: errors and half-widths in per cent of the largest |dU| of its curve, by the atlas.

    Args:
        atlas: The atlas.
        points: Points of its box, with columns beta, De, Ca_e, d and dU. Those with dU = 0 are zeros, of which error
            and half-width are in per cent of d.
    """
    rows = []
    for place, held in points.groupby(list(PARAMETERS)):
        here: dict[str, Any] = dict(zip(PARAMETERS, place, strict=True))
        found = curve_of_atlas(atlas, **here)
        curve, peak = found.of(), np.abs(found.table["dU"]).max()
        for d, dU in zip(held["d"], held["dU"], strict=True):
            value, half_width = float(curve.values(d)), float(curve.half_widths(d))
            row = {**here, "d": d, "zero": dU == 0, "error": nan, "half_width": nan}
            row |= {"certain": abs(value) > half_width, "right": value * dU > 0}
            if dU == 0 and len((zeros := found.equilibria)["d"]):
                at = np.abs(np.log(zeros["d"] / d)).argmin()
                row |= {"error": 100 * (zeros["d"][at] / d - 1), "half_width": 100 * zeros["d_error"][at] / d}
            elif dU != 0:
                row |= {"error": 100 * (value - dU) / peak, "half_width": 100 * half_width / peak}
            rows.append(row)
    return pd.DataFrame(rows)


def samples(results: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Judged points by what they are, zeros of curves apart."""
    found = {}
    points = results[results["kind"].isin(["curve", "place"]) & results["ended"].isna()]
    names = {"curve": "dU of curves at twelve distances", "box": "random places"}
    names |= {"corner": "random places with beta above 0.42, De below 0.1, Ca_e above 0.06"}
    for (atlas, kind), own in points.groupby(["atlas", points["region"].fillna("curve")], sort=False):
        table = judge(atlas_of(str(atlas)), own)
        label = "Newtonian" if atlas == "newtonian" else "Giesekus"
        found[f"{label}: {names[str(kind)]}"] = table[~table["zero"]]
        zeros = table[table["zero"] & (table["half_width"] < KNOWN)]
        if len(zeros):
            found[f"{label}: critical distances that are known to {KNOWN:g} %"] = zeros
    return found


def differences(results: pd.DataFrame) -> pd.DataFrame:
    """Derivatives by the difference of the diameters: the largest error of each curve, % of its largest derivative."""
    rows = []
    place: Any
    for place, own in results[results["kind"] == "difference"].groupby(["atlas", *PARAMETERS]):
        atlas = atlas_of(str(place[0]))
        changes = atlas.changes_by_difference([place[1:]])
        if changes is None or own["ended"].notna().any():
            continue
        known = CubicSpline(np.log(atlas.d), changes[0])(np.log(own["d"]))
        largest = own["by_difference"].abs().max()
        error = 100 * float(np.abs(known - own["by_difference"]).max() / largest)
        rows.append(
            {"atlas": place[0], **dict(zip(PARAMETERS, place[1:], strict=True)), "largest": largest, "error": error}
        )
    return pd.DataFrame(rows)


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """That points are inside their half-widths, that signs are right, and that derivatives are close."""
    return _statements(samples(results), differences(results)) | complete(results, parts)


def _statements(tables: Mapping[str, pd.DataFrame], derivatives: pd.DataFrame) -> dict[str, Judged]:
    found: dict[str, Judged] = {}
    for name, table in tables.items():
        inside = mostly_inside(table["error"].abs() <= table["half_width"], "points")
        found |= {f"{name}: {text}": judged for text, judged in inside.items()}
    certain = pd.concat([table[table["certain"] & ~table["zero"]] for table in tables.values()])
    wrong = int((~certain["right"].astype(bool)).sum())
    text = "every sign that is held for certain is right"
    found[text] = Judged(((0.5 - wrong, 0.0),), f"{wrong} of {len(certain)} are not")
    if len(derivatives):
        margins = tuple((BY_DIFFERENCE - error, 0.0) for error in derivatives["error"].tolist())
        text = (
            f"derivatives by the difference of the diameters are within {BY_DIFFERENCE:g} % of the largest of a curve"
        )
        found[text] = Judged(margins, f"largest error {derivatives['error'].max():.2g} %, {len(derivatives)} curves")
    return found


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """How many points are inside, errors and half-widths, and the derivatives."""
    lines, tables = [], samples(results)
    for name, table in tables.items():
        error, half_width = table["error"].abs(), table["half_width"]
        lines.append(
            {
                "judged by": name,
                "points": str(len(table)),
                "inside": f"{100 * (error <= half_width).mean():.1f} %",
                "error: median, 95 %": f"{error.median():.2g}, {error.quantile(0.95):.2g}",
                "half-width: median, 90 %": f"{half_width.median():.2g}, {half_width.quantile(0.9):.2g}",
            }
        )
    table = differences(results)
    shown = table.map(lambda each: f"{each:.3g}" if isinstance(each, float) else str(each)) if len(table) else table
    names = {"largest": "largest derivative", "error": "largest error, % of it"}
    return {
        "inside": pages.markdown(pd.DataFrame(lines)),
        "statements": comparison.stated(_statements(tables, table) | complete(results, parts)),
        "differences": pages.markdown(shown.rename(columns=names)) if len(table) else pages.prose("None is computed."),
    }
