"""Matrix exponential c = exp(s) of the log-conformation in closed form, without eigenvectors.

In axisymmetric flow s consists of a (z, r) block and a hoop component; see "Log-conformation" in
docs/explanation/numerics.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import ufl

from pairsim.physics.kinematics import Expr

# Below this value of y the functions of y are evaluated by their series; it was chosen such that the first omitted term
# is below 1e-12.
SMALL = 0.05


def _piecewise(y: Expr, series: tuple[float, ...], function: Expr) -> Expr:
    """A smooth function of y, evaluated by its power series where y < SMALL.

    The closed formulas contain sqrt(y), whose derivative divides by zero at y = 0.

    Args:
        y: Argument, not negative.
        series: Coefficients of the power series, in ascending order.
        function: Closed formula, valid for y >= SMALL.
    """
    value: Expr = 0.0
    for coefficient in reversed(series):
        value = coefficient + y * value
    return ufl.conditional(ufl.lt(y, SMALL), value, function)


@dataclass(frozen=True)
class LogConformation:
    """s = log c with components (zz, zr, rr, tt).

    Attributes:
        block: The (z, r) block of s, a symmetric 2 x 2 matrix.
        hoop: The hoop component s_tt.
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
        """y = s' : s'/2 of the deviator s' in the plane, whose eigenvalues are plus and minus sqrt(y)."""
        return ufl.inner(self.deviator, self.deviator) / 2

    def exp(self, sign: int) -> tuple[Expr, Expr]:
        """exp(sign s), with sign 1 or -1: the (z, r) block and the hoop component."""
        root = ufl.sqrt(ufl.max_value(self.y, SMALL))
        cosh = _piecewise(self.y, (1, 1 / 2, 1 / 24, 1 / 720, 1 / 40320, 1 / 3628800), ufl.cosh(root))
        sinhc = _piecewise(self.y, (1, 1 / 6, 1 / 120, 1 / 5040, 1 / 362880, 1 / 39916800), ufl.sinh(root) / root)
        scale = ufl.exp(sign * ufl.tr(self.block) / 2)
        return scale * (cosh * ufl.Identity(2) + sign * sinhc * self.deviator), ufl.exp(sign * self.hoop)

    @property
    def stretch_factor(self) -> Expr:
        """theta(y) = (sqrt(y) coth(sqrt(y)) - 1)/y."""
        root = ufl.sqrt(ufl.max_value(self.y, SMALL))
        series = (1 / 3, -1 / 45, 2 / 945, -1 / 4725, 2 / 93555, -1382 / 638512875, 4 / 18243225)
        return _piecewise(self.y, series, (root * ufl.cosh(root) / ufl.sinh(root) - 1) / root**2)
