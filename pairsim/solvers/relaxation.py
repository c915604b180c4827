"""How long particles remember: the slowest decay of a disturbance while the distances are held.

With the residual R(y, y_t) of `pairsim.solvers.motion`, a small disturbance v exp(-t/tau) of a solution obeys
J v = M v / tau with J = dR/dy and M = dR/dy_t, so that the times tau are the eigenvalues of J^-1 M. Two families of
modes have no length of their own and are resolved by no mesh: short waves on the surfaces, which decay within about
2 Ca_e, and the advected stress of the polymer, within about De. The first are left out as a change of the distances
hardly excites them. For the second M is restricted to the surfaces, with a stress that follows them at once, which
leaves the times tau_0 of the shapes; in a polymer with a memory of its own they become the larger root of

    tau^2 - (De + tau_0) tau + xi De tau_0 = 0,

the relation of a single elastic mode in a Jeffreys liquid, which is De for rigid particles.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial import Polynomial

from pairsim.runtime.arrays import Array
from pairsim.solvers.motion import moving_residual
from pairsim.solvers.steady import Steady

# Krylov steps at least and at most; residual of an eigenpair, relative to tau_0 + De, at which they end and at which it
# counts; least part of a mode in the start. All chosen: short waves have less than 0.005, and tau_0 is good to 5 %.
FEWEST, MOST, ENOUGH, COUNTS, EXCITED = 4, 8, 0.03, 0.1, 0.02
PROBE = 1e-3  # largest velocity of the surfaces in a probe [U_av], small enough for SUPG to be linear; chosen
SOLVED = 1e-4  # residual of the linear systems; chosen


def relaxation_time(steady: Steady) -> float:
    """Slowest decay time of a disturbance at held distances [D_c/U_av]; `Steady.factor` must have been called."""
    liquid, surface = steady.scene.material, _surface_unknowns(steady)
    tau = _shape_time(steady, surface, liquid.longest) if surface.any() else 0.0
    if not liquid.modes or math.isinf(tau):
        return tau
    # t - tau [xi + sum_i G_i De_i t/(t - De_i)] = 0, times all t - De_i.
    times = [float(liquid.relaxation_time(mode)) for mode in liquid.modes]
    whole = Polynomial([-liquid.xi * tau, 1.0]) * Polynomial.fromroots(times)
    for i, mode in enumerate(liquid.modes):
        others = Polynomial.fromroots([*times[:i], *times[i + 1 :]]) if len(times) > 1 else Polynomial([1.0])
        whole -= tau * float(liquid.modulus(mode)) * times[i] * Polynomial([0.0, 1.0]) * others
    return float(np.real(whole.roots()).max())


def _surface_unknowns(steady: Steady) -> np.ndarray:
    """Which free unknowns move the surfaces of soft particles, boolean, shape (n_y,)."""
    on_surface = np.zeros(steady.scene.h_size)
    for body in steady.bodies:
        for c in range(2):
            on_surface[body.start + 2 * body.nodes + c] = 1.0
    return np.asarray(abs(steady.constraints.M).T @ on_surface > 0)


def _shape_time(steady: Steady, surface: np.ndarray, De: float) -> float:
    """The largest tau_0, by Arnoldi's method from the change of the shapes with the distances, or with Ca_e."""
    parameters, still = steady.parameters, steady.residual()
    no_rates = np.zeros(len(parameters.gaps))

    def times(v: Array) -> Array:
        y_t, scale = np.zeros(len(surface)), PROBE / float(np.abs(v).max())
        y_t[surface] = scale * v
        change = moving_residual(steady, parameters, steady.y, y_t, no_rates, stress=False) - still
        found = steady.newton.linear_solve(change, tolerance=SOLVED)
        return np.asarray(steady.comm.bcast(found[surface] / scale))

    start = times(_disturbance(steady)[surface])
    basis, H = [start / np.linalg.norm(start)], np.zeros((MOST + 1, MOST))
    for j in range(MOST):
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
        slowest = int(np.argmax(np.where(part > EXCITED, np.abs(mu), 0.0)))
        if j + 1 >= FEWEST and left[slowest] < ENOUGH:
            break
    counted = (part > EXCITED) & ((left < COUNTS) | (np.arange(len(mu)) == slowest)) & (mu.real > 0)
    # A disturbance exp(-t/mu) decays with the real part of 1/mu.
    return float(1 / np.real(1 / mu[counted]).min()) if counted.any() else math.inf


def _disturbance(steady: Steady) -> Array:
    """What changes the shapes smoothly: a change of all distances, or of Ca_e where there are none, shape (n_y,)."""
    if steady.parameters.gaps:
        return np.asarray(steady.gap_tangents().sum(axis=0))
    now = steady.parameters
    return steady.tangent(lambda tau: now.softer(1 + tau))
