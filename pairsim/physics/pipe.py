"""The flow without particles: start-up of a viscoelastic liquid in the tube at constant flow rate, in one dimension.

Given the polymer stress, the momentum balance xi u' + tau_rz = -G r/2 and the flow rate make u'(r) and the pressure
gradient G algebraic, so every radius is an ordinary differential equation and only G couples them. Gauss points in r
make the flow rate spectrally accurate.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.integrate import LSODA, OdeSolution, solve_ivp
from scipy.interpolate import barycentric_interpolate

from pairsim.physics.conformation import logarithm
from pairsim.physics.materials import polymer
from pairsim.physics.materials.polymer import Polymer
from pairsim.physics.scales import TUBE_RADIUS
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import NoSteadyState

OUT_OF_REACH = 1e9
IMAGINARY = 1e-30j
MOST_ITERATIONS = 10


@dataclass(frozen=True)
class PipeState:
    """The flow at one time.

    Attributes:
        gradient: Pressure drop by unit length.
        r: Radii, from the axis to the wall.
        u: Axial velocity at the radii.
        c: Conformation (zz, zr, rr, tt) at the radii, (n, 4).
    """

    gradient: float
    r: Array
    u: Array
    c: Array

    def profiles(self, r: Array) -> Array:
        """u and the four components of log c at other radii (n,), shape (5, n)."""
        return across(self.r, np.column_stack([self.u, logarithm(self.c)]), r).T


def across(radii: Array, values: Array, wanted: Array) -> Array:
    """Values (n,) or (n, k) at the points of a `Pipe`, carried to other radii.

    scipy takes the points in an order of chance, which changes the last digits from run to run: here it is always the
    same one.
    """
    return np.asarray(barycentric_interpolate(radii, values, wanted, rng=0))


class Pipe:
    """Start-up from rest stress at t = 0.

    Args:
        liquid: The polymer, or None for a Newtonian liquid.
        points: Gauss points in r.
    """

    def __init__(self, liquid: Polymer | None, points: int = 60) -> None:
        self.liquid = liquid
        x, w = np.polynomial.legendre.leggauss(points)
        self._inner = (x + 1) / 2 * TUBE_RADIUS
        weights = w / 2 * TUBE_RADIUS
        # The flow rate, -pi int r^2 u' dr = pi/4, gives the pressure gradient: xi by the one, less tau_rz by the other.
        by_gradient = weights @ (self._inner**3 / 2)
        self._of_solvent = 0.25 / by_gradient
        self._of_stress = np.concatenate([[0.0], weights * self._inner**2 / by_gradient, [0.0]])
        # The axis and the wall follow along without a say in the flow rate.
        self.r = np.concatenate([[0.0], self._inner, [TUBE_RADIUS]])

    def _stress(self, c: Array) -> Array:
        """tau_rz at the radii for conformations (4, n)."""
        liquid = self.liquid
        assert liquid is not None
        F = polymer.spring(liquid.name, c[0] + c[2] + c[3], liquid.L2)
        return np.asarray((1 - liquid.xi) / liquid.De * F * c[1])

    def _gradient(self, tau: Array) -> float:
        """The pressure gradient that keeps the flow rate."""
        assert self.liquid is not None
        return float(self.liquid.xi * self._of_solvent - self._of_stress @ tau)

    def _shear(self, tau: Array, G: Any) -> Array:
        """u'(r) by the momentum balance."""
        assert self.liquid is not None
        return np.asarray(-(G * self.r / 2 + tau) / self.liquid.xi)

    def _change(self, c: Array, shear: Array) -> Array:
        """dc/dt, (4, n), of a liquid that is sheared at given rates (n,)."""
        liquid = self.liquid
        assert liquid is not None
        zz, zr, rr, tt = c
        trace = zz + rr + tt
        Y = polymer.relaxation(liquid.name, trace, liquid.epsilon, np.exp)
        F = polymer.spring(liquid.name, trace, liquid.L2)
        square = np.array([(zz - 1) ** 2 + zr**2, zr * (zz + rr - 2), zr**2 + (rr - 1) ** 2, (tt - 1) ** 2])
        relax = Y / liquid.De * (F * c - np.array([[1.0], [0.0], [1.0], [1.0]]) + liquid.alpha * square)
        stretch = np.array([2 * shear * zr, shear * rr, np.zeros_like(rr), np.zeros_like(rr)])
        return np.asarray(stretch - relax)

    def _rate(self, _: float, flat: Array) -> Array:
        c = flat.reshape(4, -1)
        tau = self._stress(c)
        return self._change(c, self._shear(tau, self._gradient(tau))).ravel()

    def _jacobian(self, _: float, flat: Array) -> Array:
        """Derivatives of `_rate`: a radius depends on itself, and on the others through the pressure gradient alone.

        Exact, by steps in the imaginary direction: differences of 4 n rates cost nine tenths of a developed flow.
        """
        c = flat.reshape(4, -1)
        n = c.shape[1]
        G = self._gradient(self._stress(c))
        radius = np.arange(n)
        J, G_c = np.zeros((4, n, 4, n)), np.zeros((4, n))
        for k in range(4):
            moved = c.astype(complex)
            moved[k] += IMAGINARY
            tau = self._stress(moved)
            J[:, radius, k, radius] = self._change(moved, self._shear(tau, G)).imag / IMAGINARY.imag
            G_c[k] = -self._of_stress * tau.imag / IMAGINARY.imag
        c_G = self._change(c, self._shear(self._stress(c), G + IMAGINARY)).imag / IMAGINARY.imag
        return np.asarray(J.reshape(4 * n, 4 * n) + np.outer(c_G, G_c))

    @cached_property
    def _start(self) -> Array:
        n = len(self.r)
        return np.concatenate([np.ones(n), np.zeros(n), np.ones(n), np.ones(n)])

    def until(self, t_end: float) -> Callable[[float], PipeState]:
        """The flow as a function of time up to t_end; at earlier times it does not depend on t_end.

        Raises:
            RuntimeError: The integration failed.
        """
        if self.liquid is None:
            u = 2 * (1 - (self.r / TUBE_RADIUS) ** 2)
            still = PipeState(32.0, self.r, u, np.tile([1.0, 0.0, 1.0, 1.0], (len(self.r), 1)))
            return lambda _: still
        # LSODA chooses its first step by the end it is told of and cuts the last one there. It is told of one that is
        # out of reach and left where t_end is passed: a run whose end time is raised later sees the same flow.
        far = max(OUT_OF_REACH, 2 * t_end)
        solver = LSODA(self._rate, 0.0, self._start, far, rtol=1e-9, atol=1e-11, jac=self._jacobian)
        times, pieces = [0.0], []
        while solver.t < t_end:
            message = solver.step()
            if solver.status == "failed":
                raise RuntimeError(message)
            times.append(solver.t)
            pieces.append(solver.dense_output())
        solution = OdeSolution(times, pieces)
        return lambda t: self._state(solution(t).reshape(4, -1))

    def steady(self, near: PipeState | None = None) -> PipeState:
        """The fully developed flow.

        Args:
            near: That of a liquid which is all but the same.

        Raises:
            NoSteadyState: It was not found: where stress falls with the shear rate it has layers.
        """
        if self.liquid is None:
            return self.until(0.0)(0.0)
        if near is not None:
            c = near.c.T.ravel()
        else:
            # Close to it in time first, which chooses the stable one, then all the way.
            end = 15 * self.liquid.De
            done = solve_ivp(self._rate, (0.0, end), self._start, "LSODA", rtol=1e-4, atol=1e-6, jac=self._jacobian)
            if not done.success:
                raise NoSteadyState(f"no developed flow at De = {self.liquid.De:g}: {done.message}")
            c = done.y[:, -1]
        with suppress(np.linalg.LinAlgError):  # what is left of dc/dt tells
            for _ in range(MOST_ITERATIONS):
                step = np.linalg.solve(self._jacobian(0.0, c), self._rate(0.0, c))
                c = c - step
                if np.abs(step).max() <= 1e-13 * np.abs(c).max():
                    break
        left = np.abs(self._rate(0.0, c)).max()
        if not left <= 1e-8 * np.abs(c).max() / self.liquid.De:
            what = f"no developed flow at De = {self.liquid.De:g}: dc/dt = {left:.2g} is left"
            raise NoSteadyState(what, advice="a larger xi: where stress falls with the shear rate, layers form")
        return self._state(c.reshape(4, -1))

    def _state(self, c: Array) -> PipeState:
        tau = self._stress(c)
        G = self._gradient(tau)
        shear = self._shear(tau, G)
        # u = -int_r^R u' dr through the interpolating polynomial of the Gauss points.
        series = np.polynomial.legendre.Legendre.fit(
            self._inner, shear[1:-1], len(self._inner) - 1, domain=[0, TUBE_RADIUS]
        )
        primitive = series.integ()
        return PipeState(G, self.r, primitive(self.r) - primitive(TUBE_RADIUS), c.T.copy())
