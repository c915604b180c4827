"""Transport of an advected scalar, Dl/Dt = f, stabilised by SUPG as the log-conformation is."""

from __future__ import annotations

import ufl

from pairsim.physics.kinematics import Expr, Kinematics


def scalar(kin: Kinematics, strong: Expr, test: Expr, v: Expr, time: Expr, dX: ufl.Measure) -> ufl.Form:
    """Weak form int (t + time v . grad_x t) (Dl/Dt - f) 2 pi R J dX.

    Args:
        kin: Current configuration.
        strong: Strong residual Dl/Dt - f.
        test: Test function t.
        v: Velocity relative to the mesh.
        time: Stabilisation parameter from `pairsim.physics.forms.constitutive.upwind_time`.
        dX: Measure on the reference domain.
    """
    return (test + time * ufl.dot(kin.grad(test), v)) * strong * kin.volume * dX
