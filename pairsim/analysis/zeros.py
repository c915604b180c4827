"""The distances at which dU vanishes, from a table that has them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from pairsim.record.column import Column
from pairsim.record.columns import D_ERROR, DISTANCE, STABLE
from pairsim.record.table import Table


@dataclass(frozen=True)
class Zero:
    """A distance at which dU vanishes, whether it is stable, and its error where it is known.

    Distance and error are numbers [D_c], or quantities of pint.
    """

    d: Any
    stable: bool
    error: Any = None

    @property
    def kind(self) -> str:
        return "stable" if self.stable else "unstable"


def zeros_in(table: Table, distance: Column = DISTANCE) -> list[Zero]:
    """The zeros in a table, whose distances are in the column `distance`; none if the table lacks it."""
    d, stable, errors = table.known(distance), table.known(STABLE), table.known(D_ERROR)
    if d is None or stable is None:
        return []
    half_widths = [float(each) if math.isfinite(each) else None for each in (errors if errors is not None else ())]
    listed = zip(d, stable, half_widths or [None] * len(d), strict=True)
    return [Zero(float(each), bool(kind), error) for each, kind, error in listed]
