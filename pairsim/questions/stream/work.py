"""How much work the parts of a stream are, in quasi-steady solutions of a bead alone."""

from __future__ import annotations

from collections.abc import Iterator

from pairsim.questions.stream import StreamCase
from pairsim.solvers.rows.short_rows import LEAST, MOST, MOST_BY_PARTICLE, TRAINS, places_of, unequal_places

TRAIN = 12.0  # one of the trains to which the model is fitted, too, where rows are as long as those of pairsim train
BY_PARTICLE = 2.0  # factor of a row whose velocities are differentiated by each bead; measured
MOTION = 2e-3  # a bead of a stream on its way; measured


def of_row(case: StreamCase, beads: int) -> float:
    """The work of a short row."""
    return beads**2 * (BY_PARTICLE if case.spread and beads <= MOST_BY_PARTICLE else 1.0)


def with_trains(case: StreamCase) -> bool:
    """Whether the model is fitted to trains, too."""
    return case.stream.neighbours == MOST


def short_rows(case: StreamCase) -> int:
    """Number of all short rows."""
    return sum(number for _, number in _short_rows(case))


def of_rows(case: StreamCase) -> float:
    """The work of all short rows and trains."""
    rows = sum(number * of_row(case, beads) for beads, number in _short_rows(case))
    return rows + (TRAIN * len(TRAINS) if with_trains(case) else 0.0)


def _short_rows(case: StreamCase) -> Iterator[tuple[int, int]]:
    """Numbers of beads of short rows, and how many there are."""
    yield from ((count, len(places_of(count, LEAST))) for count in range(1, case.stream.neighbours + 1))
    if case.spread:
        yield from ((len(parts), len(places)) for places, parts in unequal_places(any(case.Ca_es), LEAST))


def of_motion(case: StreamCase) -> float:
    """The work of the motion of all streams."""
    return MOTION * case.beads * case.stream.streams
