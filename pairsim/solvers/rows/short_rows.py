"""Quasi-steady solutions of short rows, to which the model of long rows is fitted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np
from numpy.polynomial.chebyshev import chebpts2

from pairsim.fem import diagnostics
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.rows.model import Row, Waves
from pairsim.solvers.rows.row_branch import RowBranch
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.steady.first_solution import coarser, first_scene
from pairsim.solvers.trains.train import train_of

# All constants were chosen.
LEAST = 0.04  # smallest distance of short rows, unless the long row has a smaller one [D_c]
FARTHEST = {2: 1.6, 3: 0.9, 4: 0.45, 5: 0.3}  # largest distance of short rows, by number of particles [D_c]
COUNTS = {2: 14, 3: 4, 4: 3, 5: 2}  # number of different distances, by number of particles
MOST = 5  # number of particles in the longest short rows
MOST_BY_PARTICLE = 3  # number of particles in the longest rows whose velocities are differentiated by each particle
MOST_UNEQUAL, APART = 2, 0.02  # number of particles in the longest rows in which one differs; its deviation
# In the pair that comes closer the first particle is smaller and the second one larger by the first number: neighbours
# that meet in a stream differ by about as much if this is the standard deviation of its diameters. The other numbers
# are the distances of the pair, relative to the smallest distance of the short rows.
CLOSING, CLOSING_DISTANCES = 0.05, (2.0, 1.5, 1.0, 0.75, 0.5, 0.35, 0.25)
CHANGE = 0.01  # relative change of the diameter of a single rigid particle, in differences of its velocity
ALL = 3  # number of particles in the longest rows for which all combinations of distances are solved
FINE = 3  # number of particles in the longest rows that have the cells of the problem in a liquid with a memory
COARSER = 2**0.5  # factor by which the cells of longer rows are larger
FEWEST = 10  # least number of cells on a half-circle in these, if the problem has as many
ROOM = 4.0  # length of tube beyond a row, both ends together [D_c]
TRAINS = (0.06, 0.12, 0.24, 0.48)  # distances of infinite trains [D_c]
CELL = 8  # number of particles in the periodic cells of these
LONGEST = 5  # approximate number of rows in a chain that is one of several: its first solution costs one or two rows
CROWDING = 3.0  # c in exp(-c d): distances d are chosen such that this takes Chebyshev points [1/D_c]


def solved(
    problem: SteadyProblem,
    alone: Parameters,
    places: Sequence[tuple[float, ...]],
    by_particle: bool = False,
    parts: Array | None = None,
    beside: Sequence[tuple[float, ...]] = (),
    coarse: bool = False,
) -> Iterator[Row]:
    """Solve rows of one number of particles.

    Args:
        problem: The problem of a single particle; its tube is made longer if a row needs it.
        alone: The parameters of a single particle, for its materials.
        places: Distances of each row, in the order in which they are solved [D_c].
        by_particle: Whether velocities are differentiated with respect to diameter and Ca_e of each particle.
        parts: As in `Row`.
        beside: Distances of other rows that are to have the same length of tube and the same cells as these [D_c].
        coarse: Whether cells are larger by `COARSER` in a liquid with a memory.

    Raises:
        NoSteadyState: A row has no quasi-steady state, or it was not found.
        MeshFailure: A mesh could not be generated.
    """
    count, every = len(places[0]) + 1, [*places, *beside]
    narrowest = min((d for place in every for d in place), default=np.inf)
    length = max(problem.length, count * problem.betas[0] + max(map(sum, every)) + ROOM)
    problem = replace(problem.repeated(count), length=length, narrowest=narrowest)
    if coarse and alone.liquid.has_memory:
        problem = coarser(problem, COARSER, min(problem.mesh.Np, FEWEST))
    start = replace(alone, gaps=places[0], solids=alone.solids * count)
    if parts is not None:
        larger, softer = np.exp(parts).T
        betas = tuple(float(each) for each in problem.betas * larger)
        problem, start = replace(problem, betas=betas), start.softened(softer.tolist())
    rigid_alone = count == 1 and not any(alone.solids)
    differentiated = by_particle and not rigid_alone
    with closing(RowBranch(arrived(first_scene(problem, start)), by_particle=differentiated)) as branch:
        for place in places:
            row = replace(_at(branch, replace(start, gaps=place)), parts=parts)
            yield replace(row, by_particle=_by_size(problem, start)) if by_particle and rigid_alone else row


def _by_size(problem: SteadyProblem, alone: Parameters) -> Array:
    """`Row.by_particle` of a single rigid particle, from solutions for two diameters, shape (1, 1, 2) [U_av].

    In other rows it follows from one solution, on a mesh that moves with the diameters. The mesh around a single rigid
    particle does not move.
    """
    U = []
    for sign in (1, -1):
        betas = tuple(beta * float(np.exp(sign * CHANGE)) for beta in problem.betas)
        with closing(RowBranch(arrived(first_scene(replace(problem, betas=betas), alone)))) as branch:
            U.append(_at(branch, alone).values[0, 0])
    return np.array([[[(U[0] - U[1]) / (2 * CHANGE), 0.0]]])


def _at(branch: RowBranch, parameters: Parameters) -> Row:
    point = arrived(branch.at(parameters))
    if not np.isfinite(point.dU_errors).all():
        raise NoSteadyState("the errors of a short row are not known")
    bodies, (h, _), gaps = branch.solver.bodies, branch.solver.state(), np.array(point.gaps)
    centres = diagnostics.centres(bodies, h)
    rear, front = (float(body.outline_points(h)[end, 0]) for body, end in ((bodies[0], -1), (bodies[-1], 0)))
    lengths = np.append(np.diff(centres) - gaps, front - centres[-1])
    not_known = np.full((1, len(gaps)), np.nan)  # derivatives of the distance from the last centre to its front
    stretch = np.vstack([point.motion.centres_by_gaps - np.eye(len(gaps)), not_known])
    values, slopes = np.stack([point.held.U, lengths, point.motion.U], -1), np.stack([point.held_slopes, stretch], -1)
    by_particle = point.by_particle.sum(axis=-1) if point.by_particle.size else None
    error, lag = float(point.dU_errors.max(initial=0.0)), branch.lag()
    return Row(gaps, values, slopes, error, by_particle, float(centres[0] - rear), lag=lag)


def places_of(count: int, least: float) -> list[tuple[float, ...]]:
    """Distances at which short rows of `count` particles are solved, from the largest down [D_c].

    For rows of up to `ALL` particles these are all combinations of the same distances. For longer rows they are a Latin
    hypercube, in which each combination of all distances but one occurs once.
    """
    if count == 1:
        return [()]
    ends = np.exp(-CROWDING * np.array([FARTHEST[count], least]))
    distances = -np.log(np.interp(chebpts2(COUNTS[count]), [-1.0, 1.0], ends)) / CROWDING
    every = product(range(len(distances)), repeat=count - 1)
    chosen = [places for places in every if count <= ALL or sum(places) % len(distances) == 0]
    return [tuple(row) for row in distances.round(4)[chosen].tolist()]


@dataclass(frozen=True)
class Chain:
    """Rows of the same number of particles that are solved one after another.

    Attributes:
        places, by_particle, parts, beside, coarse: As for `solved`.
        may_end: Whether it may end at a row that cannot be solved, without an error and without the rows after it.
    """

    places: Sequence[tuple[float, ...]]
    by_particle: bool = False
    parts: Array | None = None
    beside: Sequence[tuple[float, ...]] = ()
    coarse: bool = False
    may_end: bool = False

    def solved(self, problem: SteadyProblem, alone: Parameters) -> Iterator[Row]:
        """Solve its rows; arguments as for `solved`."""
        ends = (NoSteadyState, MeshFailure) if self.may_end else ()
        with suppress(*ends):
            yield from solved(problem, alone, self.places, self.by_particle, self.parts, self.beside, self.coarse)

    def cut(self, longest: int = LONGEST) -> list[Chain]:
        """The same rows as several chains of about `longest` rows, each of which has to find a first solution."""
        parts = max(round(len(self.places) / longest), 1)
        ends = [round(i * len(self.places) / parts) for i in range(parts + 1)]
        return [replace(self, places=self.places[a:b], beside=[*self.places, *self.beside]) for a, b in pairwise(ends)]


def short_rows(least: float, most: int = MOST, by_particle: bool = False) -> Iterator[Chain]:
    """All rows of equal particles to which the model is fitted, the single particle first.

    In a liquid with a memory rows of more than `FINE` particles have larger cells: the contribution of so many
    neighbours is small beside that of fewer ones, and the error due to the cells is a small part of it.

    Args:
        least: Smallest distance [D_c].
        most: Number of particles in the longest rows, at most `MOST`.
        by_particle: Whether velocities of rows of up to `MOST_BY_PARTICLE` are differentiated with respect to diameter
            and Ca_e of each particle.
    """
    for count in range(1, most + 1):
        yield Chain(places_of(count, least), by_particle and count <= MOST_BY_PARTICLE, coarse=count > FINE)


def unequal_rows(soft: bool, least: float) -> Iterator[Chain]:
    """The rows of `unequal_places`: those in which one particle differs, and the pair that comes closer.

    Args:
        soft: Whether particles are soft.
        least: Smallest distance of the short rows [D_c].
    """
    for places, parts in unequal_places(soft, least):
        closing = len(parts) > 1 and bool(parts[:, 0].all())
        yield Chain(places, not closing, parts, may_end=closing)


def unequal_places(soft: bool, least: float) -> Iterator[tuple[list[tuple[float, ...]], Array]]:
    """Distances and deviations of rows in which one particle differs, and of the pair that comes closer.

    A single particle is made larger and smaller and, if it is soft, softer and stiffer. Of two particles, each in turn
    is made larger and smaller, at every second distance. In the pair that comes closer both particles differ; its
    distances reach below the smallest one of the short rows.

    Args:
        soft: Whether particles are soft.
        least: Smallest distance of the short rows [D_c].

    Yields:
        Distances of the rows [D_c], and the deviations of their particles, as in `Row.parts`.
    """
    for count in range(1, MOST_UNEQUAL + 1):
        for i, kind, sign in product(range(count), range(2 if soft and count == 1 else 1), (1, -1)):
            parts = np.zeros((count, 2))
            parts[i, kind] = sign * APART
            yield places_of(count, least)[1 - count % 2 :: 2], parts
    yield [(least * each,) for each in CLOSING_DISTANCES], np.array([[-CLOSING, 0.0], [CLOSING, 0.0]])


def train_at(problem: SteadyProblem, alone: Parameters, d: float) -> Waves | None:
    """Waves of an infinite train, to which the model is fitted as well.

    Args:
        problem, alone: As for `solved`.
        d: Distance between neighbours, one of `TRAINS` [D_c].

    Returns:
        The waves; None if the train has no steady state, or none was found, as with very soft particles close together.
    """
    with suppress(NoSteadyState):
        return d, *train_of(problem, alone, CELL, d).spectrum.waves
    return None
