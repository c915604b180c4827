"""Effect of the regularisation of a yield stress on the results of a quasi-steady solution, and on a time step.

The stress of a liquid that yields is rounded off at its kink, over a relative width of 1/m. Once m is large enough, a
result J approaches its value without regularisation as 1/m (Frigaard and Nouar, J. Non-Newtonian Fluid Mech. 127, 1,
2005), and the remaining error is |dJ/d ln m|. Exactly it is

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

# For a result that approaches its limit as m^(-2/3): ratio of its error to its derivative with respect to ln m, and of
# the integral above to its integrand. Most results approach it as 1/m; the creep of locked pairs fell with exponents of
# .74 and more between decades of m.
SLOWEST = 1.5
STEP = 0.05  # of ln m, for second differences; chosen


def by_regularisation(at: Linearisation, adjoints: Array, apart: Array) -> Array:
    """First and second derivatives of functionals with respect to the logarithm of the regularisation m, (2, k).

    They are zero in liquids without regularisation. Functionals are taken as linear in the solution, which those of
    shapes nearly are.

    Args:
        at: The solution.
        adjoints: Adjoint solutions of the functionals, (k, n_y).
        apart: `Functional.apart` of each functional, (k,) [D_c].
    """
    if not at.parameters.liquid.regularisation:
        return np.zeros((2, len(adjoints)))

    def sharper(tau: float) -> Parameters:
        return at.parameters.less_regularised(math.exp(tau))

    change = at.residual_change(sharper)
    tangent = -at.solve(change)
    # Along this tangent the residual is 0 to first order; the adjoints weight its part of second order.
    ends = [at.steady.residual_at(sharper(tau), at.y + tau * tangent) for tau in (STEP, 0.0, -STEP)]
    found = -np.array([adjoints @ change, adjoints @ (ends[0] - 2 * ends[1] + ends[2]) / STEP**2])
    more, less = (_gradient(at.steady, sharper(tau)) for tau in (DIFFERENCE, -DIFFERENCE))
    found[0] -= apart * (more - less) / (2 * DIFFERENCE)
    more, here, less = (_gradient(at.steady, sharper(tau)) for tau in (STEP, 0.0, -STEP))
    found[1] -= apart * (more - 2 * here + less) / STEP**2
    return found


def _gradient(steady: SteadySolver, parameters: Parameters) -> float:
    """Pressure drop per length of the flow without particles [eta_0 U_av/D_c^2]."""
    return steady.flows.at(parameters.liquid).gradient


def left_by_regularisation(derivatives: Array) -> Array:
    """epsilon_y, the half-widths due to the regularisation m, (k,), from first and second derivatives by ln m, (2, k).

    The second derivative matters where results do not vary as 1/m yet, as where unyielded liquid is about to hold a
    gap: the first derivative may vanish there although the results are far from their limits.
    """
    first, second = derivatives
    return np.asarray(np.maximum(SLOWEST * np.abs(first), np.abs(first) + SLOWEST * np.abs(first + second)))


def by_sharpness(newton: Newton, y: Array, update: PositionUpdate) -> Array:
    """Effect of the rounded kink of the stress on the residual of a time step, dR/d ln m or -dR/d ln width, (n_y,).

    It is zero in liquids without a kink.
    """
    phase, ends = newton.scene.liquid, list[Array]()
    liquid = phase.material
    if not (liquid.regularisation or liquid.yielding):
        return np.zeros_like(y)
    for tau in (DIFFERENCE, -DIFFERENCE):
        with phase.changed_to(liquid.sharper(math.exp(tau))):
            ends.append(newton.residual_at(y, update))
    return (ends[0] - ends[1]) / (2 * DIFFERENCE)
