"""How long particles remember: the slowest decay of a disturbance while the distances are held.

With the residual R(y, y_t) of `pairsim.solvers.motion`, a small disturbance v exp(-t/tau) of a solution obeys
J v = M v / tau with J = dR/dy and M = dR/dy_t, so that the times tau are the eigenvalues of J^-1 M. Of the stress of a
polymer the eigenvalues are those of a continuous spectrum about De, which no mesh resolves. M is therefore restricted
to the surfaces, with a stress that follows them at once, which leaves the times tau_0 of the shapes; that of a polymer
with a memory of its own then is the larger root of

    tau^2 - (De + tau_0) tau + xi De tau_0 = 0,

the relation of a single elastic mode in a Jeffreys liquid, which is De for rigid particles.
"""

from __future__ import annotations

import math

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.motion import moving_residual
from pairsim.solvers.steady import Steady

# Krylov steps at least and at most; residual of an eigenpair, relative to tau_0 + De, at which they end and at which it
# counts; all chosen. The result is good to about 5 %.
FEWEST, MOST, ENOUGH, COUNTS = 4, 12, 0.03, 0.1
PROBE = 1e-3  # largest velocity of the surfaces in a probe [U_av], small enough for SUPG to be linear; chosen
SOLVED = 1e-4  # residual of the linear systems; chosen


def relaxation_time(steady: Steady) -> float:
    """Slowest decay time of a disturbance at held distances [D_c/U_av]; `Steady.factor` must have been called."""
    polymer = steady.scene.polymer
    De = 0.0 if polymer is None else polymer.De
    surface = _surface_unknowns(steady)
    tau = _shape_time(steady, surface, De) if surface.any() else 0.0
    if polymer is None:
        return tau
    half = (De + tau) / 2
    return half + math.sqrt(half**2 - polymer.xi * De * tau)


def _surface_unknowns(steady: Steady) -> np.ndarray:
    """Which free unknowns move the surfaces of soft particles, boolean, shape (n_y,)."""
    on_surface = np.zeros(steady.scene.h_size)
    for body in steady.bodies:
        for c in range(2):
            on_surface[body.start + 2 * body.nodes + c] = 1.0
    return np.asarray(abs(steady.constraints.M).T @ on_surface > 0)


def _shape_time(steady: Steady, surface: np.ndarray, De: float) -> float:
    """The largest tau_0, by Arnoldi's method from the change of the shapes with the distances.

    A start that is as smooth as what a moving pair excites finds its modes in few steps, and hardly those of single
    cells, which distorted meshes have.
    """
    parameters, still = steady.parameters, steady.residual()
    no_rates, count = np.zeros(len(parameters.gaps)), int(np.count_nonzero(surface))

    def times(v: Array) -> Array:
        y_t, scale = np.zeros(len(surface)), PROBE / float(np.abs(v).max())
        y_t[surface] = scale * v
        change = moving_residual(steady, parameters, steady.y, y_t, no_rates, stress=False) - still
        found = steady.newton.linear_solve(change, tolerance=SOLVED)
        return np.asarray(steady.comm.bcast(found[surface] / scale))

    start = steady.gap_tangents().sum(axis=0)[surface] if len(no_rates) else np.random.default_rng(0).random(count)
    start = times(start)
    basis, H = [start / np.linalg.norm(start)], np.zeros((MOST + 1, MOST))
    for j in range(min(MOST, count - 1)):
        w = times(basis[j])
        for _ in range(2):
            parts = np.array(basis) @ w
            H[: j + 1, j] += parts
            w = w - parts @ np.array(basis)
        H[j + 1, j] = np.linalg.norm(w)
        basis.append(w / H[j + 1, j])
        mu, vectors = np.linalg.eig(H[: j + 1, : j + 1])
        left = np.abs(H[j + 1, j] * vectors[-1]) / (np.abs(mu) + De)
        largest = int(np.argmax(np.abs(mu)))
        if j + 1 >= FEWEST and left[largest] < ENOUGH:
            break
    # A disturbance exp(-t/mu) decays with the real part of 1/mu.
    rates = np.real(1 / mu[(left < COUNTS) | (np.arange(len(mu)) == largest)])
    return float(1 / rates[rates > 0].min()) if (rates > 0).any() else math.inf
