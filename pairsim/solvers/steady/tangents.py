"""Derivatives of a quasi-steady solution with respect to its parameters."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.scene import SteadySolver

# Step of the central differences that approximate derivatives with respect to parameters. Chosen; sensitivities agree
# with neighbouring solutions to 1e-3.
DIFFERENCE = 1e-5


def residual_change(steady: SteadySolver, along: Callable[[float], Parameters]) -> Array:
    """Derivative dR/dtau at fixed y along a line of parameters by a central difference, shape (n_y,).

    Args:
        along: Parameters as a function of tau, the present ones at tau = 0; tau is of order one.
    """
    ends = []
    for tau in (DIFFERENCE, -DIFFERENCE):
        steady.apply(along(tau))
        ends.append(steady.newton.residual_at(steady.y))
    steady.apply(steady.parameters)
    return (ends[0] - ends[1]) / (2 * DIFFERENCE)


def tangent_along(steady: SteadySolver, along: Callable[[float], Parameters]) -> Array:
    """Derivative dy/dtau along a line of parameters, shape (n_y,); `SteadySolver.factor` must have been called."""
    return -steady.newton.linear_solve(residual_change(steady, along))


def gap_tangents(steady: SteadySolver) -> Array:
    """Derivatives of y with respect to each distance, shape (N-1, n_y); `SteadySolver.factor` must have been called."""
    at = steady.factored
    assert at is not None
    if at.gap_tangents is None:
        lines = [partial(steady.parameters.with_longer_gap, i) for i in range(len(steady.parameters.gaps))]
        changes = np.array([residual_change(steady, line) for line in lines]).reshape(-1, len(steady.y))
        at.gap_tangents = -steady.newton.linear_solve(changes) if lines else changes
    return at.gap_tangents
