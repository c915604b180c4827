"""Conservation of mass: div u = 0 in the liquid, J R/r = 1 in a solid."""

from __future__ import annotations

import ufl

from pairsim.physics.kinematics import Expr, Kinematics


def liquid(kin: Kinematics, u: Expr, q: Expr, dX: ufl.Measure) -> ufl.Form:
    """Continuity of the liquid, div u = 0, Eq. (1) of the paper.

    Weak form: -int q div_x u 2 pi R J dX. The sign makes it the transpose of the pressure term of `momentum`.
    """
    return -q * kin.div(u) * kin.volume * dX


def solid(kin: Kinematics, q: Expr, dX: ufl.Measure) -> ufl.Form:
    """Incompressibility of a solid, J R/r = 1.

    Weak form: -int q (J R/r - 1) 2 pi r dX. With the constant test function q = 1 it conserves the total volume of a
    particle, to the tolerance of Newton's method.
    """
    return -q * expansion(kin) * kin.reference_volume * dX


def expansion(kin: Kinematics) -> Expr:
    """Relative change of volume in a solid, J R/r - 1, zero up to the error of discretisation."""
    return kin.J * kin.hoop - 1
