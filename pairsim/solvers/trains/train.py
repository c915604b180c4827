"""An infinite train at a distance or spacing: its velocity, and the growth rates of its disturbances."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, replace

import numpy as np
import scipy

from pairsim.quantities.kinds import LENGTH
from pairsim.runtime.errors import NoSteadyState
from pairsim.runtime.message import Message
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.first_solution import coarser
from pairsim.solvers.steady.relaxation import relaxation_time
from pairsim.solvers.trains.cell import distance, one_particle, repeated
from pairsim.solvers.trains.response import ORDERS, growth_rates, response
from pairsim.solvers.trains.spectrum import Spectrum

COARSER = 2**0.5  # size of the cells of a mesh over that of the next one
PRECISION = 1e-3  # of the distance of a transition, relative to its range; chosen
STEP = 0.05  # of a distance by which slopes are differences, relative to it; chosen
BEFORE = 0.5  # part of what the refinement before changed that is in an error, too: the last one may change little by
# chance (measured: 1.1e-5, and 4.3e-5 the next one, after 1.9e-4); that of a method of second order
LEFT = 1 / (COARSER - 1)  # of the difference, an error of first order in the size of the cells; it is of a higher one


@dataclass(frozen=True)
class Train:
    """A train on one mesh.

    Attributes:
        U: Velocity of its particles [U_av].
        d: Distance of facing surfaces [D_c].
        spacing: Distance of centres [D_c].
        t_relax: Slowest decay time of a disturbance at held distances [D_c/U_av].
        spectrum: Growth rates, first of the others by one term fewer of what moving changes.
        unknowns: Unknowns of the cell.
        U_error: Half-width of the interval of the velocity, 0 where no coarser mesh tells it [U_av].
    """

    U: float
    d: float
    spacing: float
    t_relax: float
    spectrum: Spectrum
    unknowns: int
    U_error: float = 0.0

    @property
    def error(self) -> float:
        """Largest half-width of a growth rate or frequency, as a part of the largest rate."""
        waves = self.spectrum.of_cell
        return float(max(waves.growth_error.max(), waves.frequency_error.max()) / np.abs(self.spectrum.rates).max())

    def beside(self, coarse: Train, coarsest: Train) -> Train:
        """This train with its errors, from the same train on cells that are larger by `COARSER` and by its square."""
        (rates, near, far), fewer = (each.spectrum.rates for each in (self, coarse, coarsest)), self.spectrum.others[:1]
        others = np.vstack([fewer, rates + LEFT * (near - rates), rates + LEFT * BEFORE * (far - near)])
        return replace(self, spectrum=Spectrum(rates, others), U_error=LEFT * abs(coarse.U - self.U))


def train_of(problem: SteadyProblem, parameters: Parameters, count: int, d: float | None = None) -> Train:
    """Solve for a train and its growth rates.

    Args:
        problem: A problem of one particle in a period of the tube.
        parameters: Its parameters.
        count: Number of particles in the cell of the growth rates, even.
        d: Distance of facing surfaces, to which the length of the period is adjusted; by default that is kept.

    Raises:
        NoSteadyState: No solution was found; `BranchEnd` where there is none.
        MeshFailure: A mesh could not be generated.
    """
    with closing(one_particle(problem, parameters, d)) as one:
        t_relax, U = relaxation_time(one.linearise()), float(one.y[one.constraints.fields["U_p"]][0])
        with closing(repeated(one, count)) as cell:
            found = response(cell)
            fewer, rates = (growth_rates(*found, orders) for orders in (ORDERS - 1, ORDERS))
            spectrum = Spectrum(rates, fewer[None])
            return Train(U, distance(one), one.problem.length, t_relax, spectrum, cell.constraints.size)


def on_meshes(problem: SteadyProblem, parameters: Parameters, count: int, d: float | None = None) -> Iterator[Train]:
    """Yield the train with its errors on the given mesh, then on finer and finer ones; arguments as of `train_of`."""
    coarse = coarsest = train_of(coarser(problem, COARSER), parameters, count, d)
    while True:
        found = train_of(problem, parameters, count, d)
        yield found.beside(coarse, coarsest)
        problem, coarse, coarsest = coarser(problem, 1 / COARSER), found, coarse


def transition(
    problem: SteadyProblem, parameters: Parameters, count: int, between: tuple[float, float]
) -> tuple[float, float]:
    """Find where a train changes from ordering to clustering: where the first or last wave begins to grow.

    Args:
        problem, parameters, count: As for `train_of`.
        between: Two distances, at one of which it orders and at the other clusters [D_c].

    Returns:
        The distance [D_c], and the slope of `scaled` of `Spectrum.least_stable` there.

    Raises:
        NoSteadyState: It does the same at both, or no solution was found.
        MeshFailure: A mesh could not be generated.
    """

    def growth(d: float) -> float:
        return train_of(problem, parameters, count, d).spectrum.least_stable.scaled

    ends = [growth(d) for d in between]
    if ends[0] * ends[1] >= 0:
        does = "clusters" if ends[0] > 0 else "orders"
        least, largest = (LENGTH(d, "g") for d in between)
        raise NoSteadyState(Message("the train {} at both d = {} and d = {}", does, least, largest))
    d = float(scipy.optimize.brentq(growth, *between, xtol=PRECISION * (between[1] - between[0])))
    return d, (growth((1 + STEP) * d) - growth((1 - STEP) * d)) / (2 * STEP * d)
