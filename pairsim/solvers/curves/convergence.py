"""Observed orders of convergence, Richardson extrapolation, and Pareto fronts of cost and error."""

from __future__ import annotations

import math
from collections.abc import Sequence

import scipy

LEAST_ORDER, MOST_ORDER = 0.1, 10.0  # range of orders that are accepted; chosen


def observed_order(h: tuple[float, float], errors: tuple[float, float]) -> float | None:
    """Observed order of convergence p, for errors proportional to h^p.

    Args:
        h: Two sizes of cells or steps, in any unit.
        errors: Errors at these sizes, in any unit.

    Returns:
        The order p, or None if an error is 0 or both sizes are equal.
    """
    if h[0] == h[1] or not all(errors):
        return None
    return math.log(abs(errors[0] / errors[1])) / math.log(h[0] / h[1])


def extrapolated(h: Sequence[float], values: Sequence[float]) -> tuple[float, float] | None:
    """Richardson extrapolation with the order as unknown: fits limit + constant h^p to three values.

    Args:
        h: Three sizes of cells or steps, the largest first; their ratios may differ.
        values: Values at these sizes.

    Returns:
        The limit and the order p, or None if the values are not consistent with any p between 0.1 and 10.
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
    p = float(scipy.optimize.brentq(mismatch, LEAST_ORDER, MOST_ORDER))
    return values[2] - second / ((middle / fine) ** p - 1), p


def pareto(costs: Sequence[float], errors: Sequence[float]) -> list[int]:
    """Indices of the Pareto-optimal entries: no other entry has both a lower cost and a smaller error.

    Args:
        costs: Costs, n values.
        errors: Errors, n values.

    Returns:
        Indices in order of increasing cost.
    """
    front: list[int] = []
    for i in sorted(range(len(costs)), key=lambda i: (costs[i], errors[i])):
        if not front or errors[i] < errors[front[-1]]:
            front.append(i)
    return front
