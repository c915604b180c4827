"""Quasi-steady scenes with one equation more, a place on a line of parameters being its unknown: zeros, arc length."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.runtime.signals import heed
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady import DIFFERENCE, Steady

MOST_BORDERED = 12
# The matrix in hand is kept once steps are below this.
FRESH_ABOVE = 1e-4


def solve_with(
    steady: Steady, along: Callable[[float], Parameters], tau: float, y: Array, row: Array, row_tau: float, value: float
) -> tuple[float | None, int]:
    """Solve for y and the place on a line of parameters together, with row . y + row_tau tau = value.

    Args:
        steady: The scene.
        along: The line.
        tau: First guess of the place.
        y: First guess of the unknowns.
        row, row_tau, value: The equation that is added; the matrix is bordered by it and never assembled, so
            that one factorisation serves and a fold of the scene's own equations does no harm.

    Returns:
        The place, None without convergence, and the number of iterations. On success the solution is the scene's.
    """
    newton = steady.newton
    heed(steady.comm)
    previous = np.inf
    steady.forget()
    for count in range(1, MOST_BORDERED + 1):
        there = along(tau)
        ends = []
        for change in (DIFFERENCE, -DIFFERENCE):
            steady.apply(along(tau + change))
            ends.append(newton.residual_at(y))
        steady.apply(there)
        if previous > FRESH_ABOVE:
            steady.factorisations += 1
            if not newton.factor_at(y):
                break
        a = newton.linear_solve(newton.residual_at(y))
        b = newton.linear_solve((ends[0] - ends[1]) / (2 * DIFFERENCE))
        step_tau = steady.comm.bcast(float((value - row @ y - row_tau * tau + row @ a) / (row_tau - row @ b)))
        if not np.isfinite(step_tau):
            break
        step = -a - b * step_tau
        y, tau = y + step, tau + step_tau
        steady.iterations += 1
        sizes = newton.scaled(step, y)
        largest = steady.comm.bcast(max([v for k, v in sizes.items() if k != "m"] + [abs(step_tau)]))
        if not np.isfinite(largest) or (count > 3 and largest > 2 * previous):
            break
        if largest < 10 * steady.problem.newton.tolerance:
            steady.apply(along(tau))
            if steady.distortion_of(*newton.state(y)) <= 0 or newton.overstretched(y):
                break
            steady.y, steady.parameters = y, along(tau)
            return tau, count
        previous = largest
    steady.apply(steady.parameters)
    newton.forget()
    return None, count
