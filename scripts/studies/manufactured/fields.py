"""The fields of the manufactured solution and their sources, by symbolic differentiation.

The sources follow from the axisymmetric equations for c in the current configuration. Nothing in them shares a formula
with the forms of pairsim; UFL differentiates them, and numpy evaluates what it has found.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, Literal

import basix.ufl
import numpy as np
import ufl
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.classes import Cos, Division, Power, Product, ScalarValue, Sin, Sum, Variable, Zero

from pairsim.physics.liquids import single
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.runtime.arrays import Array

LIQUID = single(Giesekus(alpha=0.2), De=0.7, xi=0.3)
FRAME = 0.8  # velocity of the frame
Flow = Literal["general", "parabolic"]
"""Which solution: in the parabolic flow u is of degree two and p of degree one in place."""
type Field = Callable[[Array, float], Array]
"""Places (..., 2) and a time to values (..., components)."""

_DOMAIN = ufl.Mesh(basix.ufl.element("Lagrange", "triangle", 1, shape=(2,)))
_OPERATIONS: dict[type, Callable[..., Any]] = {
    Sum: lambda a, b: a + b,
    Product: lambda a, b: a * b,
    Division: lambda a, b: a / b,
    Power: lambda a, b: a**b,
    Sin: np.sin,
    Cos: np.cos,
}


@cache
def exact(flow: Flow) -> dict[str, Field]:
    """u, p, c, the derivatives of c by t, z and r, the force, and the source of c.

    The velocity is that of the stream function r^2 A, so that it is free of divergence; at the wall it has no radial
    component. On the axis all fields are smooth in three dimensions.
    """
    z, r, t = symbols = [ufl.variable(ufl.Constant(_DOMAIN)) for _ in range(3)]
    xi, De, alpha = LIQUID.xi, LIQUID.De, LIQUID.modes[0].numbers["alpha"]
    sin, cos, by = ufl.sin, ufl.cos, ufl.diff
    A = 1 + r**2 * (cos(t) - 1)
    p = 3 * z * cos(t)
    if flow == "general":
        A += (1 - 4 * r**2) * sin(3 * z + 2 * t) / 3
        p = 3 * cos(2 * z - t) * (1 + r**2)
    u = [2 * A + r * by(A, r), -r * by(A, z)]
    hoop_rate = -by(A, z)
    common = 0.8 + sin(2 * z + t) / 4  # c_rr and c_tt agree on the axis
    zz = 1 + cos(2 * z + 3 * t) / 2 + 8 * r**2 * (1 + sin(t) / 2)  # c is isotropic at places of the axis
    zr = r * (1 + cos(z + 2 * t)) / 2
    rr = common + r**2 * cos(z + t)
    tt = common + r**2 * sin(z - 2 * t)

    def material(f: Any) -> Any:
        return by(f, t) + (u[0] - FRAME) * by(f, z) + u[1] * by(f, r)

    c = [[zz, zr], [zr, rr]]
    L = [[by(component, x) for x in (z, r)] for component in u]
    e = [[zz - 1, zr], [zr, rr - 1]]  # c - 1

    def source(i: int, j: int) -> Any:
        stretching = sum(L[i][k] * c[k][j] + c[i][k] * L[j][k] for k in range(2))
        square = sum(e[i][k] * e[k][j] for k in range(2))
        return material(c[i][j]) - stretching + (e[i][j] + alpha * square) / De

    def sigma(i: int, j: int) -> Any:
        return xi * (L[i][j] + L[j][i]) + (1 - xi) / De * e[i][j] - (p if i == j else 0)

    source_tt = material(tt) - 2 * hoop_rate * tt + (tt - 1 + alpha * (tt - 1) ** 2) / De
    sigma_tt = 2 * xi * hoop_rate + (1 - xi) / De * (tt - 1) - p
    force = [
        -(by(sigma(0, 0), z) + by(sigma(0, 1), r) + sigma(0, 1) / r),
        -(by(sigma(1, 0), z) + by(sigma(1, 1), r) + (sigma(1, 1) - sigma_tt) / r),
    ]
    components = [zz, zr, rr, tt]
    formulas = {
        "u": u,
        "p": [p],
        "c": components,
        "c_t": [by(f, t) for f in components],
        "c_z": [by(f, z) for f in components],
        "c_r": [by(f, r) for f in components],
        "source": [source(0, 0), source(0, 1), source(1, 1), source_tt],
        "force": force,
    }
    return {name: _field(formula, symbols) for name, formula in formulas.items()}


def _field(formulas: Sequence[Any], symbols: Sequence[Any]) -> Field:
    """Formulas of z, r and t as a function of places and a time."""
    found = [apply_derivatives(apply_algebra_lowering(each)) for each in formulas]

    def field(x: Array, t: float) -> Array:
        values = dict(zip((each.label() for each in symbols), (x[..., 0], x[..., 1], t), strict=True))
        known: dict[Any, Any] = {}
        return np.stack([np.broadcast_to(_evaluated(each, values, known), x.shape[:-1]) for each in found], axis=-1)

    return field


def _evaluated(formula: Any, values: dict[Any, Any], known: dict[Any, Any]) -> Any:
    """The value of a formula; parts that it has twice are evaluated once."""
    if isinstance(formula, Zero):
        return 0.0
    if isinstance(formula, ScalarValue):
        return float(formula)
    if isinstance(formula, Variable):
        return values[formula.label()]
    if formula not in known:
        operands = [_evaluated(each, values, known) for each in formula.ufl_operands]
        known[formula] = _OPERATIONS[type(formula)](*operands)
    return known[formula]
