"""Sensitivities of a quasi-steady solution to its parameters.

See "Sensitivities" in docs/explanation/numerics.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.adjoints import Adjoints
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.scene import SteadySolver
from pairsim.solvers.steady.tangents import residual_change


def sensitivities(steady: SteadySolver, adjoints: Adjoints) -> dict[str, Array]:
    """Derivatives of dU at held distances with respect to Ca_e, De and beta, by the adjoint.

    If the values of the particles differ, their ratios are fixed and the derivative is with respect to the largest
    value. One adjoint for each velocity gives the derivatives with respect to all parameters (Giles and Pierce 2000).

    Args:
        steady: The scene, at a solution.
        adjoints: The adjoints of the solution.

    Returns:
        Derivatives by name of the parameter, shape (N-1,) each: "beta", and "Ca_e" and "De" if they are not zero.
    """
    now = steady.parameters
    lines: dict[str, tuple[float, Callable[[float], Parameters]]] = {}
    if any(now.Ca_es):
        lines["Ca_e"] = max(now.Ca_es), lambda tau: now.softer(1 + tau)
    if now.liquid.modes:
        lines["De"] = now.De, lambda tau: now.with_De(now.De * (1 + tau))
    lines["beta"] = max(steady.problem.betas), lambda tau: replace(now, size=now.size * (1 + tau))
    changes = {name: residual_change(steady, line) / value for name, (value, line) in lines.items()}
    return {name: np.asarray(np.diff(-adjoints.velocities @ change)) for name, change in changes.items()}
