"""A quasi-steady solution with the equations linearised there: linear systems, adjoints and tangents.

`SteadySolver.linearise` returns it. Functions that need the matrix at a solution take it as an argument, and get the
solution and its parameters from it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.nonlinear.factors import ADJOINT, EXACT
from pairsim.solvers.parameters import DIFFERENCE, Parameters

if TYPE_CHECKING:
    from pairsim.solvers.steady.scene import SteadySolver


class Linearisation:
    """A solution R(y; parameters) = 0 of a quasi-steady scene, and the matrix J = dR/dy there.

    It is valid until its solver goes on to another solution; after that it refuses to solve linear systems.

    Args:
        steady: The solver, at the solution, with the matrix there.

    Attributes:
        steady: The solver.
        parameters: Parameters of the solution.
        y: Its free unknowns, shape (n_y,).
    """

    def __init__(self, steady: SteadySolver) -> None:
        self.steady, self.parameters, self.y = steady, steady.parameters, steady.y

    def solve(self, rhs: Array, tolerance: float = EXACT) -> Array:
        """J^-1 of one right-hand side, shape (n_y,), or of several, shape (k, n_y).

        Args:
            rhs: The right-hand sides.
            tolerance: Residual of every system, relative to its right-hand side.

        Raises:
            RuntimeError: The solver has gone on to another solution.
        """
        return self._solve(rhs, transposed=False, tolerance=tolerance)

    def adjoint(self, rows: Array, tolerance: float = ADJOINT) -> Array:
        """J^-T of one row, shape (n_y,), or of several, shape (k, n_y); arguments and errors as for `solve`."""
        return self._solve(rows, transposed=True, tolerance=tolerance)

    def _solve(self, rhs: Array, *, transposed: bool, tolerance: float) -> Array:
        if self.steady.linearised is not self:
            raise RuntimeError("the solver has gone on to another solution: the matrix of this one is lost")
        return self.steady.newton.linear_solve(rhs, transposed=transposed, tolerance=tolerance)

    @cached_property
    def residual(self) -> Array:
        """The residual at the solution, which Newton's method has left, shape (n_y,)."""
        return self.steady.residual_at(self.parameters, self.y)

    def residual_change(self, along: Callable[[float], Parameters]) -> Array:
        """Derivative dR/dtau along a line of parameters at fixed y, by a central difference, shape (n_y,).

        Args:
            along: Parameters as a function of tau, those of the solution at tau = 0; tau is of order one.
        """
        more, less = (self.steady.residual_at(along(tau), self.y) for tau in (DIFFERENCE, -DIFFERENCE))
        return (more - less) / (2 * DIFFERENCE)

    def tangent(self, along: Callable[[float], Parameters]) -> Array:
        """Derivative dy/dtau of the solution along a line of parameters, as for `residual_change`, shape (n_y,)."""
        return -self.solve(self.residual_change(along))

    @cached_property
    def gap_tangents(self) -> Array:
        """Derivatives of y with respect to each distance, shape (N-1, n_y)."""
        lines = [partial(self.parameters.with_longer_gap, i) for i in range(len(self.parameters.gaps))]
        changes = np.array([self.residual_change(line) for line in lines]).reshape(-1, len(self.y))
        return -self.solve(changes) if lines else changes
