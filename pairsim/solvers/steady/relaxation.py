"""How long particles remember: the decay of a disturbance while the distances are held.

With the residual R(y, y_t) of `pairsim.solvers.steady.motion`, a small disturbance v of a solution obeys J v = -M v_t
with J = dR/dy and M = dR/dy_t. Two families of its modes have no length of their own and are resolved by no mesh: short
waves on the surfaces and the advected stress of the polymer, which decays within about De. For the second M is
restricted to the particles, with a stress that follows them at once. What is left decays as exp(-t/T), where T is the
restriction of J^-1 M.

Short waves have times up to several times those of the smooth shapes, which grow with the number of cells, but are
hardly excited, and the slowest of all modes is no number that a user sees. The time tau_0 is that of what is seen: of
the results f(t) (every dU; U of a single particle; less what the shapes move the centres by) while the shapes with
which particles lag behind slow changes of their distances (of Ca_e) come to rest,

    tau_0 = 2/3 int t^3 |f|^2 dt / int t^2 |f|^2 dt,

which is tau where f = exp(-t/tau), and depends smoothly on all parameters. Both integrals are known in closed form on a
Krylov space of T. In a polymer with a memory of its own tau_0 = tau_s + tau_l, the sum of a part due to the viscosity
of the solid and one due to that of the liquid, becomes the larger root of

    tau^2 - (De + tau_0) tau + (tau_s + xi tau_l) De = 0,

the relation of a single elastic mode in a Jeffreys liquid, which is De for rigid particles.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial.polynomial import Polynomial, polyfromroots

from pairsim.fem.scene import Body
from pairsim.runtime.arrays import Array
from pairsim.solvers.steady.linearisation import Linearisation
from pairsim.solvers.steady.motion import rate_terms
from pairsim.solvers.steady.scene import SteadySolver

# Dimension of the Krylov space; with twice as many tau_0 changes by less than 1 % in ten scenes, viscous solids too.
STEPS = 6
LATE = 2  # power of the time in the weight t^LATE |f|^2: short waves count with more, what decays at once with less
PROBE = 1e-3  # largest velocity of the surfaces in a probe [U_av], small enough for SUPG to be linear; chosen
SOLVED = 1e-3  # residual of the linear systems, small enough for dU, which is small against the velocities; chosen


def relaxation_time(at: Linearisation) -> float:
    """Slowest decay time of a disturbance of a solution at held distances [D_c/U_av]."""
    liquid, (tau_0, of_solids) = at.parameters.liquid, shape_time(at)
    if not liquid.modes or math.isinf(tau_0):
        return max(tau_0, float(liquid.solvent.memory))
    tau_s, tau_l = tau_0 * of_solids, tau_0 * (1 - of_solids)
    # t - tau_s - tau_l [xi + sum_i G_i De_i t/(t - De_i)] = 0, times all t - De_i.
    times = [float(liquid.relaxation_time(mode)) for mode in liquid.modes]
    whole = Polynomial([-tau_s - liquid.xi * tau_l, 1.0]) * Polynomial(polyfromroots(times))
    for i, mode in enumerate(liquid.modes):
        others = Polynomial(polyfromroots([*times[:i], *times[i + 1 :]]))
        whole -= tau_l * float(liquid.modulus(mode)) * times[i] * Polynomial([0.0, 1.0]) * others
    return float(np.real(whole.roots()).max())


def shape_time(at: Linearisation) -> tuple[float, float]:
    """Decay time tau_0 of the shapes, in a liquid that follows at once, and the part of it due to viscous solids."""
    moving = _unknowns_that_move(at.steady)
    return _shape_time(at, moving) if moving.any() else (0.0, 0.0)


def _is_viscous(body: Body) -> bool:
    return body.phase is not None and body.phase.material.viscosity is not None


def _unknowns_that_move(steady: SteadySolver) -> np.ndarray:
    """Which free unknowns move soft particles; boolean, shape (n_y,).

    The inside of elastic particles too: it has no stress of its own, but a part of the velocity of their centres.
    """
    return np.asarray(abs(steady.constraints.M).T @ np.ones(steady.scene.h_size) > 0)


def _shape_time(at: Linearisation, moving: np.ndarray) -> tuple[float, float]:
    """tau_0, infinite where nothing decays, and the part of it that is due to the viscosity of solids."""
    still = np.zeros(len(at.parameters.gaps))

    def times(v: Array, *, solids: bool = True) -> Array:
        """J^-1 M v of rates v of the unknowns that move, shape (n_y,)."""
        y_t, scale = np.zeros(len(moving)), PROBE / float(np.abs(v).max())
        y_t[moving] = scale * v
        return at.solve(rate_terms(at, y_t, still, stress=False, solids=solids), tolerance=SOLVED) / scale

    start = times(_disturbance(at)[moving])[moving]
    basis, H, results = [start / np.linalg.norm(start)], np.zeros((STEPS + 1, STEPS)), []
    for j in range(STEPS):
        y = times(basis[j])
        results.append(_results(at.steady, y, basis[j], moving))
        w = y[moving]
        for _ in range(2):
            parts = np.array(basis) @ w
            H[: j + 1, j] += parts
            w = w - parts @ np.array(basis)
        H[j + 1, j] = np.linalg.norm(w)
        basis.append(w / H[j + 1, j])
    tau, of_solids = _late_time(H[:STEPS], np.array(results)), 0.0
    if at.parameters.liquid.modes and any(map(_is_viscous, at.steady.bodies)):
        v = np.linalg.matrix_power(H[:STEPS], LATE)[:, 0] @ np.array(basis[:-1])
        of_solids = 1 - float(v @ times(v, solids=False)[moving]) / float(v @ times(v)[moving])
    return tau, of_solids


def _late_time(H: Array, results: Array) -> float:
    """The time 2/(k + 1) int t^(k+1) |f|^2 dt / int t^k |f|^2 dt, k = LATE; infinite where nothing decays.

    Args:
        H: The matrix of T in a basis whose first vector is the disturbance, (m, m).
        results: Results of the rates that are vectors of this basis, (m, results).
    """
    mu, vectors = np.linalg.eig(H)
    excited = np.linalg.solve(vectors, np.eye(len(mu))[0].astype(complex))
    decays = mu.real > 0
    rates = 1 / mu[decays]  # of the modes exp(-rate t), which drive f
    f = results.T @ (vectors[:, decays] * (excited[decays] * rates))
    products, sums = f.conj().T @ f, rates.conj()[:, None] + rates
    early, late = (float((products / sums ** (LATE + k)).sum().real) for k in (1, 2))
    return 2 * late / early if early > 0 else math.inf


def _results(steady: SteadySolver, y: Array, v: Array, moving: np.ndarray) -> Array:
    """What is seen of rates v of the unknowns that move: every dU, or U of a single particle [U_av].

    Without what the shapes move the centres by, which may change the sign of dU while it decays.

    Args:
        steady: The scene.
        y: J^-1 M v, shape (n_y,).
        v: The rates.
        moving: Which unknowns they are of.
    """
    y_t = np.zeros(len(moving))
    y_t[moving] = v
    h, _ = steady.state()
    h_t = steady.constraints.M @ y_t
    U = y[steady.constraints.fields["U_p"]] + [body.mean(h_t, h) for body in steady.bodies]
    return np.asarray(np.diff(U) if len(U) > 1 else U)


def _disturbance(at: Linearisation) -> Array:
    """What changes the shapes smoothly: a change of all distances, or of Ca_e where there are none, shape (n_y,)."""
    if at.parameters.gaps:
        return np.asarray(at.gap_tangents.sum(axis=0))
    return at.tangent(lambda tau: at.parameters.softer(1 + tau))
