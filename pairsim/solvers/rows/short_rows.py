"""Quasi-steady solutions of rows of equal particles: of short ones, of which the model of long ones is made."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from itertools import chain, product

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.polynomial.chebyshev import chebpts2

from pairsim.fem import diagnostics
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import NoSteadyState
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.rows.model import Row, RowModel, Waves, fitted
from pairsim.solvers.steady.ends import Ended
from pairsim.solvers.steady.first_solution import first_scene
from pairsim.solvers.trains.train import train_of

# All constants were chosen.
FARTHEST = {2: 1.6, 3: 0.9, 4: 0.45, 5: 0.3}  # largest distance of short rows of so many particles [D_c]
COUNTS = {2: 14, 3: 4, 4: 3, 5: 2}  # how many distances of each gap
ALL = 4  # particles up to which all combinations of distances are solved
ROOM = 4.0  # length of tube beyond a row, both ends together [D_c]
TRAINS = (0.06, 0.12, 0.24, 0.48)  # distances of infinite trains [D_c]
CELL = 8  # particles in their cells
CROWDING = 3.0  # rate of the exponential of a distance in which these are extrema of a Chebyshev polynomial [1/D_c]


@dataclass(frozen=True)
class EqualRow:
    """A row of equal particles of any number.

    Attributes:
        problem: That of a single particle; its tube is made longer where a row needs it.
        alone: Materials of a single particle.
    """

    problem: SteadyProblem
    alone: Parameters

    def solved(self, places: Sequence[tuple[float, ...]]) -> Iterator[Row]:
        """Solve rows of one number of particles.

        Args:
            places: Distances of each, in the order in which they are solved [D_c].

        Raises:
            NoSteadyState: There is no quasi-steady state at one of them, or it was not found.
            MeshFailure: A mesh could not be generated.
        """
        count = len(places[0]) + 1
        narrowest = min((d for place in places for d in place), default=np.inf)
        length = max(self.problem.length, count * self.problem.betas[0] + max(map(sum, places)) + ROOM)
        problem = replace(self.problem, betas=self.problem.betas * count, length=length, narrowest=narrowest)
        start = replace(self.alone, gaps=places[0], solids=self.alone.solids * count)
        scene = first_scene(problem, start)
        if isinstance(scene, Ended):
            raise scene.failure
        with closing(Branch(scene)) as branch:
            for place in places:
                yield _at(branch, replace(start, gaps=place))

    def train(self, d: float) -> Waves:
        """Waves of an infinite train; raises as `solved`."""
        return Waves(d, *train_of(self.problem, self.alone, CELL, d).spectrum.waves)


def _at(branch: Branch, parameters: Parameters) -> Row:
    point = branch.at(parameters)
    if not np.isfinite(point.dU_errors).all():
        raise NoSteadyState("the errors of a short row are not known")
    bodies, (h, _), gaps = branch.solver.bodies, branch.solver.state(), np.array(point.gaps)
    last = -np.diff(bodies[-1].outline_points(h)[[0, -1], 0])
    lengths = np.concatenate([np.diff(diagnostics.centres(bodies, h)) - gaps, last])
    slopes = np.zeros((len(lengths), 2, len(gaps)))
    slopes[:, 0] = point.velocity_slopes
    slopes[:-1, 1] = point.motion.centres_by_gaps - np.eye(len(gaps))
    values = np.column_stack([point.observation.U, lengths])
    return Row(gaps, values, slopes, float(point.dU_errors.max(initial=0.0)))


def places_of(count: int, least: float) -> list[tuple[float, ...]]:
    """Distances at which short rows of so many particles are solved, from the largest down [D_c].

    Of more than `ALL` particles these are a Latin hypercube: each combination of all distances but one is there once.
    """
    if count == 1:
        return [()]
    ends = np.exp(-CROWDING * np.array([FARTHEST[count], least]))
    distances = -np.log(np.interp(chebpts2(COUNTS[count]), [-1.0, 1.0], ends)) / CROWDING
    every = product(range(len(distances)), repeat=count - 1)
    chosen = [places for places in every if count <= ALL or sum(places) % len(distances) == 0]
    return [tuple(row) for row in distances.round(4)[chosen].tolist()]


def models(row: EqualRow, least: float, most: int = 5) -> Iterator[tuple[int, int, RowModel | None]]:
    """Solve short rows and trains, and fit the model.

    Args:
        row: The row.
        least: Smallest distance at which short rows are solved [D_c].
        most: Number of particles of the longest ones, at most 5.

    Yields:
        How many are solved, of how many, and the model once all are.
    """
    wanted = [places_of(count, least) for count in range(1, most + 1)]
    rows, trains, total = list[Row](), list[Waves](), sum(map(len, wanted)) + len(TRAINS)
    for found in chain.from_iterable(map(row.solved, wanted)):
        rows.append(found)
        yield len(rows), total, None
    for done, d in enumerate(TRAINS, len(rows) + 1):
        with suppress(NoSteadyState):  # of very soft particles there may be none so near to each other
            trains.append(row.train(d))
        yield done, total, fitted(rows, trains) if done == total else None


def cut_rows(states: Array, count: int, number: int, least: float) -> list[tuple[float, ...]]:
    """Distances of neighbours in a long row at several times, from the widest to the narrowest and between these.

    Args:
        states: Distances of the row at each time, shape (m, N-1).
        count: Number of particles that are cut out.
        number: How many of them are wanted.
        least: Distance below which nothing was solved [D_c].
    """
    width = min(count - 1, states.shape[1])
    cut = sliding_window_view(states, width, axis=1).reshape(-1, width)
    cut = np.unique(cut[cut.min(axis=1) >= least], axis=0)
    chosen = np.unique(np.linspace(len(cut) - 1, 0, number).astype(int))[::-1]
    return [tuple(map(float, gaps)) for gaps in cut[cut.mean(axis=1).argsort()][chosen]]
