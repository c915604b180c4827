"""Convergence and divergence tests of Newton's method, and the report of a solve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pairsim.runtime.fenicsx import PETSc
from pairsim.solvers.nonlinear.jacobian_lagging import LaggedMatrix

# Growth of the residual at which the iteration is stopped. No iteration whose residual grew by more was seen to
# converge, and MUMPS takes tens of seconds for each matrix of such states.
LOST = 1e8
# Fields whose steps are ignored in the test for divergence: pressures and forces may change by a multiple of their
# initial values.
FOLLOWING = ("m", "p_f", "p_s", "dp", "F")


@dataclass(frozen=True)
class Report:
    """Result of a nonlinear solve.

    Attributes:
        converged: Whether the tolerance was met.
        iterations: Number of Newton iterations (linear solves).
        factorisations: Number of numeric factorisations.
        reason: "converged", or the reason of the failure.
        steps: Norm of the last step of each field, relative to the field.
        residual: Euclidean norm of the last residual.
    """

    converged: bool
    iterations: int
    factorisations: int
    reason: str
    steps: dict[str, float]
    residual: float


class Convergence:
    """The test for convergence and divergence after each iteration.

    Args:
        tolerance: Largest estimated error of a field after the last iteration, relative to the norm of the field.
        max_iterations: Largest number of iterations in one solve.
        matrix: Age and rate of contraction of the matrix of the iterations.
        steps_may_grow: Whether growing steps are not taken as divergence, because a line search may have shortened the
            earlier ones.

    Attributes:
        reason: Why the iterations ended; empty until they have.
        steps: Norm of the last step of each field, relative to the field.
        residual: Euclidean norm of the last residual.
        leading: Largest of the last steps of those fields that are not in `FOLLOWING`, relative to the fields.
    """

    def __init__(
        self, tolerance: float, max_iterations: int, matrix: LaggedMatrix, *, steps_may_grow: bool = False
    ) -> None:
        self._tolerance, self._max_iterations, self._matrix = tolerance, max_iterations, matrix
        self._steps_may_grow = steps_may_grow
        self.leading = 0.0
        self.begin()

    def begin(self) -> None:
        """Begin a solve."""
        self.reason, self.residual, self._first = "", 0.0, 0.0
        self.steps: dict[str, float] = {}

    def test(self, iteration: int, residual: float, steps: Callable[[], dict[str, float]]) -> int:
        """PETSc's code for the state of the iteration: to be continued, converged or diverged.

        Args:
            iteration: Number of iterations done.
            residual: Euclidean norm of the residual.
            steps: Returns the norms of the last step by field, relative to the fields; not called before the first
                iteration.
        """
        end, self.residual = PETSc.SNES.ConvergedReason, residual
        if not np.isfinite(residual):
            return self._ended("the residual is not finite", end.DIVERGED_FUNCTION_NANORINF)
        if iteration == 0:
            self._first = residual
            return int(end.ITERATING)
        if residual > LOST * max(self._first, 1.0):
            return self._ended("the residual grows without bound", end.DIVERGED_DTOL)
        self.steps = steps()
        largest = max((v for k, v in self.steps.items() if k != "m"), default=0.0)
        leading = max((v for k, v in self.steps.items() if k not in FOLLOWING), default=0.0)
        growth, self.leading = leading / self.leading if iteration > 1 and self.leading else 0.0, leading
        left = self._matrix.error_left(iteration, largest)
        if left < self._tolerance or largest < 0.1 * self._tolerance:
            return self._ended("converged", end.CONVERGED_SNORM_RELATIVE)
        if not self._steps_may_grow and growth > 2 and (leading > 0.1 or (self._matrix.fresh and iteration > 3)):
            return self._ended("the steps grow", end.DIVERGED_DTOL)
        if iteration >= self._max_iterations:
            return self._ended(f"no convergence in {iteration} iterations", end.DIVERGED_MAX_IT)
        self._matrix.go_on()
        return int(end.ITERATING)

    def _ended(self, reason: str, code: int) -> int:
        self.reason = reason
        return int(code)
