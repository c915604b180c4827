"""The zeros of dU in tables of results."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pairsim.results.units import with_error


@dataclass(frozen=True)
class Zero:
    """A distance at which dU vanishes, with its error where it is known, and whether it is stable."""

    d: float
    stable: bool
    error: float | None = None

    def __str__(self) -> str:
        kind = "stable" if self.stable else "unstable"
        return f"{with_error(self.d, self.error)} ({kind})"


def zeros_in(table: Mapping[str, Any], name: str = "d") -> list[Zero]:
    """The zeros in a table, whose distances are in the column `name`."""
    errors = [float(each) if math.isfinite(each) else None for each in table.get("d_error", ())]
    found = table.get(name, ()), table.get("stable", ()), errors or [None] * len(table.get(name, ()))
    return [Zero(float(d), bool(stable), error) for d, stable, error in zip(*found, strict=True)]
