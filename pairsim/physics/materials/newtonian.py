"""Newtonian liquid: extra stress 2 mu e(u), Eq. (4) of the paper without the polymer stress."""

from __future__ import annotations

import ufl

from pairsim.physics.kinematics import Expr, Kinematics


def extra_stress(kin: Kinematics, u: Expr, viscosity: float) -> tuple[Expr, Expr]:
    """Viscous stress in units of eta_0 U_av/D_c.

    Args:
        kin: Current configuration.
        u: Velocity (z, r).
        viscosity: Viscosity mu divided by eta_0: 1 for a Newtonian liquid, xi for the solvent of a viscoelastic one.

    Returns:
        The (z, r) block 2 mu e(u) and the hoop component 2 mu u_r/R.
    """
    return 2 * viscosity * ufl.sym(kin.grad(u)), 2 * viscosity * kin.hoop_rate(u)
