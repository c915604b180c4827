"""Adjoint solutions of the results of a quasi-steady scene.

The derivative of a result J(y) along any change dR of the residual is -z . dR, with the adjoint z of J. The adjoints of
all results are solved for at once; what moving adds, sensitivities, slopes and errors are products with them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.nonlinear.factors import ADJOINT
from pairsim.solvers.steady.pressure_drop import InnerDrop
from pairsim.solvers.steady.scene import SteadySolver


@dataclass(frozen=True)
class Adjoints:
    """Adjoints at a solution.

    Attributes:
        all: Those of velocities, forces and pressure drop, in this order, (N + forces + 1, n_y).
        velocities: Of the velocities of the particles, (N, n_y).
        drop: The pressure drop.
    """

    all: Array
    velocities: Array
    drop: InnerDrop

    @staticmethod
    def of(steady: SteadySolver) -> Adjoints:
        """Solve for them at a solution; its matrix must have been assembled there (`SteadySolver.factor`)."""
        fields, drop = steady.constraints.fields, InnerDrop.of(steady)
        own = np.concatenate([fields["U_p"], fields.get("F", np.empty(0, np.int64))])
        rows = np.zeros((len(own) + 1, steady.constraints.size))
        rows[np.arange(len(own)), own] = 1.0
        rows[-1] = drop.row
        solutions = steady.newton.linear_solve(rows, transposed=True, tolerance=ADJOINT)
        return Adjoints(solutions, solutions[: len(fields["U_p"])], drop)
