"""Jacobian lagging: the observed rate of contraction decides when Newton's matrix is assembled and factorised again.

The origin of the default values is given in docs/explanation/decisions.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class MatrixPolicy:
    """Criteria for a new matrix. Assembling and factorising one costs about as much as 13 iterations with an old one.

    Attributes:
        slow: Rate of contraction above which the matrix is not reused.
        other_step: Largest relative change of g = gamma dt for which the matrix is reused in another step.
        far: Norm of a step, relative to the fields, above which even a matrix from the same iteration is replaced.
        near: Rate of contraction up to which the factors also serve to solve linear systems with the exact matrix at
            the solution: six refinements then reach 1e-10 of the right-hand side.
        unproven_rate: Smallest rate of contraction that is assumed before one is observed in the present solve.
    """

    slow: float = 0.15
    other_step: float = 0.5
    far: float = 1e-3
    near: float = 0.035
    unproven_rate: float = 0.1

    def serves_step(self, ratio: float) -> bool:
        """Whether a matrix is reused in a solve whose g is `ratio` times its own; infinite where there is no matrix."""
        return abs(ratio - 1) <= self.other_step

    def is_worn(self, rate: float, step: float, fresh: bool) -> bool:
        """Whether the next iteration needs a new matrix.

        Args:
            rate: Rate of contraction of the last step.
            step: Norm of the last step, relative to the fields.
            fresh: Whether the matrix was assembled for that step.
        """
        return step > self.far if fresh else rate > self.slow


class LaggedMatrix:
    """Age and rate of contraction of the factorised matrix; plain numbers, which can be tested without a scene.

    Args:
        policy: When a new matrix is assembled.

    Attributes:
        g: gamma dt of the matrix, None if there is no matrix for the next solve.
        rate: Last observed rate of contraction, 0 if none was observed.
        due: Whether a new matrix is assembled in the next iteration.
        fresh: Whether the matrix was assembled in the present iteration.
    """

    def __init__(self, policy: MatrixPolicy) -> None:
        self._policy = policy
        self.g: float | None = None
        self.rate = 0.0
        self.due, self.fresh = True, False
        # In the present solve: relative difference of g from that of the matrix, last step and its rate.
        self._mismatch = self._step = self._last_rate = 0.0

    @property
    def contraction(self) -> float:
        """Rate of contraction expected of further iterations with this matrix in the present solve."""
        return max(self.rate, self._mismatch)

    def begin_solve(self, g: float) -> None:
        """Decide whether the matrix is reused in a solve with g = gamma dt."""
        ratio = g / self.g if self.g else math.inf
        self._mismatch = max(ratio, 1 / ratio) - 1
        self.due, self.fresh = not self._policy.serves_step(ratio), False
        self._step = 0.0

    def is_near(self) -> bool:
        """Whether the factors are close enough to the matrix at the last solution to refine solutions with it."""
        return self.g is not None and self.rate <= self._policy.near

    def made(self, g: float) -> None:
        """Record that a new matrix has been assembled and factorised with this g = gamma dt."""
        self.g, self.rate, self._mismatch = g, 0.0, 0.0
        self.due, self.fresh = False, True

    def forget(self) -> None:
        """Discard the matrix; the next solve assembles a new one."""
        self.g = None

    def error_left(self, iteration: int, step: float) -> float:
        """Estimate the error that remains after a Newton step from the rate of contraction.

        Args:
            iteration: Number of the step in its solve, counted from 1.
            step: Norm of the step, relative to the fields.
        """
        previous, self._step = self._step, step
        if iteration > 1 and previous > 0:
            rate = step / previous
        elif self.fresh:
            rate = min(1.0, 10 * step)
        else:
            # The rate of an earlier solve may be too optimistic. An iterate that is accepted too early violates
            # incompressibility, which the next steps correct by spurious velocities.
            rate = max(self.rate, self._policy.unproven_rate)
        self._last_rate = rate
        if self.fresh:
            return min(100 * step, 1.0) * step  # quadratic convergence; the factor of 100 was chosen
        self.rate = rate
        # Sum of a geometric series. Before a rate is observed in this solve, it is assumed to be no better than the
        # relative difference of g from that of the matrix.
        contraction = rate if iteration > 1 else max(rate, self._mismatch)
        return step * contraction / max(1 - contraction, 0.1)

    def go_on(self) -> None:
        """Decide whether the matrix is reused in the next iteration of the solve."""
        self.due = self.due or self._policy.is_worn(self._last_rate, self._step, self.fresh)
        self.fresh = False
