"""Lengths of the columns of cells along the tube. Without numpy, so that the cost of a case is estimated at once."""

from __future__ import annotations

# Largest length of a column, relative to the smallest diameter. The smaller the particles, the smaller dU is relative
# to the velocities, and the smaller the error may be that cells along the tube cause (docs/explanation/decisions.md).
LONGEST = 2.5


def stations(begin: float, end: float, first: float, growth: float, longest: float) -> list[float]:
    """Axial positions of the boundaries between columns of cells.

    Args:
        begin: Axial position of the first boundary.
        end: Axial position of the last boundary.
        first: Length of the first column.
        growth: Growth of the column length per unit distance.
        longest: Largest length of a column.

    Returns:
        At least two positions, ascending. All lengths are scaled by the same factor to fill the interval.
    """
    places = [0.0]
    while places[-1] < end - begin:
        places.append(places[-1] + min(first + growth * places[-1], longest))
    if len(places) > 2 and places[-1] - (end - begin) > (places[-1] - places[-2]) / 2:
        places.pop()
    scale = (end - begin) / places[-1]
    return [*(begin + scale * place for place in places[:-1]), end]  # the end without rounding error
