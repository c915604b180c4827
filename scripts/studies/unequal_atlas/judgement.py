"""Which dU of unequal pairs are inside the half-widths of the atlases that ship."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
from book import comparison, pages
from book.half_widths import mostly_inside
from book.statements import Judged
from book.study import Part

from pairsim.atlas import atlas as shipped
from pairsim.atlas.atlas import Atlas
from pairsim.lab.atlas_curve import curve_of_atlas
from studies.unequal_atlas.cases import DIAMETERS, MODULI

FILES = {"giesekus": "equal-pairs", "newtonian": "newtonian"}
WIDEST = 2.0  # largest median of half-widths, % of the peak
PAIR = ["beta_T", "beta_L", "De", "Ca_e_T", "Ca_e_L"]
EDGE = 1e-3  # relative difference from an end of the ratios, below which a pair is at it


@cache
def atlas_of(liquid: str) -> Atlas:
    """The atlas that ships for a liquid of the study."""
    return Atlas.load(Path(shipped.__file__).with_name(f"{FILES[liquid]}.npz"))


def judged(results: pd.DataFrame) -> pd.DataFrame:
    """All points beside what the atlas says of them.

    Further columns are the value of the atlas, its half-width, the error, and `own`, the half-width of the curve, these
    in per cent of the largest |dU| of the pair in the atlas; and whether the pair is at a corner of the ratios.
    """
    found = []
    for _, points in results[results["ended"].isna()].groupby("part", sort=False):
        beta_T, beta_L, De, Ca_e_T, Ca_e_L = map(float, points.iloc[0][PAIR])
        atlas = atlas_of(str(points["liquid"].iloc[0]))
        curve = curve_of_atlas(atlas, beta=(beta_T, beta_L), De=De, Ca_e=(Ca_e_T, Ca_e_L))
        value, half_width = curve.numbers(points["d"].to_numpy())
        size = 100 / np.abs(curve.peak.dU)
        at_ends = [_at_end(beta_L / beta_T, DIAMETERS), _at_end(Ca_e_T / Ca_e_L, MODULI)]
        found.append(
            points.assign(
                value=value,
                half_width=size * half_width,
                error=size * (value - points["dU"]).abs(),
                own=size * points["dU_error"],
                certain=np.abs(value) > half_width,
                corner=all(at_ends),
            )
        )
    return pd.concat(found, ignore_index=True)


def _at_end(ratio: float, ends: Sequence[float]) -> bool:
    return bool(min(abs(ratio / end - 1) for end in ends) < EDGE)


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """What the study states, judged by what is stored."""
    table, unanswered = judged(results), results[results["ended"].notna()]
    inside = table["error"] <= table["half_width"]
    certain = table[table["certain"]]
    right = (certain["value"] * certain["dU"] > 0) | (certain["dU"].abs() <= certain["dU_error"])
    median = float(table["half_width"].median())
    return {
        **mostly_inside(inside, "dU", "the half-widths of the atlas"),
        f"the median half-width is below {WIDEST:g} % of the largest |dU| of the pair": Judged(
            ((WIDEST - median, 0.0),), f"{median:.2g} %"
        ),
        "all signs that are held for certain are right": Judged(
            ((0.5 - float((~right).sum()), 0.0),), f"{right.sum()} of {len(certain)}"
        ),
        "every pair has an answer": Judged(
            ((0.5 - len(unanswered), 0.0),), ", ".join([f"{len(unanswered)} without", *unanswered["part"]])
        ),
        "all curves are computed": Judged(
            ((results["part"].nunique() - len(parts) + 0.5, 0.0),), f"{results['part'].nunique()} of {len(parts)}"
        ),
    }


def summary(name: str, table: pd.DataFrame) -> dict[str, str]:
    """How good the atlas is at some points."""
    both = table["error"] <= table["half_width"] + table["own"]
    return {
        "pairs": name,
        "curves": str(table["part"].nunique()),
        "points": str(len(table)),
        "inside": f"{100 * (table['error'] <= table['half_width']).mean():.1f} %",
        "by both half-widths": f"{100 * both.mean():.1f} %",
        "error: median, 95 %": f"{table['error'].median():.2g}, {table['error'].quantile(0.95):.2g}",
        "half-width: median, 90 %": f"{table['half_width'].median():.2g}, {table['half_width'].quantile(0.9):.2g}",
        "of the curves": f"{table['own'].median():.2g}",
    }


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[str, str]:
    """What stands between the marks of the page."""
    table = judged(results)
    groups = {
        "Newtonian": table[table["liquid"] == "newtonian"],
        "Giesekus": table[table["liquid"] == "giesekus"],
        "both ratios at their ends": table[table["corner"]],
        "the others": table[~table["corner"]],
        "d below 0.1": table[table["d"] < 0.1],
        "all": table,
    }
    made = f"{results['part'].nunique()} of {len(parts)} curves, computed until {results['computed'].max()}."
    off = table[table["error"] > table["half_width"]].sort_values("error", ascending=False)
    text = pd.DataFrame(
        {
            "pair": off["part"],
            "d": off["d"].map("{:g}".format),
            "dU": off["dU"].map("{:.5f}".format),
            **{name: off[name].map("{:.2g}".format) for name in ("error", "half_width", "own")},
        }
    )
    return {
        "made": pages.prose(made),
        "statements": comparison.stated(statements(results, parts)),
        "summary": pages.markdown(pd.DataFrame([summary(*each) for each in groups.items() if len(each[1])])),
        "outside": pages.markdown(text) if len(text) else pages.prose("None."),
    }
