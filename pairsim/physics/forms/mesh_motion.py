"""Displacement of the liquid's mesh: extension of the displacement of the interfaces into the liquid."""

from __future__ import annotations

import ufl

from pairsim.physics.kinematics import Expr


def elastic_extension(mesh: ufl.Mesh, eta: Expr, xi: Expr, dX: ufl.Measure) -> ufl.Form:
    """Linear elastic extension with Jacobian-based stiffening (Johnson and Tezduyar 1994).

    Weak form: int k [2 e(eta) : e(xi) + div eta div xi] dX in the half-plane, with a stiffness k proportional to the
    inverse of the area of the cell in the reference domain: the small cells near the particles move almost rigidly, and
    the large ones take up the deformation. The positions of the liquid's nodes affect the solution only through the
    discretisation error.

    Args:
        mesh: Mesh of the liquid.
        eta: Displacement of the mesh.
        xi: Test function.
        dX: Measure on the reference domain.
    """
    stiffness = 1 / abs(ufl.JacobianDeterminant(mesh))
    strain = ufl.sym(ufl.grad(eta))
    return stiffness * (2 * ufl.inner(strain, ufl.sym(ufl.grad(xi))) + ufl.div(eta) * ufl.div(xi)) * dX
