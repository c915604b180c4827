"""The table of a study: what its columns are, and which rows belong together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import takewhile
from typing import Any

import numpy as np
import pandas as pd

TABLE = "study.csv"
FAMILIES = {"space": "mesh.", "time": "time."}
"""Discretisations that differ only in keys with one of these prefixes form a family, for which orders are computed."""


def settings_of(columns: Iterable[Any]) -> list[str]:
    """The columns of study.csv that are keys of the cases."""
    return list(takewhile(lambda name: name != "status", columns))


def families(table: pd.DataFrame, family: str) -> Iterator[pd.DataFrame]:
    """Rows of study.csv that differ in keys of a family only, the coarsest first, with `order`, from row to row.

    Fixed and controlled steps have different errors and are apart.
    """
    counts = table.reindex(columns=["unknowns", "steps"]).astype(float)  # curves have no steps
    h = counts["unknowns"] ** -0.5 if family == "space" else 1 / counts["steps"]
    fixed = table["time.fixed_step"].notna() if "time.fixed_step" in table else False
    sized = table.assign(h=h, fixed=fixed).dropna(subset="h").sort_values("h", ascending=False, kind="stable")
    others = [key for key in settings_of(table) if not key.startswith(FAMILIES[family])]
    for _, group in sized.groupby([str(row) for row in sized[[*others, "fixed"]].to_numpy().tolist()]):
        ratios = group[["error", "h"]].shift() / group[["error", "h"]]
        order = np.log(ratios["error"]) / np.log(ratios["h"])
        yield group.assign(order=order.where(np.isfinite(order)))
