"""Which column of a table holds the error of dU: bands, verdicts and summaries read it here."""

from __future__ import annotations

from collections.abc import Mapping

from pairsim.runtime.arrays import Array

ESTIMATES = ("dU_error", "mesh_error")
"""Columns with an estimate of the error of dU, the best first."""


def error_of_dU(table: Mapping[str, Array], gap: str = "") -> Array | None:
    """The half-width of the error interval of dU at every row.

    Args:
        table: Columns by name.
        gap: What the names of the columns of the gap end with: "" for a pair, "_1" and so on.

    Returns:
        Errors in U_av, shape (n,); None where the table has no estimate.
    """
    return next((table[name + gap] for name in ESTIMATES if name + gap in table), None)
