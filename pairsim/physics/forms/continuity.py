"""Conservation of mass: div u = 0 in the liquid, J R/r = 1 in a solid."""

from __future__ import annotations

import ufl

from pairsim.physics.kinematics import Expr, Kinematics


def liquid(kin: Kinematics, u: Expr, q: Expr, dX: ufl.Measure) -> ufl.Form:
    """Continuity of the liquid, Eq. (1): -int q div_x u 2 pi R J dX (the transpose of the pressure's work)."""
    return -q * kin.div(u) * kin.volume * dX


def solid(kin: Kinematics, q: Expr, dX: ufl.Measure) -> ufl.Form:
    """Incompressibility of a solid: -int q (J R/r - 1) 2 pi r dX; q = 1 keeps the particle's volume exactly."""
    return -q * (kin.J * kin.hoop - 1) * kin.reference_volume * dX
