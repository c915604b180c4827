"""Relaxation time of particles: a mean decay time of a disturbance while the distances are held.

With the residual R(y, y_t) of `pairsim.solvers.steady.motion`, a small disturbance v of a solution obeys J v = -M v_t
with J = dR/dy and M = dR/dy_t. Two families of its modes have no length scale, and no mesh resolves them: short waves
on the surfaces, and the advected stress of the polymer, which decays within about De. The stress is taken to follow the
particles instantaneously, and M is restricted to the unknowns of the particles. Their disturbances decay as
exp(-t T^-1), where T is J^-1 M restricted to these unknowns.

Short waves have decay times up to several times those of the smooth shapes, and growing with the number of cells, but
they are hardly excited: the slowest of all modes depends on the mesh and does not show in the results. The time tau_0
is therefore a mean over the results f(t) (every dU, or U of a single particle, less the part by which the shapes move
the centres) while the shapes that lag behind a slow change of the distances (of Ca_e) come to rest,

    tau_0 = 2/3 int t^3 |f|^2 dt / int t^2 |f|^2 dt,

which is tau where f = exp(-t/tau), and depends smoothly on all parameters. Both integrals are known in closed form on a
Krylov space of T. With the memory of the polymer tau_0 = tau_s + tau_l, the sum of a part due to the viscosity of the
solid and one due to that of the liquid, becomes the largest root of

    tau = tau_s + tau_l [xi + sum_i G_i De_i tau/(tau - De_i)],

the relation of one elastic shape in a liquid with the relaxation times De_i and moduli G_i, which is the longest De_i
for rigid particles. With one mode this is tau^2 - (De + tau_0) tau + (tau_s + xi tau_l) De = 0 (Jeffreys liquid).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial.polynomial import Polynomial, polyfromroots

from pairsim.runtime.arrays import Array
from pairsim.solvers.steady.linearisation import Linearisation
from pairsim.solvers.steady.motion import ShapeRates

# Dimension of the Krylov space; twice as many change tau_0 by less than 1 % in ten scenes, some with viscous solids.
STEPS = 6
LATE = 2  # power of the time in the weight t^LATE |f|^2: with a larger one short waves count more, with a smaller one
# what decays immediately
PROBE = 1e-3  # largest rate of an unknown in a probe [U_av], small enough for SUPG to be linear; chosen
# Relative residuals of the linear systems: of the first ones, small enough for dU, which is small against the
# velocities, and of the others, whose errors matter less (measured: docs/explanation/decisions.md).
SOLVED, ROUGHLY_SOLVED = 1e-3, 0.1
ACCURATE_SOLVES = 3


def relaxation_time(at: Linearisation) -> float:
    """The relaxation time t_relax, which is tau_0 changed by the memory of the liquid [D_c/U_av]; see above."""
    liquid, (tau_0, of_solids) = at.parameters.liquid, shape_time(at)
    if not liquid.modes or math.isinf(tau_0):
        return max(tau_0, float(liquid.solvent.memory))
    tau_s, tau_l = tau_0 * of_solids, tau_0 * (1 - of_solids)
    # The relation above, tau - tau_s - tau_l [...] = 0, times all tau - De_i.
    times = [float(liquid.relaxation_time(mode)) for mode in liquid.modes]
    whole = Polynomial([-tau_s - liquid.xi * tau_l, 1.0]) * Polynomial(polyfromroots(times))
    for i, mode in enumerate(liquid.modes):
        others = Polynomial(polyfromroots([*times[:i], *times[i + 1 :]]))
        whole -= tau_l * float(liquid.modulus(mode)) * times[i] * Polynomial([0.0, 1.0]) * others
    return float(np.real(whole.roots()).max())


def shape_time(at: Linearisation) -> tuple[float, float]:
    """Decay time tau_0 of the shapes, if the stress follows them instantaneously [D_c/U_av], and its part tau_s/tau_0.

    The time is infinite where nothing decays, and 0 for rigid particles. The part is computed for viscous solids in a
    liquid with modes only, and is 0 otherwise.
    """
    if not any(body.phase is not None for body in at.steady.bodies):
        return 0.0, 0.0
    disturbance, rates = _disturbance(at), ShapeRates(at)
    moving, basis = rates.moving, list[Array]()

    def times(v: Array, tolerance: float, *, solids: bool = True) -> Array:
        """J^-1 M v of rates v of the unknowns that move, shape (n_y,)."""
        y_t, scale = np.zeros(len(moving)), PROBE / float(np.abs(v).max())
        y_t[moving] = scale * v
        return at.solve(rates.terms(y_t, solids=solids), tolerance=tolerance) / scale

    H, seen = np.zeros((STEPS + 1, STEPS)), list[Array]()
    w = times(disturbance[moving], SOLVED)[moving]
    for j in range(STEPS):
        basis.append(w / np.linalg.norm(w))
        y = times(basis[j], SOLVED if j + 1 < ACCURATE_SOLVES else ROUGHLY_SOLVED)
        seen.append(y[at.steady.constraints.fields["U_p"]] + rates.means[:, moving] @ basis[j])
        w = y[moving]
        for _ in range(2):
            parts = np.array(basis) @ w
            H[: j + 1, j] += parts
            w = w - parts @ np.array(basis)
        H[j + 1, j] = np.linalg.norm(w)
    # The results are U of a single particle, or dU of all gaps, without the part by which the changing shapes move the
    # centres: that part may change the sign of dU during the decay.
    results = np.array(seen) if len(seen[0]) == 1 else np.diff(seen, axis=1)
    tau, of_solids = _late_time(H[:STEPS], results), 0.0
    if at.parameters.liquid.modes and rates.viscous:
        v = np.linalg.matrix_power(H[:STEPS], LATE)[:, 0] @ np.array(basis)
        of_liquid, of_all = (v @ times(v, SOLVED, solids=solids)[moving] for solids in (False, True))
        of_solids = 1 - float(of_liquid) / float(of_all)
    return tau, of_solids


def _late_time(H: Array, results: Array) -> float:
    """The time 2/(k + 1) int t^(k+1) |f|^2 dt / int t^k |f|^2 dt, k = LATE; infinite where nothing decays.

    Args:
        H: The matrix of T in an orthonormal basis whose first vector is the initial disturbance, (m, m).
        results: The results that belong to rates equal to each vector of this basis, (m, results).
    """
    mu, vectors = np.linalg.eig(H)
    excited = np.linalg.solve(vectors, np.eye(len(mu))[0].astype(complex))
    decays = mu.real > 0
    rates = 1 / mu[decays]  # of the modes exp(-rate t), which drive f
    f = results.T @ (vectors[:, decays] * (excited[decays] * rates))
    products, sums = f.conj().T @ f, rates.conj()[:, None] + rates
    early, late = (float((products / sums ** (LATE + k)).sum().real) for k in (1, 2))
    return 2 * late / early if early > 0 else math.inf


def _disturbance(at: Linearisation) -> Array:
    """A smooth disturbance of the shapes: that by a change of all distances or, without gaps, of Ca_e, shape (n_y,)."""
    if at.parameters.gaps:
        return np.asarray(at.gap_tangents.sum(axis=0))
    return at.tangent(lambda tau: at.parameters.softer(1 + tau))
