"""Conformation tensors at nodes, in numpy: matrix exponential and logarithm, stress and relaxation of the modes.

Tensors have the components (zz, zr, rr, tt) of axisymmetric flow without swirl, those of M modes one after the other;
see "Log-conformation" in docs/explanation/numerics.md.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pairsim.physics.liquids import ConformationLaw, Liquid
from pairsim.physics.liquids.conformation import Invariants
from pairsim.runtime.arrays import Array

IDENTITY = np.array([1.0, 0.0, 1.0, 1.0])


def exponential(s: Array) -> Array:
    """Matrix exponentials c = exp(s).

    Args:
        s: Log-conformations, shape (n, 4 M).

    Returns:
        Conformations, shape (n, 4 M).
    """
    zz, zr, rr, tt = _components(s)
    mean, half = (zz + rr) / 2, (zz - rr) / 2
    x = np.hypot(half, zr)
    sinhc = np.where(x > 1e-8, np.sinh(x) / np.where(x > 1e-8, x, 1.0), 1.0)
    scale, cosh = np.exp(mean), np.cosh(x)
    parts = [scale * (cosh + sinhc * half), scale * sinhc * zr, scale * (cosh - sinhc * half), np.exp(tt)]
    return np.stack(parts, axis=2).reshape(s.shape)


def logarithm(c: Array) -> Array:
    """Matrix logarithms s = log c.

    Args:
        c: Conformations, positive definite, shape (n, 4 M).

    Returns:
        Log-conformations, shape (n, 4 M).
    """
    zz, zr, rr, tt = _components(c)
    mean, half = (zz + rr) / 2, (zz - rr) / 2
    x = np.hypot(half, zr)
    high, low = np.log(mean + x), np.log(mean - x)
    slope = np.where(x > 1e-12, (high - low) / np.where(x > 1e-12, 2 * x, 1.0), 1 / mean)
    middle = (high + low) / 2
    return np.stack([middle + slope * half, slope * zr, middle - slope * half, np.log(tt)], axis=2).reshape(c.shape)


def _components(tensors: Array) -> Array:
    """The four components of the tensors of all modes, shape (4, n, M)."""
    return np.moveaxis(tensors.reshape(len(tensors), -1, 4), 2, 0)


def trace(c: Array) -> Array:
    """tr c of each mode, (n, 4 M) -> (n, M)."""
    zz, _, rr, tt = _components(c)
    return np.asarray(zz + rr + tt)


def mode_stress(liquid: Liquid, law: ConformationLaw, c: Array) -> Array:
    """Stress of a mode, G (h_0 I + h_1 c), in units of eta_0 U_av/D_c, shape (4, n).

    Args:
        liquid: The liquid.
        law: One of its modes.
        c: Its conformation, real or complex, components first, shape (4, n).
    """
    h0, h1 = law.stress(_invariants(c, 1.0))
    return np.asarray(liquid.modulus(law) * (h1 * c + h0 * IDENTITY[:, None]))


def magnitude(liquid: Liquid, c: Array) -> Array:
    """Magnitude of the deviatoric stress of the first mode, `Liquid.magnitude`, shape (n,).

    Args:
        liquid: The liquid.
        c: Conformations of its modes, shape (n, 4 M).
    """
    return np.asarray(liquid.magnitude(liquid.modes[0], _invariants(c[:, :4].T, 1.0)))


def relaxation(liquid: Liquid, law: ConformationLaw, c: Any, gamma2: Array) -> Array:
    """Rate of change of the conformation of a mode by relaxation, -(g_0 I + g_1 c + g_2 c^2)/De, shape (4, n).

    Args:
        liquid: The liquid.
        law: One of its modes.
        c: Its conformation, real or complex, components first, shape (4, n).
        gamma2: Square of the shear rate, shape (n,).
    """
    zz, zr, rr, tt = c
    square = np.array([zz**2 + zr**2, zr * (zz + rr), zr**2 + rr**2, tt**2])
    g0, g1, g2 = liquid.relaxation(law, _invariants(c, gamma2))
    return np.asarray(-(g0 * IDENTITY[:, None] + g1 * c + g2 * square) / liquid.relaxation_time(law))


def _invariants(c: Array, gamma2: Array | float) -> Invariants:
    zz, zr, rr, tt = c
    return Invariants(zz + rr + tt, zz**2 + 2 * zr**2 + rr**2 + tt**2, gamma2)


def polymer_stress(liquid: Liquid, c: Array) -> Array:
    """Stress of all modes, in units of eta_0 U_av/D_c.

    Args:
        liquid: The liquid.
        c: Conformations of its modes, shape (n, 4 M).

    Returns:
        Components zz, zr, rr, tt, shape (n, 4).
    """
    parts = [mode_stress(liquid, law, c[:, 4 * i : 4 * i + 4].T) for i, law in enumerate(liquid.modes)]
    return np.asarray(sum(parts, np.zeros((4, len(c)))).T)
