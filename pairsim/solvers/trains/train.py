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

COARSER = 2**0.5  # ratio of the cell sizes of successive meshes
PRECISION = 1e-3  # of the distance of a transition, relative to the range searched; chosen
STEP = 0.05  # relative step of a distance in differences for slopes; chosen
BEFORE = 0.5  # fraction of the change by the previous refinement that counts in an error, too, as the last change may
# be small by chance (measured: 1.1e-5, and 4.3e-5 the next one, after 1.9e-4); that of a second-order method
LEFT = 1 / (COARSER - 1)  # ratio of an error of first order in the cell size to the last change; the order is higher


@dataclass(frozen=True)
class Train:
    """A train on one mesh.

    Attributes:
        U: Velocity of its particles [U_av].
        d: Distance between facing surfaces [D_c].
        spacing: Distance between centres [D_c].
        t_relax: Relaxation time at held distances [D_c/U_av].
        spectrum: Growth rates; the first of its `others` are those with one term fewer of the series of `response`.
        unknowns: Number of unknowns of the cell.
        U_error: Half-width of the velocity [U_av]; 0 until it is known from a coarser mesh (`beside`).
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
        """Largest half-width of a growth rate or frequency, relative to the largest rate."""
        waves = self.spectrum.of_cell
        return float(max(waves.growth_error.max(), waves.frequency_error.max()) / np.abs(self.spectrum.rates).max())

    def beside(self, coarse: Train, coarsest: Train) -> Train:
        """This train with its errors, from the same train on cells larger by `COARSER` and by the square of this."""
        (rates, near, far), fewer = (each.spectrum.rates for each in (self, coarse, coarsest)), self.spectrum.others[:1]
        others = np.vstack([fewer, rates + LEFT * (near - rates), rates + LEFT * BEFORE * (far - near)])
        return replace(self, spectrum=Spectrum(rates, others), U_error=LEFT * abs(coarse.U - self.U))


def train_of(problem: SteadyProblem, parameters: Parameters, count: int, d: float | None = None) -> Train:
    """Solve for a train and its growth rates.

    Args:
        problem: The problem of one particle in a period of the tube.
        parameters: Its parameters.
        count: Number of particles in the cell for the growth rates, even.
        d: Distance between facing surfaces [D_c], to which the length of the period is adjusted; None to keep the
            length.

    Raises:
        NoSteadyState: No solution was found; `BranchEnd` if there is none.
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
    """Yield the train with its errors on the given mesh, then on finer and finer ones; arguments as for `train_of`."""
    coarse = coarsest = train_of(coarser(problem, COARSER), parameters, count, d)
    while True:
        found = train_of(problem, parameters, count, d)
        yield found.beside(coarse, coarsest)
        problem, coarse, coarsest = coarser(problem, 1 / COARSER), found, coarse


def transition(
    problem: SteadyProblem, parameters: Parameters, count: int, between: tuple[float, float]
) -> tuple[float, float]:
    """Find the distance at which a train changes between ordering and clustering: the largest `scaled` rate is 0 there.

    Args:
        problem, parameters, count: As for `train_of`.
        between: Two distances, at one of which the train orders, while it clusters at the other [D_c].

    Returns:
        The distance [D_c], and the derivative of `scaled` of `Spectrum.least_stable` with respect to it there.

    Raises:
        NoSteadyState: The train does the same at both distances, or no solution was found.
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
