"""What a regularisation does to the results of a quasi-steady solution, and to a time step.

The stress of a liquid that yields is rounded off within a part of 1/m of its kink, and results approach those without
as 1/m (Frigaard and Nouar, J. Non-Newtonian Fluid Mech. 127, 1, 2005): what is left is as large as dJ/d ln m.
"""

from __future__ import annotations

import math

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.nonlinear.newton import Newton
from pairsim.solvers.steady.scene import SteadySolver
from pairsim.solvers.steady.tangents import DIFFERENCE, residual_change


def by_regularisation(steady: SteadySolver, adjoints: Array, apart: float) -> Array:
    """Derivatives of functionals by the logarithm of the regularisation, (k,); zeros in liquids without one.

    Args:
        steady: The solution.
        adjoints: Adjoint solutions of the functionals, the last of which is the pressure drop, (k, n_y).
        apart: Length over which the pressure drop of the flow without particles is subtracted from that one [D_c].
    """
    if not steady.parameters.liquid.regularisation:
        return np.zeros(len(adjoints))
    found = -adjoints @ residual_change(steady, lambda tau: steady.parameters.less_regularised(math.exp(tau)))
    liquids = (steady.parameters.less_regularised(math.exp(tau)).liquid for tau in (DIFFERENCE, -DIFFERENCE))
    more, less = (steady.flows.at(liquid).gradient for liquid in liquids)
    found[-1] -= apart * (more - less) / (2 * DIFFERENCE)
    return np.asarray(found)


def by_sharpness(newton: Newton, y: Array) -> Array:
    """What a sharp kink of the stress adds to the residual of a time step: dR/d ln m, or -dR/d ln width, (n_y,)."""
    phase, ends = newton.scene.liquid, list[Array]()
    liquid = phase.material
    if not (liquid.regularisation or liquid.yielding):
        return np.zeros_like(y)
    for tau in (DIFFERENCE, -DIFFERENCE):
        phase.become(liquid.sharper(math.exp(tau)))
        ends.append(newton.residual_at(y))
    phase.become(liquid)
    return (ends[0] - ends[1]) / (2 * DIFFERENCE)
