"""c = exp(s) without eigenvectors: the (z, r) block in closed form, the hoop component on its own."""

from __future__ import annotations

from dataclasses import dataclass

import ufl

from pairsim.physics.kinematics import Expr

# Below this the functions of y are taken from their series, whose next terms are below 1e-12 there.
SMALL = 0.05


def _piecewise(y: Expr, series: tuple[float, ...], function: Expr) -> Expr:
    """A smooth function of y = x^2 that its formula cannot give near 0 (its derivative would divide by zero)."""
    value: Expr = 0.0
    for coefficient in reversed(series):
        value = coefficient + y * value
    return ufl.conditional(ufl.lt(y, SMALL), value, function)


@dataclass(frozen=True)
class LogConformation:
    """s = log c with components (zz, zr, rr, tt).

    Attributes:
        block: The (z, r) block of s.
        hoop: s_tt.
    """

    block: Expr
    hoop: Expr

    @staticmethod
    def of(s: Expr) -> LogConformation:
        return LogConformation(ufl.as_matrix([[s[0], s[1]], [s[1], s[2]]]), s[3])

    @property
    def deviator(self) -> Expr:
        return self.block - ufl.tr(self.block) / 2 * ufl.Identity(2)

    @property
    def y(self) -> Expr:
        """Half the square of the deviator; plus and minus its root are the deviator's eigenvalues."""
        return ufl.inner(self.deviator, self.deviator) / 2

    def exp(self, sign: int) -> tuple[Expr, Expr]:
        """exp(sign s) as its (z, r) block and its hoop component."""
        root = ufl.sqrt(ufl.max_value(self.y, SMALL))
        cosh = _piecewise(self.y, (1, 1 / 2, 1 / 24, 1 / 720, 1 / 40320, 1 / 3628800), ufl.cosh(root))
        sinhc = _piecewise(self.y, (1, 1 / 6, 1 / 120, 1 / 5040, 1 / 362880, 1 / 39916800), ufl.sinh(root) / root)
        scale = ufl.exp(sign * ufl.tr(self.block) / 2)
        return scale * (cosh * ufl.Identity(2) + sign * sinhc * self.deviator), ufl.exp(sign * self.hoop)

    @property
    def stretch_factor(self) -> Expr:
        """h(y) = (x coth x - 1)/x^2, x^2 = y."""
        root = ufl.sqrt(ufl.max_value(self.y, SMALL))
        series = (1 / 3, -1 / 45, 2 / 945, -1 / 4725, 2 / 93555, -1382 / 638512875, 4 / 18243225)
        return _piecewise(self.y, series, (root * ufl.cosh(root) / ufl.sinh(root) - 1) / root**2)
