"""What inertia does to the rates, to first order in the Reynolds number."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from pairsim.fem.azimuthal.inertia import inertia
from pairsim.fem.azimuthal.scene import mesh_velocity
from pairsim.runtime.arrays import Array
from pairsim.solvers.focus.rates import Displacement, scene_at

LEAST_RE, MOST_RE = 1e-6, 1e6  # between which a largest Reynolds number is looked for; chosen
DIFFERENCE = 1e-4  # of Re, for the derivative of the residual; for rigid particles in a Newtonian liquid exact


@dataclass(frozen=True)
class Inertia:
    """Derivatives with respect to Re = rho U_av D_c/eta_0 at Re = 0, of neutrally buoyant particles.

    Attributes:
        rates: Those of `Disturbance.rates` [U_av/D_c], shape (N, N).
        U: Those of the velocities on the axis [U_av], shape (N,).
    """

    rates: Array
    U: Array


def stable_up_to(rates: Array, by_Re: Array) -> float:
    """The smallest Reynolds number at which displacements of some kind do not decay, to first order in it.

    Args:
        rates: Rates without inertia, shape (N, N).
        by_Re: Their derivatives by the Reynolds number, shape (N, N).

    Returns:
        0 where they do not decay without inertia either, infinite where inertia does not prevent it.
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
    """Derivatives of the rates by the Reynolds number.

    The flow on the axis changes by one solve with the matrix at the solution. With that flow, and with inertia at a
    small Reynolds number, the disturbances leave a residual, whose derivative is a load on them.

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
