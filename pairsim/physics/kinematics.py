"""Axisymmetric kinematics on a fixed reference mesh.

Coordinates are x[0] = z along the tube and x[1] = r. The current position is x = X + eta(X), with the displacement eta
of the solid's material or of the liquid's mesh; see "Formulation" in docs/explanation/numerics.md. Volume elements
contain the factor 2 pi; forms do not repeat it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any

import ufl

Expr = Any  # UFL expressions carry no useful static type


@dataclass(frozen=True)
class Kinematics:
    """The map from the reference to the current configuration.

    Attributes:
        F: Deformation gradient in the (z, r) plane, I + grad eta.
        J: det F.
        r: Reference radius.
        R: Current radius r + eta_r.
    """

    F: Expr
    J: Expr
    r: Expr
    R: Expr

    @staticmethod
    def of(mesh: ufl.Mesh, eta: Expr | None) -> Kinematics:
        """Kinematics for the displacement eta, or of the reference domain itself if eta is None."""
        r = ufl.SpatialCoordinate(mesh)[1]
        if eta is None:
            return Kinematics(ufl.Identity(2), ufl.as_ufl(1.0), r, r)
        F = ufl.Identity(2) + ufl.grad(eta)
        return Kinematics(F, ufl.det(F), r, r + eta[1])

    @property
    def hoop(self) -> Expr:
        """Hoop stretch R/r."""
        return self.R / self.r

    @property
    def volume(self) -> Expr:
        """Current volume per unit reference area, 2 pi R J."""
        return 2 * pi * self.R * self.J

    @property
    def reference_volume(self) -> Expr:
        """Reference volume per unit reference area, 2 pi r."""
        return 2 * pi * self.r

    def grad(self, v: Expr) -> Expr:
        """Gradient with respect to the current position, L_ij = d v_i / d x_j."""
        F = self.F
        if isinstance(F, ufl.constantvalue.Identity):
            return ufl.grad(v)
        inverse = ufl.as_matrix([[F[1, 1], -F[0, 1]], [-F[1, 0], F[0, 0]]]) / self.J
        return ufl.dot(ufl.grad(v), inverse)

    def hoop_rate(self, v: Expr) -> Expr:
        """Hoop component of the gradient of a vector field, v_r / R."""
        return v[1] / self.R

    def div(self, v: Expr) -> Expr:
        """Divergence of a vector field in the current configuration."""
        return ufl.tr(self.grad(v)) + self.hoop_rate(v)
