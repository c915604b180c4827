"""Extra stresses in UFL by the laws of liquids and solids, in units of eta_0 U_av/D_c.

Each function returns the (z, r) block and the hoop component.
"""

from __future__ import annotations

import ufl

from pairsim.physics.kinematics import Expr, Kinematics
from pairsim.physics.liquids.conformation import ConformationLaw, Invariants
from pairsim.physics.liquids.liquid import Liquid
from pairsim.physics.liquids.viscous import LEAST_RATE
from pairsim.physics.log_conformation import LogConformation
from pairsim.physics.solids import Solid


def gamma2(kin: Kinematics, u: Expr) -> Expr:
    """Square of the shear rate, 2 e : e, plus the square of `LEAST_RATE` for laws without a viscosity at rest."""
    e = ufl.sym(kin.grad(u))
    return 2 * (ufl.inner(e, e) + kin.hoop_rate(u) ** 2) + LEAST_RATE**2


def viscous(kin: Kinematics, u: Expr, viscosity: Expr) -> tuple[Expr, Expr]:
    """Viscous stress 2 eta e(u), Eq. (4) of the paper without the polymer stress.

    Args:
        kin: Current configuration.
        u: Velocity (z, r).
        viscosity: eta/eta_0.
    """
    return 2 * viscosity * ufl.sym(kin.grad(u)), 2 * viscosity * kin.hoop_rate(u)


def solvent(kin: Kinematics, u: Expr, liquid: Liquid, *state: Expr) -> tuple[Expr, Expr]:
    """Stress of the solvent, 2 xi eta(gamma, state) e(u), with the scalars on which its law depends."""
    return viscous(kin, u, liquid.xi * liquid.solvent.viscosity_at(gamma2(kin, u), *state))


def invariants(kin: Kinematics, c: tuple[Expr, Expr], u: Expr) -> Invariants:
    """Invariants of the conformation, given as block and hoop component, and the shear rate."""
    block, hoop = c
    return Invariants(ufl.tr(block) + hoop, ufl.inner(block, block) + hoop**2, gamma2(kin, u))


def mode(kin: Kinematics, s: LogConformation, u: Expr, liquid: Liquid, law: ConformationLaw) -> tuple[Expr, Expr]:
    """Stress of a mode of the polymer, G (h_0 I + h_1 c)."""
    c, hoop = s.exp(1)
    h0, h1 = law.stress(invariants(kin, (c, hoop), u))
    G = liquid.modulus(law)
    return G * (h1 * c + h0 * ufl.Identity(2)), G * (h1 * hoop + h0)


def elastic(kin: Kinematics, solid: Solid) -> tuple[Expr, Expr]:
    """Elastic stress of a solid at its deformation."""
    B = ufl.dot(kin.F, kin.F.T)
    zz, zr, rr, tt = solid.stress((B[0, 0], B[0, 1], B[1, 1], kin.hoop**2))
    return ufl.as_matrix([[zz, zr], [zr, rr]]), tt
