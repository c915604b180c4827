"""Rates and limits by the diameter of the bead: the parts of the study."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from book.apart import apart
from book.study import Part, Row

from studies.focus_table.first_order import FINE, limits_of, rates_of

BETAS = tuple(round(0.05 * i, 2) for i in range(2, 15))
WITH_LIMITS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)
"""Diameters between whose limits they are linear."""
QUICK = {"Np": 10, "max_size": 0.15}


def parts(quick: bool) -> list[Part]:
    """All of these; in the quick form the rates of one bead on coarse cells."""
    mesh, betas = (QUICK, (0.4,)) if quick else (FINE, BETAS)
    rates = [
        Part(f"rates {beta:g}", f"rates of beta {beta:g} on {mesh}", partial(_rates, beta, mesh)) for beta in betas
    ]
    if quick:
        return rates
    return [
        *rates,
        *(Part(f"limits {beta:g}", f"limits of beta {beta:g}", partial(_limits, beta)) for beta in WITH_LIMITS),
    ]


def _rates(beta: float, mesh: dict[str, Any], folder: Path) -> Sequence[Row]:
    return [{"kind": "rates", "beta": beta, **apart(rates_of, beta, mesh)}]


def _limits(beta: float, folder: Path) -> Sequence[Row]:
    return [{"kind": "limits", "beta": beta, **apart(limits_of, beta)}]
