"""Vector and tensor calculus in cylindrical components (z, r, theta) for fields that depend on the angle theta.

A disturbed field is f_0 + epsilon f_1 with an axisymmetric f_0 and f_1 proportional to cos theta or sin theta. A weak
form of first order in epsilon with a test function of the same kind has an integrand A cos^2 theta + B sin^2 theta,
whose integral over theta is pi times the sum of its values at the two angles `ANGLES`. A field is therefore given by
its components in a half-plane, and by their derivatives with respect to theta there.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any

import ufl

Expr = Any  # UFL expressions carry no useful static type

# d e_j/d theta = e_i TURN[i, j]: e_r turns into e_theta, and e_theta into -e_r.
TURN = ufl.as_matrix([[0, 0, 0], [0, 0, -1], [0, 1, 0]])


@dataclass(frozen=True)
class Angle:
    """A half-plane: cosine and sine of its angle."""

    cos: int
    sin: int


ANGLES = (Angle(1, 0), Angle(0, 1))
"""Half-planes at which integrands are added up."""


@dataclass(frozen=True)
class Section:
    """A scalar, vector or symmetric tensor in a half-plane.

    Attributes:
        value: Its components.
        by_theta: Derivatives of the components with respect to theta, the basis vectors being constant.
    """

    value: Expr
    by_theta: Expr

    def __add__(self, other: Section) -> Section:
        return Section(self.value + other.value, self.by_theta + other.by_theta)

    def __sub__(self, other: Section) -> Section:
        return Section(self.value - other.value, self.by_theta - other.by_theta)

    def times(self, factor: Expr) -> Section:
        """The product with a factor that does not depend on theta."""
        return Section(factor * self.value, factor * self.by_theta)


def _cosine(f: Expr, at: Angle) -> tuple[Expr, Expr]:
    return at.cos * f, -at.sin * f


def _sine(f: Expr, at: Angle) -> tuple[Expr, Expr]:
    return at.sin * f, at.cos * f


def scalar(f: Expr, at: Angle) -> Section:
    """The scalar f cos theta."""
    return Section(*_cosine(f, at))


def vector(f: Expr, at: Angle) -> Section:
    """The vector (f_0 cos theta, f_1 cos theta, f_2 sin theta)."""
    parts = [_cosine(f[0], at), _cosine(f[1], at), _sine(f[2], at)]
    return Section(*(ufl.as_vector([part[i] for part in parts]) for i in range(2)))


def tensor(f: Expr, at: Angle) -> Section:
    """The symmetric tensor with zz, zr, rr, tt = f_0 to f_3 times cos theta, and zt, rt = f_4, f_5 times sin theta."""
    parts = [_cosine(f[i], at) for i in range(4)] + [_sine(f[i], at) for i in (4, 5)]
    return Section(*(symmetric([part[i] for part in parts]) for i in range(2)))


def symmetric(f: Any) -> Expr:
    """The symmetric matrix with components zz, zr, rr, tt, zt, rt."""
    zz, zr, rr, tt, zt, rt = f
    return ufl.as_matrix([[zz, zr, zt], [zr, rr, rt], [zt, rt, tt]])


def axisymmetric_scalar(f: Expr) -> Section:
    """An axisymmetric scalar."""
    return Section(f, 0 * f)


def axisymmetric_vector(f: Expr) -> Section:
    """The axisymmetric vector without swirl (f_0, f_1, 0)."""
    return Section(ufl.as_vector([f[0], f[1], 0]), ufl.as_vector([0, 0, 0]))


def axisymmetric_tensor(block: Expr, hoop: Expr) -> Section:
    """The axisymmetric tensor with a (z, r) block and a hoop component."""
    value = ufl.as_matrix([[block[0, 0], block[0, 1], 0], [block[1, 0], block[1, 1], 0], [0, 0, hoop]])
    return Section(value, 0 * value)


def identity() -> Section:
    """The unit tensor."""
    return axisymmetric_tensor(ufl.Identity(2), 1)


def grad(v: Section, r: Expr) -> Expr:
    """Gradient of a vector, L_ij = e_i . d v/d x_j, shape (3, 3).

    Args:
        v: The vector.
        r: Radius.
    """
    plane, turned = ufl.grad(v.value), (v.by_theta + ufl.dot(TURN, v.value)) / r
    return ufl.as_matrix([[plane[i, 0], plane[i, 1], turned[i]] for i in range(3)])


def slope(f: Section, r: Expr) -> Expr:
    """Gradient of a scalar, shape (3,).

    Args:
        f: The scalar.
        r: Radius.
    """
    # At 90 degrees f cos theta is UFL's zero, of which it cannot take the gradient.
    plane = (0, 0) if isinstance(f.value, ufl.constantvalue.Zero) else ufl.grad(f.value)
    return ufl.as_vector([plane[0], plane[1], f.by_theta / r])


def along(b: Expr, T: Section, r: Expr) -> Expr:
    """The derivative b . grad T of a tensor along a vector, shape (3, 3).

    Args:
        b: Components of the vector.
        T: The tensor.
        r: Radius.
    """
    plane = ufl.grad(T.value)
    turned = T.by_theta + ufl.dot(TURN, T.value) - ufl.dot(T.value, TURN)
    i, j = ufl.indices(2)
    in_plane = ufl.as_matrix(b[0] * plane[i, j, 0] + b[1] * plane[i, j, 1], (i, j))
    return in_plane + b[2] / r * turned


@dataclass(frozen=True)
class Kinematics:
    """The map from the undisturbed to the disturbed configuration, to first order in its gradient.

    Weak forms are differentiated at displacement 0, so that terms of second order can be omitted.

    Attributes:
        H: Gradient of the displacement eta, shape (3, 3).
        r: Radius in the undisturbed configuration.
    """

    H: Expr
    r: Expr

    @staticmethod
    def of(eta: Section, r: Expr) -> Kinematics:
        """Kinematics of a displacement."""
        return Kinematics(grad(eta, r), r)

    @property
    def inverse(self) -> Expr:
        """Inverse of the deformation gradient I + H."""
        return ufl.Identity(3) - self.H

    @property
    def J(self) -> Expr:
        """Determinant of the deformation gradient."""
        return 1 + ufl.tr(self.H)

    @property
    def volume(self) -> Expr:
        """Disturbed volume per unit undisturbed area of the half-plane: the weight of one of the two `ANGLES`."""
        return pi * self.r * self.J

    def grad(self, v: Section) -> Expr:
        """Gradient of a vector with respect to the disturbed position."""
        return ufl.dot(grad(v, self.r), self.inverse)

    def slope_along(self, b: Expr, f: Section) -> Expr:
        """The derivative of a scalar along a vector with respect to the disturbed position."""
        return ufl.dot(slope(f, self.r), ufl.dot(self.inverse, b))

    def along(self, b: Expr, T: Section) -> Expr:
        """The derivative of a tensor along a vector with respect to the disturbed position."""
        return along(ufl.dot(self.inverse, b), T, self.r)
