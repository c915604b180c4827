"""Liquids in homogeneous flows: the conformation obeys an ordinary differential equation, or is steady in shear."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import scipy

from pairsim.physics.conformation import IDENTITY, mode_stress, polymer_stress, relaxation
from pairsim.physics.liquids import ConformationLaw, Liquid, single
from pairsim.runtime.arrays import Array

# Steady shear is followed from slow rates on; all were chosen.
FIRST_WEISSENBERG = 0.1
MOST_APART = 0.8  # largest step of the logarithm of the Weissenberg number
MOST_ITERATIONS = 20
STRAINS, TIMES = 20.0, 20.0  # of shear from rest with a yield stress; the second in relaxation times


def shear(rate: float) -> Array:
    """Velocity gradient of simple shear."""
    return np.array([[0, rate, 0], [0, 0, 0], [0, 0, 0.0]])


def extension(rate: float) -> Array:
    """Velocity gradient of uniaxial extension."""
    return np.diag([rate, -rate / 2, -rate / 2])


def rate_of_change(liquid: Liquid, law: ConformationLaw, c: Any, L: Array) -> Array:
    """Rate of change of the conformation of a mode, L c + c L^T and what relaxes, shape (4, n).

    Args:
        liquid: The liquid.
        law: One of its modes.
        c: Its conformation, real or complex, components (zz, zr, rr, tt) first, shape (4, n).
        L: Velocity gradient, L_ij = du_i/dx_j with (z, r, theta) as Cartesian directions [U_av/D_c], shape (3, 3).
    """
    (a, b, _), (d, e, _), (_, _, f) = L
    zz, zr, rr, tt = c
    stretched = np.array([2 * (a * zz + b * zr), d * zz + (a + e) * zr + b * rr, 2 * (d * zr + e * rr), 2 * f * tt])
    return np.asarray(stretched + relaxation(liquid, law, c, np.full(len(tt), np.sum((L + L.T) ** 2) / 2)))


def conformation_after(liquid: Liquid, L: Array, end: float) -> Array:
    """The conformations of all modes after a flow from rest, components (zz, zr, rr, tt) of each, shape (4 M,).

    Args:
        liquid: The liquid.
        L: Velocity gradient, as in `rate_of_change`.
        end: How long it flows [D_c/U_av].
    """

    def rate(_: float, c: Array) -> Array:
        modes = enumerate(liquid.modes)
        return np.concatenate([rate_of_change(liquid, law, c[4 * i : 4 * i + 4, None], L)[:, 0] for i, law in modes])

    start = np.tile(IDENTITY, len(liquid.modes))
    return np.asarray(scipy.integrate.solve_ivp(rate, (0, end), start, "LSODA", rtol=1e-11, atol=1e-13).y[:, -1])


def stress_after(liquid: Liquid, L: Array, end: float) -> Array:
    """The stress of all modes after a flow from rest [eta_0 U_av/D_c], components (zz, zr, rr, tt), shape (4,)."""
    return np.asarray(polymer_stress(liquid, conformation_after(liquid, L, end)[None])[0])


def steady_shear(liquid: Liquid, rates: Array) -> tuple[Array, Array]:
    """Viscosity and first normal stress difference over eta_0 in steady shear.

    Args:
        liquid: The liquid.
        rates: Shear rates [U_av/D_c], (n,).

    Returns:
        Viscosity over eta_0, and N1 over eta_0 U_av/D_c, (n,) each.
    """
    viscosity = np.asarray(liquid.xi * liquid.solvent.viscosity(rates**2) * np.ones_like(rates), dtype=float)
    N1 = np.zeros_like(rates)
    for law in liquid.modes:
        tau = mode_stress(liquid, law, _sheared(liquid, law, rates))
        viscosity = viscosity + np.real(tau[1]) / rates
        N1 = N1 + np.real(tau[0] - tau[2])
    return viscosity, N1


def falling_stress(liquid: Liquid, most: float) -> tuple[float, float] | None:
    """The shear rates [U_av/D_c] up to `most` between which the shear stress falls, None if it grows all the way.

    A flow at such rates may form shear bands: its steady state is not unique, or is not found.
    """
    rates, liquid = np.geomspace(1e-3 * most, most, 121), replace(liquid, yielding=None)  # tau_y adds to it
    falls = np.flatnonzero(np.diff(rates * steady_shear(liquid, rates)[0]) < 0)
    return (float(rates[falls[0]]), float(rates[falls[-1] + 1])) if len(falls) else None


def _sheared(liquid: Liquid, law: ConformationLaw, rates: Array) -> Array:
    """The conformation of a mode in steady shear, shape (4, n)."""
    if liquid.yielding is not None:  # Newton's method from slow rates would begin where nothing relaxes
        ends = STRAINS / rates + TIMES * liquid.longest
        return np.array([conformation_after(liquid, shear(r), t) for r, t in zip(rates, ends, strict=True)]).T
    alone = replace(law, time=1.0, weight=1.0)
    found = _alone_in_shear(alone, float(liquid.relaxation_time(law)), tuple(np.sort(rates).tolist()))
    return found[:, np.argsort(np.argsort(rates))]


@lru_cache(maxsize=64)
def _alone_in_shear(law: ConformationLaw, time: float, rates: tuple[float, ...]) -> Array:
    """The conformation of a lone mode at ascending shear rates, (4, n), by Newton's method along them."""
    liquid, last = single(law, time), np.log(FIRST_WEISSENBERG / time)
    c, before, found = IDENTITY.copy(), IDENTITY.copy(), []
    for rate in np.log(rates):
        steps = max(int(np.ceil((rate - last) / MOST_APART)), 1)
        for log_rate in np.linspace(last, rate, steps + 1)[1:]:
            c, before = _steady(liquid, law, 2 * c - before, float(np.exp(log_rate))), c
        last = max(rate, last)
        found.append(c)
    return np.array(found).T


def _steady(liquid: Liquid, law: ConformationLaw, c: Array, rate: float) -> Array:
    """The steady conformation at a shear rate, shape (4,), from a guess; derivatives by complex steps."""
    h, unit = 1e-30, np.concatenate([np.zeros((4, 1)), np.eye(4)], axis=1)
    for _ in range(MOST_ITERATIONS):
        change = rate_of_change(liquid, law, c[:, None] + 1j * h * unit, shear(rate))
        step = np.linalg.solve(np.imag(change[:, 1:]) / h, -np.real(change[:, 0]))
        c = c + step
        if np.abs(step).max() <= 1e-9 * np.abs(c).max():
            break
    return c


def moduli(liquid: Liquid, frequency: Array) -> tuple[Array, Array]:
    """Storage and loss modulus over eta_0 U_av/D_c of small oscillations; the solvent has its viscosity at rest."""
    storage, loss = np.zeros_like(frequency), liquid.xi * liquid.solvent.viscosity(1e-12) * frequency
    for law in liquid.modes:
        x = frequency * liquid.relaxation_time(law)
        storage = storage + liquid.modulus(law) * x**2 / (1 + x**2)
        loss = loss + liquid.modulus(law) * x / (1 + x**2)
    return storage, loss
