"""Liquids in homogeneous flows: the conformation obeys an ordinary differential equation, or is steady in shear."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import scipy

from pairsim.physics.conformation import IDENTITY, mode_stress, polymer_stress, relaxation
from pairsim.physics.liquids import ConformationLaw, Liquid, single
from pairsim.runtime.arrays import Array

# Steady shear is found by continuation from slow shear; all of these were chosen.
FIRST_WEISSENBERG = 0.1
MOST_APART = 0.8  # largest step of the logarithm of the Weissenberg number
MOST_ITERATIONS = 20
NEAR = 0.1  # relative change of a parameter or a rate up to which the last solution is the first guess
# With a yield stress, steady shear is the state after shear from rest to this strain and for as many relaxation times.
STRAINS, TIMES = 20.0, 20.0


def shear(rate: float) -> Array:
    """Velocity gradient of simple shear."""
    return np.array([[0, rate, 0], [0, 0, 0], [0, 0, 0.0]])


def extension(rate: float) -> Array:
    """Velocity gradient of uniaxial extension."""
    return np.diag([rate, -rate / 2, -rate / 2])


def rate_of_change(liquid: Liquid, law: ConformationLaw, c: Any, L: Array) -> Array:
    """Rate of change of the conformation of a mode, L c + c L^T plus relaxation, shape (4, n).

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
        end: Duration of the flow [D_c/U_av].
    """

    def rate(_: float, c: Array) -> Array:
        modes = enumerate(liquid.modes)
        return np.concatenate([rate_of_change(liquid, law, c[4 * i : 4 * i + 4, None], L)[:, 0] for i, law in modes])

    start = np.tile(IDENTITY, len(liquid.modes))
    return np.asarray(scipy.integrate.solve_ivp(rate, (0, end), start, "LSODA", rtol=1e-11, atol=1e-13).y[:, -1])


def stress_after(liquid: Liquid, L: Array, end: float) -> Array:
    """The stress of all modes after a flow from rest [eta_0 U_av/D_c], components (zz, zr, rr, tt), shape (4,)."""
    return np.asarray(polymer_stress(liquid, conformation_after(liquid, L, end)[None])[0])


def steady_shear(liquid: Liquid, rates: Array, memory: ShearMemory | None = None) -> tuple[Array, Array]:
    """Viscosity and first normal stress difference in steady shear.

    Args:
        liquid: The liquid.
        rates: Shear rates [U_av/D_c], (n,).
        memory: Keeps the solution as a first guess for a similar liquid at similar rates; None: no first guess.

    Returns:
        Viscosity [eta_0], and N1 [eta_0 U_av/D_c], (n,) each.
    """
    viscosity = np.asarray(liquid.xi * liquid.solvent.viscosity(rates**2) * np.ones_like(rates), dtype=float)
    N1 = np.zeros_like(rates)
    for law, c in zip(liquid.modes, _sheared(liquid, rates, memory), strict=True):
        tau = mode_stress(liquid, law, c)
        viscosity = viscosity + np.real(tau[1]) / rates
        N1 = N1 + np.real(tau[0] - tau[2])
    return viscosity, N1


def normal_stresses(liquid: Liquid, rates: Array) -> tuple[Array, Array]:
    """First and second normal stress difference in steady shear [eta_0 U_av/D_c], (n,) each.

    Args:
        liquid: The liquid.
        rates: Shear rates [U_av/D_c], (n,).
    """
    N1, N2 = np.zeros_like(rates), np.zeros_like(rates)
    for law, c in zip(liquid.modes, _sheared(liquid, rates, None), strict=True):
        zz, _, rr, tt = np.real(mode_stress(liquid, law, c))
        N1, N2 = N1 + zz - rr, N2 + rr - tt
    return N1, N2


def falling_stress(liquid: Liquid, most: float) -> tuple[float, float] | None:
    """The shear rates [U_av/D_c] up to `most` between which the shear stress falls, None if it grows throughout.

    A flow at such rates may form shear bands: its steady state is not unique, or is not found.
    """
    rates, liquid = np.geomspace(1e-3 * most, most, 121), replace(liquid, yielding=None)  # tau_y adds a constant
    falls = np.flatnonzero(np.diff(rates * steady_shear(liquid, rates)[0]) < 0)
    return (float(rates[falls[0]]), float(rates[falls[-1] + 1])) if len(falls) else None


def _sheared(liquid: Liquid, rates: Array, memory: ShearMemory | None) -> list[Array]:
    """The conformations of all modes in steady shear, shape (4, n) each."""
    if liquid.yielding is not None:  # continuation from slow shear would begin where nothing relaxes
        ends = STRAINS / rates + TIMES * liquid.longest
        after = [conformation_after(liquid, shear(r), t) for r, t in zip(rates, ends, strict=True)]
        return np.split(np.array(after).T, len(liquid.modes))
    found: dict[int, Array] = {}
    alone = [replace(law, time=1.0, weight=1.0) for law in liquid.modes]
    for law in dict.fromkeys(alone):
        modes = [i for i, each in enumerate(alone) if each == law]  # they differ in relaxation time and weight alone
        Wi = np.concatenate([float(liquid.relaxation_time(liquid.modes[i])) * rates for i in modes])
        points = _Points(law, Wi, np.tile(rates**2, len(modes)))
        c = points.from_slow_rates() if memory is None else memory.solution(points, modes[0])
        found |= zip(modes, np.split(c, len(modes), axis=1), strict=True)
    return [found[i] for i in range(len(alone))]


class _Points:
    """Steady shear of a single mode at points with Weissenberg numbers and squares of shear rates, (n,) each.

    Rates of change of c have the relaxation time of each point as unit of time; `gamma2`, on which a law may depend,
    is in units of (U_av/D_c)^2.
    """

    def __init__(self, law: ConformationLaw, Wi: Array, gamma2: Array) -> None:
        self.law, self.Wi, self.gamma2 = law, Wi, gamma2
        self._liquid = single(law, 1.0)

    def from_slow_rates(self) -> Array:
        """The conformations, shape (4, n), by continuation from slow shear, where they are near equilibrium."""
        steps = np.log(np.maximum(self.Wi / FIRST_WEISSENBERG, 1.0)) / MOST_APART
        c = np.tile(IDENTITY[:, None], len(self.Wi))
        before = c
        for i in range(int(np.ceil(steps.max(initial=0.0))) + 1):
            active = steps > i - 1
            along, last = np.minimum(steps[active], i), np.minimum(steps[active], i - 1)
            ahead = (along - last) * (c - before)[:, active]  # extrapolated; the last step was a whole one
            before = c.copy()
            back = np.exp(MOST_APART * (along - steps[active])) if i else np.minimum(1, FIRST_WEISSENBERG / self.Wi)
            c[:, active] = self._newton(c[:, active] + ahead, active, back)[0]
        return c

    def near(self, c: Array) -> Array | None:
        """The conformations, from those at nearby points as first guess; None if Newton's method does not converge."""
        found, settled = self._newton(c, np.full(len(self.Wi), True), np.ones(len(self.Wi)))
        return found if settled and np.isfinite(found).all() else None

    def _newton(self, c: Array, active: Any, back: Array) -> tuple[Array, bool]:
        """Newton's method for some points at fractions of their rates.

        Args:
            c: First guess of the conformations, shape (4, m).
            active: Mask of these points, shape (n,).
            back: Fractions of their rates, shape (m,).

        Returns:
            The conformations, shape (4, m), and whether all have converged.
        """
        Wi, gamma2 = back * self.Wi[active], back**2 * self.gamma2[active]
        c, left = c.copy(), np.arange(len(Wi))
        with np.errstate(all="ignore"):
            for _ in range(MOST_ITERATIONS):
                at = c[:, left]
                value, slope = self._change(at, Wi[left], gamma2[left])
                step = np.linalg.solve(slope, -value.T[:, :, None])[:, :, 0].T
                c[:, left] = at + step
                left = left[~(np.abs(step).max(axis=0) <= 1e-9 * np.abs(c[:, left]).max(axis=0))]
                left = left[np.isfinite(c[:, left]).all(axis=0)]
                if not len(left):
                    break
        return c, not len(left)

    def _change(self, c: Array, Wi: Array, gamma2: Array) -> tuple[Array, Array]:
        """The rate of change of conformations, (4, m), and its Jacobian by complex steps, (m, 4, 4)."""
        h, m = 1e-30, len(Wi)
        columns = np.concatenate([c, *(c + 1j * h * unit[:, None] for unit in np.eye(4))], axis=1)
        _, zr, rr, _ = columns
        fast = np.tile(Wi, 5)
        turned = np.array([2 * fast * zr, fast * rr, np.zeros_like(zr), np.zeros_like(zr)])
        change = turned + relaxation(self._liquid, self.law, columns, np.tile(gamma2, 5))
        return np.real(change[:, :m]), np.imag(change[:, m:]).reshape(4, 4, m).transpose(2, 0, 1) / h


