"""Effect of inertia on the rates, to first order in the Reynolds number."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from pairsim.fem.azimuthal.inertia import inertia
from pairsim.fem.azimuthal.scene import mesh_velocity
from pairsim.runtime.arrays import Array
from pairsim.solvers.focus.rates import Displacement, scene_at

LEAST_RE, MOST_RE = 1e-6, 1e6  # range in which the largest stable Reynolds number is searched for; chosen
DIFFERENCE = 1e-4  # of Re, for the derivative of the residual; exact for rigid particles in a Newtonian liquid


@dataclass(frozen=True)
class Inertia:
    """Derivatives with respect to Re = rho U_av D_c/eta_0 at Re = 0, for neutrally buoyant particles.

    Attributes:
        rates: Derivatives of `Disturbance.rates` [U_av/D_c], shape (N, N).
        U: Derivatives of the velocities of the particles on the axis [U_av], shape (N,).
    """

    rates: Array
    U: Array


def stable_up_to(rates: Array, by_Re: Array) -> float:
    """The smallest Reynolds number at which some displacement does not decay, with rates to first order in it.

    Args:
        rates: Rates without inertia [U_av/D_c], shape (N, N).
        by_Re: Their derivatives with respect to the Reynolds number, shape (N, N).

    Returns:
        The number; 0 if some displacement does not decay without inertia, infinite if all decay up to `MOST_RE`.
    """

    def growth(Re: float) -> float:
        return float(np.linalg.eigvals(rates + Re * by_Re).real.max())

    if growth(0.0) >= 0:
        return 0.0
    there = LEAST_RE
    while growth(there) < 0:
        there *= 2
        if there > MOST_RE:
            return np.inf
    return float(brentq(growth, there / 2 if there > LEAST_RE else 0.0, there))


def by_inertia(displacement: Displacement) -> Inertia:
    """Derivatives of the rates and of the velocities with respect to the Reynolds number.

    The change of the axisymmetric flow follows from one solve with the matrix at the solution. With the changed flow,
    and inertia at a small Reynolds number, the disturbances have a residual, whose derivative is a load on them.

    Args:
        displacement: The displaced particles.

    Raises:
        ArithmeticError: Stresses and shapes do not follow the displacements.
    """
    steady, here = displacement.steady, displacement.scene
    linearised = steady.linearise()
    _, x = steady.state()
    place = steady.constraints.fields["U_p"]
    load = steady.constraints.T @ inertia(steady.scene, x, mesh_velocity(steady.scene, steady.y[place]))
    change = -linearised.solve(load)
    there = scene_at(steady, steady.y + DIFFERENCE * change, DIFFERENCE, like=here)
    y, rates = displacement.y, displacement.found.rates
    slope = (there.residual(y, rates) - here.residual(y, rates)) / DIFFERENCE
    by_Re = displacement.changed_by(slope)[here.constraints.lateral]
    return Inertia(by_Re, change[place])
