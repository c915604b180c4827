"""Liquids in homogeneous flows: the conformation obeys an ordinary differential equation."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from pairsim.physics.conformation import IDENTITY, polymer_stress, relaxation
from pairsim.physics.liquids import Liquid
from pairsim.runtime.arrays import Array


def conformation_after(liquid: Liquid, L: Array, end: float) -> Array:
    """The conformations of all modes after a flow from rest, components (zz, zr, rr, tt) of each, shape (4 M,).

    Args:
        liquid: The liquid.
        L: Velocity gradient, L_ij = du_i/dx_j with (z, r, theta) as Cartesian directions [U_av/D_c], shape (3, 3).
        end: How long it flows [D_c/U_av].
    """
    gamma2 = np.array([np.sum((L + L.T) ** 2) / 2])

    def rate(_: float, flat: Array) -> Array:
        changes = []
        for i, law in enumerate(liquid.modes):
            zz, zr, rr, tt = flat[4 * i : 4 * i + 4]
            c = np.array([[zz, zr, 0], [zr, rr, 0], [0, 0, tt]])
            stretched = L @ c + c @ L.T
            relaxed = relaxation(liquid, law, flat[4 * i : 4 * i + 4, None], gamma2)[:, 0]
            changes.append(stretched[[0, 0, 1, 2], [0, 1, 1, 2]] + relaxed)
        return np.concatenate(changes)

    start = np.tile(IDENTITY, len(liquid.modes))
    return np.asarray(solve_ivp(rate, (0, end), start, "LSODA", rtol=1e-11, atol=1e-13).y[:, -1])


def stress_after(liquid: Liquid, L: Array, end: float) -> Array:
    """The stress of all modes after a flow from rest [eta_0 U_av/D_c], components (zz, zr, rr, tt), shape (4,)."""
    return np.asarray(polymer_stress(liquid, conformation_after(liquid, L, end)[None])[0])


def shear(rate: float) -> Array:
    """Velocity gradient of simple shear."""
    return np.array([[0, rate, 0], [0, 0, 0], [0, 0, 0.0]])


def extension(rate: float) -> Array:
    """Velocity gradient of uniaxial extension."""
    return np.diag([rate, -rate / 2, -rate / 2])
