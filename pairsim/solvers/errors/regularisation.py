"""What a regularisation does to the results of a quasi-steady solution, and to a time step.

The stress of a liquid that yields is rounded off within a part of 1/m of its kink, and results J approach those without
as 1/m (Frigaard and Nouar, J. Non-Newtonian Fluid Mech. 127, 1, 2005), once m is large enough: then what is left is
|dJ/d ln m|. Exactly it is

    J(infinity) - J = dJ/d ln m + int_m^infinity (dJ/d ln m + d2J/d ln m2) d ln m,

whose integrand vanishes where J goes as 1/m, and is known at m.
"""

from __future__ import annotations

import math

import numpy as np

from pairsim.fem.algebra.constraints import PositionUpdate
from pairsim.runtime.arrays import Array
from pairsim.solvers.nonlinear.newton import Newton
from pairsim.solvers.parameters import DIFFERENCE, Parameters
from pairsim.solvers.steady.linearisation import Linearisation
from pairsim.solvers.steady.scene import SteadySolver

# What is left of a result that approaches its limit as m^(-2/3), over its derivative by ln m, and the integral above
# over its integrand; most do so as 1/m. Between decades of m the creep of locked pairs fell with exponents from .74 on.
SLOWEST = 1.5
STEP = 0.05  # of ln m, for second differences; chosen


def by_regularisation(at: Linearisation, adjoints: Array, apart: Array) -> Array:
    """First and second derivatives of functionals by the logarithm of the regularisation m, (2, k).

    They are zeros in liquids without one. Functionals are taken as linear in the solution: those of shapes are nearly.

    Args:
        at: The solution.
        adjoints: Adjoint solutions of the functionals, (k, n_y).
        apart: Lengths over which the pressure drop of the flow without particles is subtracted from each, (k,) [D_c].
    """
    if not at.parameters.liquid.regularisation:
        return np.zeros((2, len(adjoints)))

    def sharper(tau: float) -> Parameters:
        return at.parameters.less_regularised(math.exp(tau))

    change = at.residual_change(sharper)
    tangent = -at.solve(change)
    # Along this tangent the residual is 0 to first order: the adjoints weigh what is left to second order.
    ends = [at.steady.residual_at(sharper(tau), at.y + tau * tangent) for tau in (STEP, 0.0, -STEP)]
    found = -np.array([adjoints @ change, adjoints @ (ends[0] - 2 * ends[1] + ends[2]) / STEP**2])
    more, less = (_gradient(at.steady, sharper(tau)) for tau in (DIFFERENCE, -DIFFERENCE))
    found[0] -= apart * (more - less) / (2 * DIFFERENCE)
    more, here, less = (_gradient(at.steady, sharper(tau)) for tau in (STEP, 0.0, -STEP))
    found[1] -= apart * (more - 2 * here + less) / STEP**2
    return found


def _gradient(steady: SteadySolver, parameters: Parameters) -> float:
    """The pressure gradient without particles."""
    return steady.flows.at(parameters.liquid).gradient


def left_by_regularisation(derivatives: Array) -> Array:
    """epsilon_y, half-widths by the regularisation m, from first and second derivatives by ln m, (2, k); shape (k,).

    The second one counts where results do not go as 1/m yet, as where a gap is about to be held by unyielded liquid:
    there the first one may vanish while they are far from their limit.
    """
    first, second = derivatives
    return np.asarray(np.maximum(SLOWEST * np.abs(first), np.abs(first) + SLOWEST * np.abs(first + second)))


def by_sharpness(newton: Newton, y: Array, update: PositionUpdate) -> Array:
    """What a sharp kink of the stress adds to the residual of a time step: dR/d ln m, or -dR/d ln width, (n_y,)."""
    phase, ends = newton.scene.liquid, list[Array]()
    liquid = phase.material
    if not (liquid.regularisation or liquid.yielding):
        return np.zeros_like(y)
    for tau in (DIFFERENCE, -DIFFERENCE):
        with phase.changed_to(liquid.sharper(math.exp(tau))):
            ends.append(newton.residual_at(y, update))
    return (ends[0] - ends[1]) / (2 * DIFFERENCE)