class ShearMemory:
    """The last solutions of steady shear for liquids each of which differs little from the one before, as in a fit.

    Newton's method starts from the last solution of a mode if Weissenberg numbers, shear rates and parameters of its
    law have changed by no more than a tenth.
    """

    def __init__(self) -> None:
        self._last: dict[int, tuple[_Points, Array]] = {}

    def solution(self, points: _Points, mode: int) -> Array:
        """The conformations of points of a mode, shape (4, n)."""
        c = None
        if mode in self._last:
            last, found = self._last[mode]
            if self._is_near(last, points):
                c = points.near(found)
        if c is None:
            c = points.from_slow_rates()
        self._last[mode] = points, c
        return c

    @staticmethod
    def _is_near(last: _Points, points: _Points) -> bool:
        if last.Wi.shape != points.Wi.shape or type(last.law) is not type(points.law):
            return False
        pairs = [(last.Wi, points.Wi), (last.gamma2, points.gamma2)]
        pairs += [(np.array(each), np.array(points.law.numbers[name])) for name, each in last.law.numbers.items()]
        return all(bool(np.all(np.abs(new - old) <= NEAR * np.abs(old))) for old, new in pairs)


def moduli(liquid: Liquid, frequency: Array) -> tuple[Array, Array]:
    """Storage and loss modulus [eta_0 U_av/D_c] at angular frequencies [U_av/D_c]; the solvent as in slow shear."""
    storage, loss = np.zeros_like(frequency), liquid.xi * liquid.solvent.viscosity(1e-12) * frequency
    for law in liquid.modes:
        x = frequency * liquid.relaxation_time(law)
        storage = storage + liquid.modulus(law) * x**2 / (1 + x**2)
        loss = loss + liquid.modulus(law) * x / (1 + x**2)
    return storage, loss
