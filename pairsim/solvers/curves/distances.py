"""The distances of a curve. Without numpy, whose import would delay the estimate of what a case costs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

# Ratio of neighbouring distances above which nothing is said about what lies between them; measured: with 2.0, curves
# over a factor of 25 to 40 took a quarter more time, as all intervals were halved.
WIDEST = 1.8


def between(places: Sequence[tuple[float, ...]], max_points: int) -> list[tuple[float, ...]]:
    """Distances of a curve, with others added where neighbours are more than a factor `WIDEST` apart.

    Args:
        places: Distances of each point, of which all or one vary along the curve, ascending or descending.
        max_points: Largest number of points, unless there are more places.
    """
    filled, room = list(places[:1]), max(max_points - len(places), 0)
    for a, b in pairwise(places):
        ratios = [y / x for x, y in zip(a, b, strict=True)]
        parts = math.ceil(max(abs(math.log(ratio)) for ratio in ratios) / math.log(WIDEST) - 1e-9)
        inner = [tuple(x * r ** (i / parts) for x, r in zip(a, ratios, strict=True)) for i in range(1, parts)][:room]
        room -= len(inner)
        filled += [*inner, b]
    return filled
