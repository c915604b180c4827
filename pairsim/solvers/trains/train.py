"""An infinite train at a distance or spacing: its velocity, and the growth rates of its disturbances on two meshes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.ends import Ended
from pairsim.solvers.steady.first_solution import FEWEST_CELLS, coarser
from pairsim.solvers.steady.relaxation import relaxation_time
from pairsim.solvers.trains.cell import at_distance, at_spacing, distance, repeated
from pairsim.solvers.trains.response import ORDERS, Response
from pairsim.solvers.trains.spectrum import Spectrum

COARSER = 2**0.5
"""Size of the cells of a second mesh over that of the first."""
LEFT = 1 / (COARSER - 1)  # of the difference, an error of first order in the size of the cells; it is of a higher one


@dataclass(frozen=True)
class Train:
    """A train on one mesh.

    Attributes:
        U: Velocity of its particles [U_av].
        d: Distance of facing surfaces [D_c].
        spacing: Distance of centres [D_c].
        t_relax: Slowest decay time of a disturbance at held distances [D_c/U_av].
        series: Growth rates at 0 and the wave numbers of the cell, by 0 to `ORDERS` terms of what moving changes,
            complex (ORDERS + 1, n) [U_av/D_c].
        unknowns: Unknowns of the cell.
    """

    U: float
    d: float
    spacing: float
    t_relax: float
    series: Array
    unknowns: int

    @staticmethod
    def of(problem: SteadyProblem, parameters: Parameters, count: int, d: float | None = None) -> Train | Ended:
        """Solve for a train and its growth rates.

        Args:
            problem: A problem of one particle in a period of the tube.
            parameters: Its parameters.
            count: Number of particles in the cell of the growth rates, even.
            d: Distance of facing surfaces, to which the length of the period is adjusted; by default that is kept.

        Returns:
            The train, or what is known of the end of its branch.

        Raises:
            NoSteadyState: No solution was found.
            MeshFailure: A mesh could not be generated.
        """
        one = at_spacing(problem, parameters) if d is None else at_distance(problem, parameters, d)
        if isinstance(one, Ended):
            return one
        try:
            one.factor()
            t_relax, U = relaxation_time(one), float(one.y[one.constraints.fields["U_p"]][0])
            cell = repeated(one, count)
            try:
                response, unknowns = Response.of(cell), cell.constraints.size
            finally:
                cell.close()
            series = [np.concatenate([[0.0], response.rates(orders)]) for orders in range(ORDERS + 1)]
            return Train(U, distance(one), one.problem.length, t_relax, np.array(series), unknowns)
        finally:
            one.close()


@dataclass(frozen=True)
class TrainOnMeshes:
    """A train on a mesh, and on one whose cells are `COARSER` times larger.

    Attributes:
        fine: That on the smaller cells.
        coarse: That on the larger ones.
        problem: The problem with the smaller cells.
    """

    fine: Train
    coarse: Train
    problem: SteadyProblem

    @staticmethod
    def of(
        problem: SteadyProblem,
        parameters: Parameters,
        count: int,
        d: float | None = None,
        coarse: Train | None = None,
    ) -> TrainOnMeshes | Ended:
        """Solve on both meshes, arguments as for `Train.of`; `coarse` where it is known."""
        if coarse is None:
            found = Train.of(coarser(problem, COARSER), parameters, count, d)
            if isinstance(found, Ended):
                return found
            coarse = found
        fine = Train.of(problem, parameters, count, d)
        return fine if isinstance(fine, Ended) else TrainOnMeshes(fine, coarse, problem)

    @property
    def finer(self) -> SteadyProblem:
        """The problem with cells that are smaller by the factor `COARSER`."""
        return replace(self.problem, mesh=self.problem.mesh.scaled(1 / COARSER, FEWEST_CELLS))

    @property
    def spectrum(self) -> Spectrum:
        """The growth rates with the half-widths of their intervals."""
        rates = self.fine.series[-1]
        by_mesh = rates + LEFT * (self.coarse.series[-1] - rates)
        return Spectrum(rates, np.array([by_mesh, self.fine.series[-2]]))

    @property
    def error(self) -> float:
        """Largest half-width of a growth rate or frequency, as a part of the largest rate."""
        spectrum = self.spectrum
        errors = [each(spectrum.waves)[1].max() for each in (spectrum.growth, spectrum.frequency)]
        return float(max(errors) / np.abs(spectrum.rates).max())

    @property
    def series_error(self) -> float:
        """What the last term of the series changes the rates by, relative to the largest."""
        last, before = self.fine.series[-1], self.fine.series[-2]
        return float(np.abs(last - before).max() / np.abs(last).max())

    @property
    def U_error(self) -> float:
        """Half-width of the interval of the velocity [U_av]."""
        return LEFT * abs(self.coarse.U - self.fine.U)
