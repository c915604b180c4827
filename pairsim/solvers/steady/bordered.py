"""Bordered systems: a quasi-steady scene with one additional equation, and a parameter as additional unknown.

The additional equation prescribes dU, as at a critical distance; see "Zeros and bordered systems" in
docs/explanation/numerics.md.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.parameters import DIFFERENCE, Parameters
from pairsim.solvers.steady.scene import SteadySolver

# Chosen; steps are relative to the fields.
MOST_ITERATIONS = 12
TOLERANCE = 1e-8  # of the last step
FRESH_ABOVE = 1e-4  # step below which the factorised matrix is reused


def solve_with(
    steady: SteadySolver, along: Callable[[float], Parameters], tau: float, y: Array, row: Array, value: float
) -> float | None:
    """Solve for y and the coordinate tau on a line of parameters, with the additional equation row . y = value.

    The bordered matrix is not assembled: each iteration solves for two right-hand sides with the factors of the scene's
    own matrix.

    Args:
        steady: The scene. On success it is left at the solution, otherwise at its previous parameters.
        along: Parameters as a function of tau.
        tau: First guess of tau.
        y: First guess of the unknowns, shape (n_y,).
        row: Coefficients of y in the additional equation, shape (n_y,).
        value: Right-hand side of the additional equation.

    Returns:
        The solution tau, or None if the iteration did not converge.
    """
    newton = steady.newton
    steady.problem.monitor.check()
    previous = np.inf
    steady.forget()
    for count in range(1, MOST_ITERATIONS + 1):
        there = along(tau)
        more, less = (steady.residual_at(along(tau + change), y) for change in (DIFFERENCE, -DIFFERENCE))
        with steady.changed_to(there) as update:
            if previous > FRESH_ABOVE:
                steady.factorisations += 1
                if not newton.factor_at(y, update):
                    break
            a, b = newton.linear_solve(np.array([newton.residual_at(y, update), (more - less) / (2 * DIFFERENCE)]))
        with np.errstate(divide="ignore", invalid="ignore"):
            step_tau = float((row @ y - value - row @ a) / (row @ b))
        if not np.isfinite(step_tau):
            break
        step = -a - b * step_tau
        y, tau = y + step, tau + step_tau
        steady.iterations += 1
        sizes = newton.scaled(step, y)
        largest = max([v for k, v in sizes.items() if k != "m"] + [abs(step_tau)])
        if not np.isfinite(largest) or (count > 3 and largest > 2 * previous):
            break
        if largest < TOLERANCE:
            with steady.changed_to(along(tau)) as update:
                if steady.distortion_of(*steady.constraints.state(y, update)) <= 0 or newton.overstretched(y, update):
                    break
                steady.y, steady.parameters = y, along(tau)
            return tau
        previous = largest
    newton.forget()
    return None
