"""Newton's matrix from one iteration and one solve to the next: how well it contracts, and whether it serves on."""

from __future__ import annotations

import math

from pairsim.solvers.newton_options import MatrixPolicy


class KeptMatrix:
    """What is known of the matrix in hand; numbers only, so that it can be tested without a scene.

    Attributes:
        g: gamma dt that it was made with, None where there is none to begin a solve with.
        rate: Last rate of contraction with it (0: none yet).
        due: Whether the next iteration makes a new one.
        fresh: Whether it was made in the present iteration.
    """

    def __init__(self, policy: MatrixPolicy) -> None:
        self._policy = policy
        self.g: float | None = None
        self.rate = 0.0
        self.due, self.fresh = True, False
        # Of the solve under way: relative difference of g to that of the matrix, last step and its rate.
        self._mismatch = self._step = self._last_rate = 0.0

    def begin_solve(self, g: float) -> None:
        """Take the matrix into a solve with this g = gamma dt."""
        ratio = g / self.g if self.g else math.inf
        self._mismatch = max(ratio, 1 / ratio) - 1
        self.due, self.fresh = not self._policy.serves_step(ratio), False
        self._step = 0.0

    def made(self, g: float) -> None:
        """A new one was made."""
        self.g, self.rate, self._mismatch = g, 0.0, 0.0
        self.due, self.fresh = False, True

    def forget(self) -> None:
        """Make the next solve begin with a new one."""
        self.g = None

    def error_left(self, iteration: int, step: float) -> float:
        """Estimated error after a step, from how the steps contract.

        Args:
            iteration: Number of the step in its solve, from 1.
            step: Its size, relative to the fields.
        """
        previous, self._step = self._step, step
        if iteration > 1 and previous > 0:
            rate = step / previous
        elif self.fresh:
            rate = min(1.0, 10 * step)
        else:
            # The rate of an earlier solve is a hint only: an iterate taken for converged too early breaks
            # incompressibility, which the next steps then meet with velocities of their own.
            rate = max(self.rate, self._policy.unproven_rate)
        self._last_rate = rate
        if self.fresh:
            return min(100 * step, 1.0) * step  # the square of the step
        self.rate = rate
        # A geometric series. Before a rate was seen, the matrix of another g may contract as badly as both differ.
        contraction = rate if iteration > 1 else max(rate, self._mismatch)
        return step * contraction / max(1 - contraction, 0.1)

    def go_on(self) -> None:
        """Decide whether the matrix serves the next iteration of the solve."""
        self.due = self.due or self._policy.is_worn(self._last_rate, self._step, self.fresh)
        self.fresh = False
