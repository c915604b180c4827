"""Conformation tensor at nodes, in numpy: matrix exponential and logarithm, polymer stress.

Tensors have the components (zz, zr, rr, tt) of axisymmetric flow without swirl; see "Log-conformation" in
docs/explanation/numerics.md.
"""

from __future__ import annotations

import numpy as np

from pairsim.physics.materials import polymer
from pairsim.physics.materials.polymer import Polymer
from pairsim.runtime.arrays import Array


def exponential(s: Array) -> Array:
    """Matrix exponential c = exp(s).

    Args:
        s: Log-conformation, components (zz, zr, rr, tt), shape (n, 4).

    Returns:
        Conformation, shape (n, 4).
    """
    mean, half = (s[:, 0] + s[:, 2]) / 2, (s[:, 0] - s[:, 2]) / 2
    x = np.hypot(half, s[:, 1])
    sinhc = np.where(x > 1e-8, np.sinh(x) / np.where(x > 1e-8, x, 1.0), 1.0)
    scale, cosh = np.exp(mean), np.cosh(x)
    return np.column_stack(
        [scale * (cosh + sinhc * half), scale * sinhc * s[:, 1], scale * (cosh - sinhc * half), np.exp(s[:, 3])]
    )


def logarithm(c: Array) -> Array:
    """Matrix logarithm s = log c.

    Args:
        c: Conformation, positive definite, components (zz, zr, rr, tt), shape (n, 4).

    Returns:
        Log-conformation, shape (n, 4).
    """
    mean, half = (c[:, 0] + c[:, 2]) / 2, (c[:, 0] - c[:, 2]) / 2
    x = np.hypot(half, c[:, 1])
    high, low = np.log(mean + x), np.log(mean - x)
    slope = np.where(x > 1e-12, (high - low) / np.where(x > 1e-12, 2 * x, 1.0), 1 / mean)
    middle = (high + low) / 2
    return np.column_stack([middle + slope * half, slope * c[:, 1], middle - slope * half, np.log(c[:, 3])])


def polymer_stress(liquid: Polymer, c: Array) -> Array:
    """Polymer stress tau = (1 - xi)/De (F c - I).

    Args:
        liquid: The polymer.
        c: Conformation, components (zz, zr, rr, tt), shape (n, 4).

    Returns:
        Stress in units of eta_0 U_av/D_c, shape (n, 4).
    """
    F = polymer.spring(liquid.name, c[:, 0] + c[:, 2] + c[:, 3], liquid.L2)
    return np.asarray((1 - liquid.xi) / liquid.De * ((F * c.T).T - [1.0, 0.0, 1.0, 1.0]))


def trace_of(liquid: Polymer, tau: Array) -> Array:
    """tr c from the polymer's stress tau (zz, zr, rr, tt): the inverse of `polymer_stress`, (n, 4) -> (n,)."""
    stretch = liquid.De / (1 - liquid.xi) * (tau[:, 0] + tau[:, 2] + tau[:, 3])  # F tr c - 3
    return np.asarray((stretch + 3) * liquid.L2 / (liquid.L2 + stretch) if liquid.name == "fene-p" else stretch + 3)
