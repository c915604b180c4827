"""The table of a study: its columns, and the families to which its rows belong."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import takewhile
from typing import Any

import numpy as np
import pandas as pd

from pairsim.record import run_entries
from pairsim.record.column import Columns
from pairsim.record.columns import HOW_IT_STANDS, OF_CASES, STEPS, UNKNOWNS, WALL_TIME, WHY, of_cases

TABLE = "study.csv"
NEWTON_ITERATIONS, FACTORISATIONS = (
    of_cases(entry.name, entry.meaning, whole=True)
    for entry in (run_entries.NEWTON_ITERATIONS, run_entries.FACTORISATIONS)
)
COUNTS = (UNKNOWNS, STEPS, NEWTON_ITERATIONS, FACTORISATIONS)
MEASURED = (HOW_IT_STANDS, WHY, *COUNTS, WALL_TIME)
"""Columns from the records of the cases; those of the compared values follow."""
COMPARED = of_cases("*@*", "the compared column at each entry of `at`, such as dU@0.5; without `at`, its last value")
ERROR = of_cases("error", "largest difference from the reference, over all entries of `at`")
RELATIVE_ERROR = of_cases("relative_error", "error relative to the largest value of the reference")
REFERENCE = of_cases("reference", "whether this row is the reference")
ORDERS = {
    "space": of_cases(
        "order_space", "observed order in space: of the error in unknowns^-1/2, from the next coarser mesh"
    ),
    "time": of_cases("order_time", "observed order in time: of the error in 1/steps, from the next larger steps"),
}
STUDY_COLUMNS = Columns(
    *(OF_CASES, NEWTON_ITERATIONS, FACTORISATIONS, COMPARED, ERROR, RELATIVE_ERROR, REFERENCE, ORDERS.values())
)
"""The columns of study.csv, beside the keys that vary; `*` stands for a variable part of the name."""
FIXED_STEP = "time.fixed_step"  # the key of a run with equal time steps
FAMILIES = {"space": "mesh.", "time": "time."}
"""Discretisations that differ only in keys with one of these prefixes form a family, for which orders are computed."""


def settings_of(columns: Iterable[Any]) -> list[str]:
    """The columns of study.csv that are keys of the cases."""
    return list(takewhile(lambda name: name != HOW_IT_STANDS.name, columns))


def families(table: pd.DataFrame, family: str) -> Iterator[pd.DataFrame]:
    """Yield the groups of rows of study.csv that differ only in keys of a family ("space" or "time").

    In each group the coarsest discretisation comes first, and the column `order` has the observed order of convergence
    from the row before. Runs with fixed and with controlled time steps are in different groups.
    """
    counts = table.reindex(columns=[UNKNOWNS.name, STEPS.name]).astype(float)  # curves have no steps
    h = counts[UNKNOWNS.name] ** -0.5 if family == "space" else 1 / counts[STEPS.name]
    fixed = table[FIXED_STEP].notna() if FIXED_STEP in table else False
    sized = table.assign(h=h, fixed=fixed).dropna(subset="h").sort_values("h", ascending=False, kind="stable")
    others = [key for key in settings_of(table) if not key.startswith(FAMILIES[family])]
    for _, group in sized.groupby([str(row) for row in sized[[*others, "fixed"]].to_numpy().tolist()]):
        both = group[[ERROR.name, "h"]]
        ratios = np.log(both.shift() / both)
        order = ratios[ERROR.name] / ratios["h"]
        yield group.assign(order=order.where(np.isfinite(order)))
