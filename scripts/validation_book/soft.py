"""Soft spheres in a Newtonian liquid against the theory of first order in Ca_e."""

from __future__ import annotations

import numpy as np

import pairsim
from validation_book.comparisons import (
    CONFIGS,
    Comparison,
    Found,
    Setting,
    against,
    number,
    reference,
    rows_of,
    text_table,
    verification,
)

PAIR = CONFIGS / "soft-pair.yaml"
PAIRS = ((0.4, 0.1), (0.4, 0.3), (0.2, 0.1))
CAPILLARIES = (1e-3, 5e-4)  # their slopes are extrapolated to 0
SHAPES = (1e-2, 1e-3)


def compute(setting: Setting) -> Found:
    """Slopes of dU by Ca_e at 0, and the shape of a single sphere."""
    rows, lines = [], []
    for beta, d in PAIRS[:1] if setting.quick else PAIRS:
        row, line = slope(beta, d)
        rows.append(row)
        lines.append(line)
    head = ["beta", "d", *(f"dU/Ca_e at {Ca:g}" for Ca in CAPILLARIES), "extrapolated", "exact"]
    return Found(rows if setting.quick else [*rows, *bullet()], {"slopes": text_table(head, lines)})


def slope(beta: float, d: float) -> tuple[Comparison, list[str]]:
    """dU/Ca_e for Ca_e to 0 of a pair, from two small ones."""
    known = reference("soft", f"S beta {beta:g} d {d:g}")
    slopes, errors = [], []
    for Ca in CAPILLARIES:
        (found,) = rows_of(pairsim.curve(PAIR, beta=beta, d=[d], Ca_e=Ca))
        slopes.append(found["dU"] / Ca)
        errors.append(found["dU_error"] / Ca)
    limit = 2 * slopes[1] - slopes[0]
    headline = (beta, d) == PAIRS[0]
    what = f"soft pair, beta {beta:g}, d {d:g}"
    row = against(known, what, "dU/Ca_e", limit, 2e-3, error=max(errors), headline=headline)
    return row, [f"{beta:g}", f"{d:g}", *map(number, slopes), number(limit), number(known.value)]


def bullet() -> list[Comparison]:
    """The Legendre modes of the outline of a single sphere, from runs in time until it is steady."""
    modes = [verification("test_soft").single_sphere_modes(Ca) for Ca in SHAPES]
    small = modes[1]
    rows = []
    for n, allowed in ((3, 3e-3), (5, 3e-2)):
        known = reference("soft", f"f_{n}")
        rows.append(against(known, "single sphere, Ca_e 0.001", f"f_{n}", float(small[n]), allowed, headline=n == 3))
    even = float(np.abs(small[[2, 4]]).max())
    rows.append(Comparison("single sphere, Ca_e 0.001", "largest of f_2, f_4", even, None, 0.0, "symmetry", 0.01))
    return rows
