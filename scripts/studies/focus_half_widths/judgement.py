"""How many quantities are inside their half-widths."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from book import pages
from book.case_parts import complete
from book.half_widths import half_widths_hold
from book.statements import Judged
from book.study import Part


def judged(results: pd.DataFrame) -> pd.DataFrame:
    """The quantities with half-widths and a finer value: their error over the half-width, and what kind they are."""
    known = results[np.isfinite(results["half_width"]) & np.isfinite(results["truth"])]
    kind = known["quantity"].str.replace(r"a_\d\d", "a_ij", regex=True)
    return known.assign(ratio=(known["value"] - known["truth"]).abs() / known["half_width"], kind=kind)


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """How many are inside, and how far away the others are."""
    found = half_widths_hold(judged(results)["ratio"], 0.0, "the quantities")
    return found | complete(results, parts)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """How many are inside by kind, and those that are not."""
    table = judged(results)
    lines = [
        {
            "quantity": str(kind),
            "judged": str(len(rows)),
            "inside": str(int((rows["ratio"] <= 1).sum())),
            "median error over half-width": f"{rows['ratio'].median():.2f}",
            "largest": f"{rows['ratio'].max():.2f}",
        }
        for kind, rows in table.groupby("kind", sort=False)
    ]
    columns = ["scene", "law", "De", "Ca_e", "beta", "particles", "quantity", "value", "half_width", "truth", "ratio"]
    outside = table[table["ratio"] > 1].sort_values("ratio", ascending=False)[columns]
    shown = outside.map(lambda each: f"{each:.3g}" if isinstance(each, float) else str(each))
    names = {"half_width": "half-width", "truth": "finer", "ratio": "error over half-width"}
    return {
        "half-widths": pages.markdown(pd.DataFrame(lines)),
        "outside": pages.markdown(shown.rename(columns=names)) if len(shown) else pages.prose("None."),
    }
