"""The distances of a curve. This module does not import numpy, which would delay the estimate of a case's cost."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

# Largest ratio of neighbouring distances between which the curve is taken as known. Measured: with 2.0, curves over a
# factor of 25 to 40 in distance took a quarter more time, as all intervals were halved.
WIDEST = 1.8


def between(places: Sequence[tuple[float, ...]], max_points: int) -> list[tuple[float, ...]]:
    """Distances of a curve, with others added where neighbours are more than a factor `WIDEST` apart.

    Args:
        places: Distances of each point [D_c], ascending or descending; all of them vary along the curve, or one.
        max_points: Largest number of points, unless there are more places.

    Returns:
        All places, in the order of `places`.
    """
    filled, room = list(places[:1]), max(max_points - len(places), 0)
    for a, b in pairwise(places):
        ratios = [y / x for x, y in zip(a, b, strict=True)]
        parts = math.ceil(max(abs(math.log(ratio)) for ratio in ratios) / math.log(WIDEST) - 1e-9)
        inner = [tuple(x * r ** (i / parts) for x, r in zip(a, ratios, strict=True)) for i in range(1, parts)][:room]
        room -= len(inner)
        filled += [*inner, b]
    return filled
