"""Cell sizes of a run that follow from the error wanted: a coarse run shows how small cells have to be."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.runtime.clock import Clock
from pairsim.runtime.errors import RunFailure
from pairsim.solvers.curves.adaptation import ELASTIC_ORDER
from pairsim.solvers.errors.run_errors import RunErrors
from pairsim.solvers.errors.time_error import LEAST
from pairsim.solvers.goals import dU
from pairsim.solvers.problems import Problem
from pairsim.solvers.transient.end import reason_to_end
from pairsim.solvers.transient.start import settled_errors, settles
from pairsim.solvers.transient.transient import Transient

# All but the order were chosen.
COARSE = 2.0  # cell size of the coarse run, relative to that of the problem
COARSE_TOLERANCE = 4.0  # its tolerance of time steps, relative to that of the problem
FEWEST = 14  # least number of cells on a half-circle
ORDER = 3.0  # order of convergence of dU_error in the cell size; measured (docs/explanation/decisions.md)
AIM = 0.8  # fraction of the allowed error that cells are made for
FACTORS = (0.4, COARSE)  # smallest and largest cell size of the run, relative to that of the problem
ROUNDS = 3  # rounds in which cells become smaller for the quasi-steady state
LEAST_PART = 0.1  # least fraction of dU_error due to cells, even where the coarse run's time steps seem to cause it all


@dataclass(frozen=True)
class RunAdaptation:
    """The cell sizes that a run needs, and the coarse run from which they follow.

    Attributes:
        wanted: Error wanted, relative to the largest |dU|.
        dU: Largest |dU| of the coarse run [U_av].
        error: Its largest dU_error [U_av].
        t: Time that it reached [D_c/U_av].
        unknowns: Number of its unknowns.
        factor: Cell size of the run, relative to that of the problem.
        settled: Errors of goals in the quasi-steady state that the run approaches, on these cells, by their names, (k,)
            each; empty where they do not enter the half-widths of the run (`settles`).
    """

    wanted: float
    dU: float
    error: float
    t: float
    unknowns: int
    factor: float
    settled: dict[str, Array] = field(default_factory=dict)

    @classmethod
    def begin(cls, problem: Problem, wanted: float) -> RunAdaptation | None:
        """Compute the coarse run; None if its dU is negligible, or its error is not known.

        Args:
            problem: The problem, with `dU_error`.
            wanted: Error wanted, relative to the largest |dU|.

        Raises:
            Stopped: The process has received a signal.
        """
        errors, t, unknowns = RunErrors.of(problem.liquid), 0.0, 0
        control = replace(problem.control, tolerance=COARSE_TOLERANCE * problem.control.tolerance)
        coarse = replace(problem, mesh=problem.mesh.scaled(COARSE, FEWEST), control=control)
        transient: Transient | None = None
        try:
            with suppress(RunFailure):  # where coarse cells fail, finer ones may not
                transient = Transient(coarse, settled={})  # those on such cells would be far too large
                errors, unknowns = transient.run_errors, transient.constraints.size
                for step in transient.steps(iter([problem.t_end])):
                    problem.monitor.check_signals()
                    t = step.t
                    if reason_to_end(problem, t, step.observation.d.tolist(), transient.cycles) is not None:
                        break
        finally:
            if transient is not None:
                transient.close()
        of_dU = errors[dU]
        peak, largest = of_dU.steps.peak, of_dU.largest
        if peak <= LEAST or not largest:
            return None
        by_cells = max(largest - of_dU.steps.largest, LEAST_PART * largest)
        factor = COARSE * (AIM * wanted * peak / by_cells) ** (1 / ORDER)
        factor = min(max(factor, FACTORS[0]), FACTORS[1])
        found = cls(wanted, peak, largest, t, unknowns, float(f"{factor:.3g}"))
        return found._settling(problem) if settles(problem) else found

    def adapted(self, problem: Problem) -> Problem:
        """The problem with the cells of the run."""
        return replace(problem, mesh=problem.mesh.scaled(self.factor, FEWEST))

    def _settling(self, problem: Problem) -> RunAdaptation:
        """A copy with cells on which the error of the quasi-steady state that the run approaches is small enough."""
        most = AIM * self.wanted * self.dU / 2  # one of two terms of the half-width that are due to the cells
        part = -np.expm1(-problem.t_end / problem.liquid.longest)  # fraction of it that has set in at the end
        found = self
        for rounds in range(ROUNDS + 1):
            found = replace(found, settled=settled_errors(found.adapted(problem), Clock()))
            error = part * np.max(found.settled.get(dU.name, 0.0))
            if error <= most or found.factor <= FACTORS[0] or rounds == ROUNDS:
                break
            factor = max(found.factor * float(most / error) ** (1 / ELASTIC_ORDER), FACTORS[0])
            found = replace(found, factor=float(f"{factor:.3g}"))
        return found
