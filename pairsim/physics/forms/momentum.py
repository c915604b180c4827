"""Balance of momentum without inertia, Eqs. (2) and (3)."""

from __future__ import annotations

import ufl

from pairsim.physics.kinematics import Expr, Kinematics


def momentum(kin: Kinematics, stress: tuple[Expr, Expr], p: Expr, v: Expr, dX: ufl.Measure) -> ufl.Form:
    """Virtual work of the total stress.

    Strong form: div(-p I + sigma) = 0. Weak form: int [(sigma - p I) : grad_x v + (sigma_tt - p) v_r/R] 2 pi R J dX,
    positive on the left; tractions on the boundary enter with a minus sign. At an interface the rows of both phases
    are added, which is the continuity of traction, Eq. (16).
    """
    sigma, hoop = stress
    work = ufl.inner(sigma, kin.grad(v)) + hoop * kin.hoop_rate(v) - p * kin.div(v)
    return work * kin.volume * dX
