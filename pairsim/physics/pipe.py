"""Flow without particles: start-up of tube flow of a viscoelastic liquid at constant flow rate, in one dimension.

For a given polymer stress the momentum balance xi u' + tau_rz = -G r/2 and the flow rate determine the shear rate u'(r)
and the pressure gradient G algebraically. The conformation at each radius therefore obeys an ordinary differential
equation, and the equations of different radii are coupled through G alone. The flow rate is integrated by Gauss
quadrature in r, which is spectrally accurate. See "Flow without particles" in docs/explanation/numerics.md.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from pairsim.physics.conformation import logarithm, polymer_stress
from pairsim.physics.materials import polymer
from pairsim.physics.materials.polymer import Polymer
from pairsim.physics.scales import TUBE_RADIUS
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import NoSteadyState

OUT_OF_REACH = 1e9  # end time passed to LSODA, beyond the end of any run (see `Pipe.until`); chosen
IMAGINARY = 1e-30j  # complex step; it causes no cancellation, so that any size far below rounding will do
MOST_ITERATIONS = 10  # of Newton's method for the steady flow; chosen


@dataclass(frozen=True)
class PipeState:
    """Flow in the tube without particles at one time.

    Attributes:
        gradient: Pressure drop per unit length [eta_0 U_av/D_c^2].
        r: Radii from the axis to the wall [D_c], shape (n,).
        u: Axial velocity [U_av], shape (n,).
        c: Conformation, components (zz, zr, rr, tt), shape (n, 4).
        p: Pressure over a cross-section, with zero mean [eta_0 U_av/D_c], shape (n,).
    """

    gradient: float
    r: Array
    u: Array
    c: Array
    p: Array

    def profiles(self, r: Array) -> Array:
        """Interpolate u and the four components of log c to other radii, shape (m,); returns shape (5, m)."""
        return across(self.r, np.column_stack([self.u, logarithm(self.c)]), r).T


def across(radii: Array, values: Array, wanted: Array) -> Array:
    """Interpolate values at the radii of a `Pipe` by the polynomial through all of them.

    The seed of scipy's random ordering of the points is fixed, so that results are reproducible to the last digit.

    Args:
        radii: Radii of the `Pipe`, shape (n,).
        values: Values there, shape (n,) or (n, k).
        wanted: Radii to interpolate to, shape (m,).

    Returns:
        Interpolated values, shape (m,) or (m, k).
    """
    return np.asarray(scipy.interpolate.barycentric_interpolate(radii, values, wanted, rng=0))


class Pipe:
    """Start-up of tube flow from an unstressed liquid at t = 0, and the steady flow that it approaches.

    Args:
        liquid: The polymer, or None for a Newtonian liquid.
        flow: Mean velocity [U_av].
        points: Number of Gauss points in r.

    Attributes:
        r: Radii: the axis, the Gauss points and the wall, shape (points + 2,).
    """

    def __init__(self, liquid: Polymer | None, flow: float = 1.0, *, points: int = 60) -> None:
        self.liquid, self._flow = liquid, flow
        x, w = np.polynomial.legendre.leggauss(points)
        self._inner = (x + 1) / 2 * TUBE_RADIUS
        weights = w / 2 * TUBE_RADIUS
        # The flow rate -pi int r^2 u' dr = flow pi/4, with u' from the momentum balance, gives the pressure gradient as
        # G = xi of_solvent - of_stress . tau_rz.
        by_gradient = weights @ (self._inner**3 / 2)
        self._of_solvent = 0.25 * flow / by_gradient
        self._of_stress = np.concatenate([[0.0], weights * self._inner**2 / by_gradient, [0.0]])
        # The axis and the wall have zero quadrature weight.
        self.r = np.concatenate([[0.0], self._inner, [TUBE_RADIUS]])

    def _stress(self, c: Array) -> Array:
        """tau_rz at the radii, shape (n,), for conformations of shape (4, n)."""
        liquid = self.liquid
        assert liquid is not None
        F = polymer.spring(liquid.name, c[0] + c[2] + c[3], liquid.L2)
        return np.asarray((1 - liquid.xi) / liquid.De * F * c[1])

    def _gradient(self, tau: Array) -> float:
        """Pressure gradient G at the imposed flow rate, for tau_rz of shape (n,)."""
        assert self.liquid is not None
        return float(self.liquid.xi * self._of_solvent - self._of_stress @ tau)

    def _shear(self, tau: Array, G: Any) -> Array:
        """Shear rate u'(r) = -(G r/2 + tau_rz)/xi from the momentum balance, shape (n,)."""
        assert self.liquid is not None
        return np.asarray(-(G * self.r / 2 + tau) / self.liquid.xi)

    def _change(self, c: Array, shear: Array) -> Array:
        """dc/dt from the constitutive law, shape (4, n), at the shear rates u', shape (n,)."""
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
        """Exact Jacobian of `_rate` by complex steps, shape (4 n, 4 n).

        It is block diagonal, with one block for each radius, plus a rank-one term from the pressure gradient. Finite
        differences, with 4 n evaluations of the rate, took 90 % of the time of a developed flow.
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
        """Integrate the start-up flow up to t_end [D_c/U_av].

        Returns:
            The flow as a function of time, for times up to t_end. Its values do not depend on t_end.

        Raises:
            NoSteadyState: The time integration failed.
        """
        if self.liquid is None:
            u = 2 * self._flow * (1 - (self.r / TUBE_RADIUS) ** 2)
            unstressed = np.tile([1.0, 0.0, 1.0, 1.0], (len(self.r), 1))
            still = PipeState(32.0 * self._flow, self.r, u, unstressed, np.zeros_like(u))
            return lambda _: still
        # LSODA chooses its first step from the end time and shortens the last one to reach it. A remote end time is
        # passed and the integration stopped once t_end is exceeded, so that a run that is continued with a later end
        # time has the same flow.
        far = max(OUT_OF_REACH, 2 * t_end)
        solver = scipy.integrate.LSODA(self._rate, 0.0, self._start, far, rtol=1e-9, atol=1e-11, jac=self._jacobian)
        times, pieces = [0.0], []
        while solver.t < t_end:
            message = solver.step()
            if solver.status == "failed":
                what = f"the flow without particles at De = {self.liquid.De:g} was lost at t = {solver.t:g}: {message}"
                raise NoSteadyState(what, advice="another De or xi")
            times.append(solver.t)
            pieces.append(solver.dense_output())
        solution = scipy.integrate.OdeSolution(times, pieces)
        return lambda t: self._state(solution(t).reshape(4, -1))

    def constant(self) -> Callable[[float], PipeState]:
        """The steady flow as a function of time, in place of the start-up flow of `until`.

        Raises:
            NoSteadyState: No steady flow was found.
        """
        developed = self.steady()
        return lambda _: developed

    def steady(self, near: PipeState | None = None) -> PipeState:
        """The steady, fully developed flow.

        Args:
            near: Developed flow of the same law at nearly the same De, as first guess of Newton's method. Without it,
                the start-up flow after 15 relaxation times is the first guess.

        Raises:
            NoSteadyState: No steady flow was found. The flow may form shear bands if the shear stress decreases with
                the shear rate.
        """
        if self.liquid is None:
            return self.until(0.0)(0.0)
        if near is not None:
            c = near.c.T.ravel()
        else:
            # Integration in time selects the stable one of several steady flows; Newton's method then converges it.
            # 15 relaxation times were chosen: exp(-15) = 3e-7.
            end = 15 * self.liquid.De
            done = scipy.integrate.solve_ivp(
                self._rate, (0.0, end), self._start, "LSODA", rtol=1e-4, atol=1e-6, jac=self._jacobian
            )
            if not done.success:
                raise NoSteadyState(f"no developed flow at De = {self.liquid.De:g}: {done.message}")
            c = done.y[:, -1]
        with suppress(np.linalg.LinAlgError):  # a singular Jacobian; convergence is checked below
            for _ in range(MOST_ITERATIONS):
                step = np.linalg.solve(self._jacobian(0.0, c), self._rate(0.0, c))
                c = c - step
                if np.abs(step).max() <= 1e-13 * np.abs(c).max():
                    break
        left = np.abs(self._rate(0.0, c)).max()
        if not left <= 1e-8 * np.abs(c).max() / self.liquid.De:
            what = f"no developed flow at De = {self.liquid.De:g}: Newton's method stopped at dc/dt = {left:.2g}"
            advice = "a larger xi: shear stress that decreases with shear rate causes shear bands"
            raise NoSteadyState(what, advice=advice)
        return self._state(c.reshape(4, -1))

    def _state(self, c: Array) -> PipeState:
        tau = self._stress(c)
        G = self._gradient(tau)
        shear = self._shear(tau, G)
        # u = -int_r^R u' dr.
        velocity = self._primitive(shear[1:-1])
        return PipeState(G, self.r, velocity - velocity[-1], c.T.copy(), self._pressure(c.T))

    def _pressure(self, c: Array) -> Array:
        """Pressure over a cross-section, shape (n,), from the radial balance p' = tau_rr' + (tau_rr - tau_tt)/r."""
        assert self.liquid is not None
        _, _, rr, tt = polymer_stress(self.liquid, c).T
        p = rr + self._primitive((rr - tt)[1:-1] / self._inner)
        total = self._primitive((p * self.r)[1:-1])
        return np.asarray(p - 2 / TUBE_RADIUS**2 * (total[-1] - total[0]))

    def _primitive(self, values: Array) -> Array:
        """A primitive, at the radii, shape (n,), of the polynomial through values at the Gauss points."""
        degree = len(self._inner) - 1
        series = np.polynomial.legendre.Legendre.fit(self._inner, values, degree, domain=[0, TUBE_RADIUS])
        return np.asarray(series.integ()(self.r))
