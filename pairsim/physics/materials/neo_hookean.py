"""Incompressible neo-Hookean solid: the exact integral of the paper's Eq. (7) from a stress-free start."""

from __future__ import annotations

import ufl

from pairsim.physics.kinematics import Expr, Kinematics


def extra_stress(kin: Kinematics, Ca_e: Expr) -> tuple[Expr, Expr]:
    """Elastic stress (B - I)/Ca_e with B = F F^T, in units of eta_0 U_av/D_c.

    Returns:
        The (z, r) block and the hoop component ((R/r)^2 - 1)/Ca_e.
    """
    B = ufl.dot(kin.F, kin.F.T)
    return (B - ufl.Identity(2)) / Ca_e, (kin.hoop**2 - 1) / Ca_e
