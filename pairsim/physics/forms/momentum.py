"""Momentum balance without inertia, Eqs. (2) and (3) of the paper."""

from __future__ import annotations

import ufl

from pairsim.physics.kinematics import Expr, Kinematics


def momentum(kin: Kinematics, stress: tuple[Expr, Expr], p: Expr, v: Expr, dX: ufl.Measure) -> ufl.Form:
    """Virtual work of the total stress.

    Strong form: div(-p I + sigma) = 0.
    Weak form: int [(sigma - p I) : grad_x v + (sigma_tt - p) v_r/R] 2 pi R J dX - (virtual work of boundary tractions)
    = 0. At an interface the equations of liquid and solid for the same node are added, which imposes continuity of
    traction weakly, Eq. (16) of the paper.

    Args:
        kin: Current configuration.
        stress: Extra stress sigma, (z, r) block and hoop component.
        p: Pressure.
        v: Test function.
        dX: Measure on the reference domain.
    """
    sigma, hoop = stress
    work = ufl.inner(sigma, kin.grad(v)) + hoop * kin.hoop_rate(v) - p * kin.div(v)
    return work * kin.volume * dX
