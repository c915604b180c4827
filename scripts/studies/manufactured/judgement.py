"""Observed orders beside those of the elements and of the time scheme."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from book import comparison
from book.case_parts import complete
from book.comparison import Column, Table
from book.statements import Judged
from book.study import Part

ORDERS = {"space": {"u": 3.0, "p": 2.0, "s": 2.0}, "time": {"u": 3.0, "p": 3.0, "s": 3.0}}
"""Orders of the elements and of the time scheme."""
WITHIN, OF_S_IN_SPACE = 0.1, 0.4
"""Allowed relative differences; the order of s in space falls towards its own: 2.7, 2.5, and 2.3 on 32 cells."""
HEADS = {"space": "cells across the radius", "time": "time steps"}


def tables(results: pd.DataFrame) -> dict[str, Table]:
    """The tables of the page, those that are computed."""
    found = {}
    for kind, orders in ORDERS.items():
        if not len(own := results[results["kind"] == kind]):
            continue
        errors = own.pivot(index="count", columns="field", values="error").rename_axis(HEADS[kind])
        observed = (errors.shift() / errors).apply(np.log2).add_prefix("order of ")
        columns = []
        for field, order in orders.items():
            allowed = OF_S_IN_SPACE if (kind, field) == ("space", "s") else WITHIN
            columns += [
                Column(f"error of {field}", field, shown=".2e"),
                Column(
                    f"order of {field}", to=order, allowed=allowed, source=f"order {order:g}", shown=".2f", plain=True
                ),
            ]
        found[kind] = Table(errors.join(observed), columns)
    return found


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """That all orders are as close as is allowed."""
    return comparison.statements(tables(results)) | complete(results, parts)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """The tables of the page."""
    return comparison.blocks(tables(results))
