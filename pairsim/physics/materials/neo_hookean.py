"""Incompressible neo-Hookean solid: the exact time integral of Eq. (7) of the paper from a stress-free state."""

from __future__ import annotations

import ufl

from pairsim.physics.kinematics import Expr, Kinematics


def extra_stress(kin: Kinematics, Ca_e: Expr) -> tuple[Expr, Expr]:
    """Elastic stress (B - I)/Ca_e with B = F F^T, in units of eta_0 U_av/D_c.

    Args:
        kin: Current configuration.
        Ca_e: Elastic capillary number.

    Returns:
        The (z, r) block and the hoop component ((R/r)^2 - 1)/Ca_e.
    """
    B = ufl.dot(kin.F, kin.F.T)
    return (B - ufl.Identity(2)) / Ca_e, (kin.hoop**2 - 1) / Ca_e
