"""Evolution of the log-conformation, with streamline-upwind Petrov-Galerkin test functions."""

from __future__ import annotations

import ufl

from pairsim.physics.kinematics import Expr, Kinematics
from pairsim.physics.materials import polymer
from pairsim.physics.materials.log_conformation import LogConformation


def stress(name: polymer.Name, s: LogConformation, xi: Expr, De: Expr, L2: Expr) -> tuple[Expr, Expr]:
    """Polymer stress tau = (1 - xi)/De (F c - I): (z, r) block and hoop component."""
    c, hoop = s.exp(1)
    F = polymer.spring(name, ufl.tr(c) + hoop, L2)
    return (1 - xi) / De * (F * c - ufl.Identity(2)), (1 - xi) / De * (F * hoop - 1)


def relaxation(name: polymer.Name, s: LogConformation, alpha: Expr, epsilon: Expr, L2: Expr) -> tuple[Expr, Expr]:
    """f(s) = -c^-1 g(c) for De c_upper = -g(c): Y [c^-1 - F I - alpha (c - 2 I + c^-1)]."""
    (c, hoop), (inverse, inverse_hoop) = s.exp(1), s.exp(-1)
    trace = ufl.tr(c) + hoop
    Y, F = polymer.relaxation(name, trace, epsilon, ufl.exp), polymer.spring(name, trace, L2)
    identity = ufl.Identity(2)
    block = Y * (inverse - F * identity - alpha * (c - 2 * identity + inverse))
    return block, Y * (inverse_hoop - F - alpha * (hoop - 2 + inverse_hoop))


def residual(
    kin: Kinematics,
    s: LogConformation,
    rate: tuple[Expr, Expr],
    u: Expr,
    relaxed: tuple[Expr, Expr],
    De: Expr,
) -> tuple[Expr, Expr]:
    """Strong residual of s: Ds/Dt - (W s - s W) - 2 e - 2 h [y e' - (e : s') s'/2] - f/De, and its hoop component.

    Args:
        kin: Current configuration.
        s: Log-conformation.
        rate: Material derivative of s, block and hoop.
        u: Velocity.
        relaxed: f(s), block and hoop.
        De: Deborah number.
    """
    L = kin.grad(u)
    e, W = ufl.sym(L), ufl.skew(L)
    deviator, traceless = s.deviator, ufl.sym(L) - ufl.tr(L) / 2 * ufl.Identity(2)
    stretching = 2 * e + 2 * s.stretch_factor * (s.y * traceless - ufl.inner(e, deviator) / 2 * deviator)
    rotation = ufl.dot(W, s.block) - ufl.dot(s.block, W)
    return (
        rate[0] - rotation - stretching - relaxed[0] / De,
        rate[1] - 2 * kin.hoop_rate(u) - relaxed[1] / De,
    )


def upwind_time(mesh: ufl.Mesh, v: Expr, De: Expr, scale: float) -> Expr:
    """Intrinsic time of SUPG: scale h/(2 |v|), bounded by scale De; it knows nothing of the time step."""
    h = ufl.sqrt(abs(ufl.JacobianDeterminant(mesh)))
    return scale / ufl.sqrt(4 * ufl.inner(v, v) / h**2 + 1 / De**2)


def constitutive(
    kin: Kinematics, strong: tuple[Expr, Expr], test: Expr, v: Expr, time: Expr, dX: ufl.Measure
) -> ufl.Form:
    """Weak form: int (S + time v . grad_x S) : r 2 pi R J dX, all of the strong residual r in both parts."""
    upwinded = test + time * ufl.dot(kin.grad(test), v)
    S = LogConformation.of(upwinded)
    return (ufl.inner(S.block, strong[0]) + S.hoop * strong[1]) * kin.volume * dX
