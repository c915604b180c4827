"""Extension of the interface's displacement into the liquid."""

from __future__ import annotations

import ufl

from pairsim.physics.kinematics import Expr


def elastic_extension(mesh: ufl.Mesh, eta: Expr, xi: Expr, dX: ufl.Measure) -> ufl.Form:
    """A linear elastic operator in the half-plane, stiffer where cells are smaller.

    Weak form: int k [2 e(eta) : e(xi) + div eta div xi] dX with k the inverse of the cell area, so that the fine
    cells near the particles move almost rigidly and the coarse ones take up the deformation. It has no physical
    meaning; where the nodes of the liquid lie changes results only by the discretisation error.
    """
    stiffness = 1 / abs(ufl.JacobianDeterminant(mesh))
    strain = ufl.sym(ufl.grad(eta))
    return stiffness * (2 * ufl.inner(strain, ufl.sym(ufl.grad(xi))) + ufl.div(eta) * ufl.div(xi)) * dX
