"""The model of long rows from solutions of short ones, and its error against solutions of longer ones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from pairsim.runtime.arrays import Array
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.rows.interaction import RowModel
from pairsim.solvers.rows.short_rows import ShortRow, short_rows

# All constants were chosen.
FARTHEST = {2: 1.6, 3: 0.9, 4: 0.21}  # largest distance of short rows of so many particles [D_c]
COUNTS = {2: 14, 3: 4, 4: 2}  # how many distances of each gap
ROOM = 4.0  # length of tube beyond a row, both ends together [D_c]
CROWDING = 3.0  # rate of the exponential of a distance in which these are spread like the zeros of a polynomial [1/D_c]


@dataclass(frozen=True)
class EqualRow:
    """A row of equal particles of any number.

    Attributes:
        problem: That of a single particle; its tube is made longer where a row needs it.
        alone: Materials of a single particle.
        least: Smallest distance at which short rows are solved [D_c].
    """

    problem: SteadyProblem
    alone: Parameters
    least: float

    def solved(self, places: Sequence[tuple[float, ...]]) -> Iterator[ShortRow]:
        """Solutions at some distances; raises what `short_rows` does."""
        count = len(places[0]) + 1
        narrowest = min((d for place in places for d in place), default=np.inf)
        longest = count * self.problem.betas[0] + max(map(sum, places))
        length = max(self.problem.length, longest + ROOM)
        problem = replace(self.problem, betas=self.problem.betas * count, length=length, narrowest=narrowest)
        start = replace(self.alone, gaps=places[0], solids=self.alone.solids * count)
        yield from short_rows(problem, start, places)


def places_of(count: int, least: float) -> list[tuple[float, ...]]:
    """Distances at which short rows of so many particles are solved, from the largest down [D_c]."""
    if count == 1:
        return [()]
    ends = np.exp(-CROWDING * np.array([FARTHEST[count], least]))
    nodes = np.cos(np.pi * np.arange(COUNTS[count]) / (COUNTS[count] - 1))  # ascending places from the far end
    spread = ends.mean() - np.diff(ends)[0] / 2 * nodes
    values = [float(f"{d:.3g}") for d in -np.log(spread) / CROWDING]
    return list(product(values, repeat=count - 1))


def models(row: EqualRow, most: int) -> Iterator[tuple[int, int, RowModel | None]]:
    """Solve short rows and fit the model.

    Args:
        row: The row.
        most: Number of particles of the longest ones, 2 to 4.

    Yields:
        How many short rows are solved, of how many, and the model of so many particles as were solved; None at first.
    """
    wanted = {count: places_of(count, row.least) for count in range(1, most + 1)}
    total, done = sum(map(len, wanted.values())), 0
    model: RowModel | None = None
    for places in wanted.values():
        rows = []
        for found in row.solved(places):
            rows.append(found)
            done += 1
            yield done, total, model
        if model is None:
            model = RowModel(float(rows[0].U[0]), float(rows[0].lengths[0]), (), np.inf)
        else:
            model = model.with_part_of(rows)
        yield done, total, model


@dataclass(frozen=True)
class Audit:
    """What the model differs by from solutions of rows.

    Attributes:
        dU: Largest difference of a relative velocity, relative to the largest |dU| of each row, one for each row.
        slopes: Largest difference of a derivative of a relative velocity by a distance, in the same way.
        dU_errors: Half-widths of dU of the solutions, in the same way.
    """

    dU: Array
    slopes: Array
    dU_errors: Array


def windows_of(states: Sequence[Array], count: int, number: int, least: float) -> list[tuple[float, ...]]:
    """Distances of neighbours in a long row at several times, from the widest down: the narrowest, and some at random.

    Args:
        states: Distances of the row at each time, shape (N-1,) each.
        count: Number of particles that are cut out.
        number: How many of them are wanted; half of them are the narrowest ones.
        least: Distance below which nothing was solved [D_c].
    """
    cut = np.vstack([sliding_window_view(gaps, min(count - 1, len(gaps))) for gaps in states])
    cut = np.unique(cut[cut.min(axis=1) >= least], axis=0)
    cut = cut[np.argsort(cut.mean(axis=1))]
    half = number // 2
    others = np.random.default_rng(0).permutation(cut[half:])[: number - half]
    return [tuple(map(float, gaps)) for gaps in (*others, *cut[:half][::-1])]


def audit(row: EqualRow, model: RowModel, places: Sequence[tuple[float, ...]]) -> Audit:
    """Solve rows, all of the same number of particles, and compare.

    Args:
        row: The row.
        model: Its model.
        places: Distances of each [D_c].
    """
    found = []
    for full in row.solved(places):
        dU, slopes = np.diff(full.U), np.diff(full.U_slopes, axis=0)
        off = np.abs(np.diff(model.velocities(full.gaps)) - dU).max()
        off_slopes = np.abs(np.diff(model.slopes(full.gaps), axis=0) - slopes).max()
        size = np.abs(dU).max()
        found.append((off / size, off_slopes / np.abs(slopes).max(), full.dU_error / size))
    return Audit(*np.array(found).T)
