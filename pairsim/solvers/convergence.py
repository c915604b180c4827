"""Orders of convergence, extrapolated values, and what is cheapest for its error; numbers in, numbers out."""

from __future__ import annotations

import math
from collections.abc import Sequence

from scipy.optimize import brentq

LEAST_ORDER, MOST_ORDER = 0.1, 10.0


def observed_order(h: tuple[float, float], errors: tuple[float, float]) -> float | None:
    """The p for which errors are proportional to h^p; None where an error is 0 or both h are the same.

    Args:
        h: Sizes of cells or steps, in any unit.
        errors: Their errors, in any unit.
    """
    if h[0] == h[1] or not all(errors):
        return None
    return math.log(abs(errors[0] / errors[1])) / math.log(h[0] / h[1])


def extrapolated(h: Sequence[float], values: Sequence[float]) -> tuple[float, float] | None:
    """Richardson's estimate: the limit and the order p of three values that are limit + constant h^p.

    Args:
        h: Three sizes of cells or steps, the coarsest first; their ratios may differ.
        values: The values.

    Returns:
        The limit and p. None where the values do not approach one another as any p between 0.1 and 10 has it.
    """
    coarse, middle, fine = h
    first, second = values[0] - values[1], values[1] - values[2]
    if not coarse > middle > fine or first * second <= 0:
        return None

    def mismatch(p: float) -> float:
        a, b, c = 1.0, (middle / coarse) ** p, (fine / coarse) ** p
        return (a - b) / (b - c) - first / second

    if mismatch(LEAST_ORDER) * mismatch(MOST_ORDER) > 0:
        return None
    p = float(brentq(mismatch, LEAST_ORDER, MOST_ORDER))
    return values[2] - second / ((middle / fine) ** p - 1), p


def pareto(costs: Sequence[float], errors: Sequence[float]) -> list[int]:
    """Indices of the entries that no other beats in cost without a larger error, the cheapest first."""
    front: list[int] = []
    for i in sorted(range(len(costs)), key=lambda i: (costs[i], errors[i])):
        if not front or errors[i] < errors[front[-1]]:
            front.append(i)
    return front
