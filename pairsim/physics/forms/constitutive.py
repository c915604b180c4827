"""Evolution of the log-conformation, stabilised by streamline-upwind Petrov-Galerkin (SUPG) test functions.

Equations and references (Fattal and Kupferman 2004; Hulsen, Fattal and Kupferman 2005; Brooks and Hughes 1982) are in
"Log-conformation", docs/explanation/numerics.md.
"""

from __future__ import annotations

import ufl

from pairsim.physics.forms.extra_stress import invariants
from pairsim.physics.kinematics import Expr, Kinematics
from pairsim.physics.liquids import ConformationLaw, Liquid
from pairsim.physics.log_conformation import LogConformation


def relaxation(kin: Kinematics, s: LogConformation, u: Expr, liquid: Liquid, law: ConformationLaw) -> tuple[Expr, Expr]:
    """Relaxation term of the equation of s = log c.

    A law De (upper-convected derivative of c) = -g(c) with g = g_0 I + g_1 c + g_2 c^2 relaxes s at the rate f(s)/De,

        f(s) = -c^-1 g(c) = -(g_0 c^-1 + g_1 I + g_2 c).

    Returns:
        The (z, r) block and the hoop component of f(s).
    """
    (c, hoop), (inverse, inverse_hoop) = s.exp(1), s.exp(-1)
    g0, g1, g2 = liquid.relaxation(law, invariants(kin, (c, hoop), u))
    return -(g0 * inverse + g1 * ufl.Identity(2) + g2 * c), -(g0 * inverse_hoop + g1 + g2 * hoop)


def residual(
    kin: Kinematics,
    s: LogConformation,
    rate: tuple[Expr, Expr],
    u: Expr,
    relaxed: tuple[Expr, Expr],
    De: Expr,
) -> tuple[Expr, Expr]:
    """Strong residual of the equation of s = log c.

    In the (z, r) plane, with the symmetric part e and the skew part W of the velocity gradient and deviators s' and e',

        r = Ds/Dt - (W s - s W) - 2 e - 2 theta(y) [y e' - (e : s') s'/2] - f/De,    y = s' : s'/2,

    and r_tt = Ds_tt/Dt - 2 u_r/R - f_tt/De in the hoop direction.

    Args:
        kin: Current configuration.
        s: Log-conformation.
        rate: Material derivative Ds/Dt, block and hoop component.
        u: Velocity.
        relaxed: f(s) from `relaxation`, block and hoop component.
        De: Relaxation time of the mode.

    Returns:
        The (z, r) block and the hoop component of r.
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
    """Stabilisation parameter of SUPG, tau = scale [(2 |v|/h)^2 + 1/De^2]^(-1/2) (Shakib, Hughes and Johan 1991).

    It does not contain the time step, so that time-dependent and quasi-steady solutions have the same discretisation.

    Args:
        mesh: Reference domain; h is the square root of twice the area of a cell of it (of the determinant of the map
            from the reference triangle), and does not follow the deformation of the mesh.
        v: Velocity relative to the mesh.
        De: Relaxation time of the mode.
        scale: Dimensionless factor.
    """
    h = ufl.sqrt(abs(ufl.JacobianDeterminant(mesh)))
    return scale / ufl.sqrt(4 * ufl.inner(v, v) / h**2 + 1 / De**2)


def constitutive(
    kin: Kinematics, strong: tuple[Expr, Expr], test: Expr, v: Expr, time: Expr, dX: ufl.Measure
) -> ufl.Form:
    """Weak form of the equation of s: int (S + time v . grad_x S) : r 2 pi R J dX.

    Args:
        kin: Current configuration.
        strong: Strong residual r from `residual`, block and hoop component.
        test: Test function S with components (zz, zr, rr, tt).
        v: Velocity relative to the mesh.
        time: Stabilisation parameter from `upwind_time`.
        dX: Measure on the reference domain.
    """
    upwinded = test + time * ufl.dot(kin.grad(test), v)
    S = LogConformation.of(upwinded)
    return (ufl.inner(S.block, strong[0]) + S.hoop * strong[1]) * kin.volume * dX
