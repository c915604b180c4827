"""The work of the parts of a computation of streams, in units of a quasi-steady solution of a single bead."""

from __future__ import annotations

from collections.abc import Iterator

from pairsim.questions.stream import StreamCase
from pairsim.solvers.rows.short_rows import LEAST, MOST, MOST_BY_PARTICLE, TRAINS, places_of, unequal_places

TRAIN = 12.0  # work of each train to which the model is also fitted, if rows are as long as those of pairsim train
BY_PARTICLE = 2.0  # factor of the work of a row whose velocities are differentiated by each bead; measured
MOTION = 2e-3  # work of the motion of a bead along the tube; measured


def of_row(case: StreamCase, beads: int) -> float:
    """The work of a short row."""
    return beads**2 * (BY_PARTICLE if case.spread and beads <= MOST_BY_PARTICLE else 1.0)


def with_trains(case: StreamCase) -> bool:
    """Whether the model is also fitted to trains."""
    return case.stream.neighbours == MOST


def short_rows(case: StreamCase) -> int:
    """The number of short rows."""
    return sum(number for _, number in _short_rows(case))


def of_rows(case: StreamCase) -> float:
    """The work of all short rows and trains."""
    rows = sum(number * of_row(case, beads) for beads, number in _short_rows(case))
    return rows + (TRAIN * len(TRAINS) if with_trains(case) else 0.0)


def _short_rows(case: StreamCase) -> Iterator[tuple[int, int]]:
    """Yield the numbers of beads in short rows, each with the number of such rows."""
    yield from ((count, len(places_of(count, LEAST))) for count in range(1, case.stream.neighbours + 1))
    if case.spread:
        yield from ((len(parts), len(places)) for places, parts in unequal_places(any(case.Ca_es), LEAST))


def of_motion(case: StreamCase) -> float:
    """The work of the motion of all streams."""
    return MOTION * case.beads * case.stream.streams
