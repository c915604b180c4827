"""How long particles remember: the slowest decay of a disturbance while the distances are held.

With the residual R(y, y_t) of `pairsim.solvers.steady.motion`, a small disturbance v exp(-t/tau) of a solution obeys
J v = M v / tau with J = dR/dy and M = dR/dy_t, so that the times tau are the eigenvalues of J^-1 M. Two families of
modes have no length of their own and are resolved by no mesh: short waves on the surfaces, which decay within about
2 Ca_e, and the advected stress of the polymer, within about De. The first are left out as a change of the distances
hardly excites them. For the second M is restricted to the surfaces, and to the inside of viscous solids, with a stress
that follows them at once. This leaves the times tau_0 = tau_s + tau_l of the shapes, the sum of a part due to the
viscosity of the solid and one due to that of the liquid. In a polymer with a memory of its own they become the larger
root of

    tau^2 - (De + tau_0) tau + (tau_s + xi tau_l) De = 0,

the relation of a single elastic mode in a Jeffreys liquid, which is De for rigid particles.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial.polynomial import Polynomial, polyfromroots

from pairsim.fem.scene import Body
from pairsim.runtime.arrays import Array
from pairsim.solvers.steady.motion import moving_residual
from pairsim.solvers.steady.scene import SteadySolver
from pairsim.solvers.steady.tangents import gap_tangents, tangent_along

# All chosen: tau_0 is good to 5 %, with viscous solids to 15 %.
FEWEST_STEPS = 4  # Krylov steps
MOST_STEPS = 8
MOST_STEPS_VISCOUS = 25  # with viscous solids, whose insides have waves of their own
CONVERGED = 0.03  # residual of an eigenpair, relative to tau_0 + De, at which the steps end
ACCEPTED = 0.1  # the same, up to which an eigenpair counts
LEAST_EXCITED = 0.02  # part of a mode in the start from which it counts; short waves have less than 0.005
PROBE = 1e-3  # largest velocity of the surfaces in a probe [U_av], small enough for SUPG to be linear; chosen
SOLVED = 1e-2  # residual of the linear systems: changes times by up to 1e-3 of themselves, .1 by 4 %


def relaxation_time(steady: SteadySolver) -> float:
    """Slowest decay time of a disturbance at held distances [D_c/U_av]; `SteadySolver.factor` must have been called."""
    liquid, (tau_0, of_solids) = steady.scene.material, shape_time(steady)
    if not liquid.modes or math.isinf(tau_0):
        return tau_0
    tau_s, tau_l = tau_0 * of_solids, tau_0 * (1 - of_solids)
    # t - tau_s - tau_l [xi + sum_i G_i De_i t/(t - De_i)] = 0, times all t - De_i.
    times = [float(liquid.relaxation_time(mode)) for mode in liquid.modes]
    whole = Polynomial([-tau_s - liquid.xi * tau_l, 1.0]) * Polynomial(polyfromroots(times))
    for i, mode in enumerate(liquid.modes):
        others = Polynomial(polyfromroots([*times[:i], *times[i + 1 :]]))
        whole -= tau_l * float(liquid.modulus(mode)) * times[i] * Polynomial([0.0, 1.0]) * others
    return float(np.real(whole.roots()).max())


def shape_time(steady: SteadySolver) -> tuple[float, float]:
    """Slowest decay time tau_0 of the shapes, in a liquid that follows at once, and the part due to viscous solids."""
    moving = _unknowns_that_move(steady)
    return _shape_time(steady, moving, steady.scene.material.longest) if moving.any() else (0.0, 0.0)


def _is_viscous(body: Body) -> bool:
    return body.phase is not None and body.phase.material.viscosity is not None


def _unknowns_that_move(steady: SteadySolver) -> np.ndarray:
    """Which free unknowns move the surfaces of soft particles, or the inside of viscous ones; boolean, shape (n_y,)."""
    wanted = np.zeros(steady.scene.h_size)
    for body in steady.bodies:
        if _is_viscous(body):
            wanted[body.start : body.start + body.size] = 1.0
        for c in range(2):
            wanted[body.start + 2 * body.nodes + c] = 1.0
    return np.asarray(abs(steady.constraints.M).T @ wanted > 0)


def _shape_time(steady: SteadySolver, moving: np.ndarray, De: float) -> tuple[float, float]:
    """The largest tau_0, and the part of it that is due to the viscosity of solids.

    By Arnoldi's method from the change of the shapes with the distances, or with Ca_e.
    """
    parameters, still = steady.parameters, steady.residual()
    no_rates = np.zeros(len(parameters.gaps))
    viscous = any(_is_viscous(body) for body in steady.bodies)
    most = MOST_STEPS_VISCOUS if viscous else MOST_STEPS

    def times(v: Array, *, solids: bool = True) -> Array:
        y_t, scale = np.zeros(len(moving)), PROBE / float(np.abs(v).max())
        y_t[moving] = scale * v
        change = moving_residual(steady, parameters, steady.y, y_t, no_rates, stress=False, solids=solids) - still
        found = steady.newton.linear_solve(change, tolerance=SOLVED)
        return np.asarray(found[moving] / scale)

    start = times(_disturbance(steady)[moving])
    basis, H = [start / np.linalg.norm(start)], np.zeros((most + 1, most))
    for j in range(most):
        w = times(basis[j])
        for _ in range(2):
            parts = np.array(basis) @ w
            H[: j + 1, j] += parts
            w = w - parts @ np.array(basis)
        H[j + 1, j] = np.linalg.norm(w)
        basis.append(w / H[j + 1, j])
        mu, vectors = np.linalg.eig(H[: j + 1, : j + 1])
        part = np.abs(np.linalg.solve(vectors, np.eye(j + 1)[0].astype(complex)))
        left = np.abs(H[j + 1, j] * vectors[-1]) / (np.abs(mu) + De)
        slowest = int(np.argmax(np.where(part > LEAST_EXCITED, np.abs(mu), 0.0)))
        if j + 1 >= FEWEST_STEPS and left[slowest] < CONVERGED:
            break
    counted = (part > LEAST_EXCITED) & ((left < ACCEPTED) | (np.arange(len(mu)) == slowest)) & (mu.real > 0)
    # A disturbance exp(-t/mu) decays with the real part of 1/mu.
    times_of = np.where(counted, 1 / np.where(counted, np.real(1 / mu), 1.0), 0.0)
    if not counted.any():
        return math.inf, 0.0
    tau, of_solids = float(times_of.max()), 0.0
    if viscous and De > 0:
        v = np.real(vectors[:, times_of.argmax()] @ np.array(basis[:-1]))
        of_solids = 1 - float(v @ times(v, solids=False)) / float(v @ times(v))
    return tau, of_solids


def _disturbance(steady: SteadySolver) -> Array:
    """What changes the shapes smoothly: a change of all distances, or of Ca_e where there are none, shape (n_y,)."""
    if steady.parameters.gaps:
        return np.asarray(gap_tangents(steady).sum(axis=0))
    now = steady.parameters
    return tangent_along(steady, lambda tau: now.softer(1 + tau))
