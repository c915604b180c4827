"""Discretisation error of a run in time, carried forward beside it from step to step.

With x+ the solution recovered one degree higher, the defect R(x+; v) of a time step, tested with the discrete test
functions v, is what the discrete equations get wrong. A second solution x_c of the same scheme, with past values of its
own, meets the equations with the defect taken away:

    R(x_c + a; v) + dR(x; v)/d ln m = 0,    a = x+ - (its interpolant),

so that x_c - x is the error that all steps so far have accumulated in positions and stresses, and what its dU
differs by estimates exact minus discrete dU at this time. (Error transport and defect correction: Stetter, Numer.
Math. 29, 425, 1978; Yan, thesis, University of British Columbia, 2018.) Newton's method solves for it with the factors
that the run has in hand; errors change little in a step, and one to three iterations suffice. The last term is what a
sharp kink of the stress adds, in liquids with a yield stress alone.

Where a liquid without modes yields, the stresses at x and at x+ lie on two sides of the kink, and Newton's method with
these factors diverges: there x_c is that of the linearised equation, one iteration from x itself.
"""

from __future__ import annotations

import math

import numpy as np

from pairsim.fem.diagnostics import velocities
from pairsim.fem.recovery.enriched_residual import EnrichedUnknowns
from pairsim.fem.recovery.enriched_scene import EnrichedScene
from pairsim.fem.recovery.recovered_solution import RecoveredSolution
from pairsim.fem.recovery.viscosity_scatter import viscosity_scatter
from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.estimate import VISCOUS
from pairsim.solvers.errors.regularisation import by_sharpness
from pairsim.solvers.nonlinear.factors import ROUGH
from pairsim.solvers.nonlinear.newton import Newton
from pairsim.solvers.stepping.history import ErrorHistory, History
from pairsim.solvers.stepping.step_size import Scheme, extrapolation_weights

# Part of the change of the error in a step that iterations with old factors may leave; chosen: with three times as much
# the error of stresses lags behind.
LAG_TOLERANCE = 0.15
FIRST_ITERATIONS = 3  # where the error of the last step on this mesh is not known
# Estimate of dU's error [U_av] above which it says nothing; chosen, far above any that was of use.
USELESS = 1.0


class ErrorTransport:
    """The error of a run in time.

    Args:
        errors: ErrorHistory of the last steps of an earlier run to continue.

    Attributes:
        errors: Estimated exact minus discrete values of the last steps.
        irregular_dU: Half-width of every dU of the last step by what its error does to a viscosity that depends on the
            shear rate, beyond the first order, (N-1,) [U_av]; 0 in a Newtonian liquid and in one with a memory.
    """

    def __init__(self, errors: ErrorHistory) -> None:
        self.errors = errors
        self.irregular_dU: Array | float = 0.0
        self._enriched: EnrichedScene[EnrichedUnknowns] | None = None

    def advance(self, newton: Newton, past: History, t: float, U_m: float, y: Array, U: Array) -> Array:
        """Carry the error to the end of a step.

        Args:
            newton: The solver, after its solution of the step.
            past: Accepted values before the step.
            t: Time at its end [D_c/U_av].
            U_m: Velocity of the frame in the step.
            y: The solution, shape (n_y,).
            U: Velocities of the particles in it [U_av], shape (N,).

        Returns:
            Estimates of exact minus discrete velocities of the particles [U_av], shape (N,); NaN if the iterations
            diverge, after which the error cannot be carried further.
        """
        scene, constraints, errors = newton.scene, newton.constraints, self.errors
        scheme = Scheme.bdf(past.t, t)
        h, x = newton.state(y)
        sharper = by_sharpness(newton, y)
        h_star = _combined(scheme, past.h) + _combined(scheme, errors.h)
        star = corrected_star = None
        if scene.has_rates:
            star = scene.with_displacements(_combined(scheme, past.x), _combined(scheme, past.h))
            corrected_star = scene.with_displacements(star + _combined(scheme, errors.x), h_star)
        enriched = self._on(newton)
        self.irregular_dU = self._irregular_dU(newton, x, scheme.g)
        with newton.clock("assembly"):
            recovered = RecoveredSolution.of(enriched, x, star, constraints.V @ y)
        corrected, remeshed = y.copy(), not errors.y and bool(errors.U)
        count = _iterations(newton.matrix.contraction) if errors.y else FIRST_ITERATIONS
        if scene.material.regularisation:
            count = 1  # to first order: beyond a kink of the stress iterations diverge, and each guess with them
        elif errors.y:
            corrected += self._guess(newton, scheme)
        for _ in range(count):
            h_c, x_c = self._state(newton, corrected, h_star, scheme.g, U_m)
            with newton.clock("assembly"):
                local = recovered.residuals(x_c, corrected_star)
                residual = newton.restricted(local, x_c) + sharper
            corrected -= newton.linear_solve(residual, tolerance=ROUGH)
        h_c, x_c = self._state(newton, corrected, h_star, scheme.g, U_m)
        dh, dx, dy = h_c - h, x_c - x, corrected - y
        errors.push(t, dh, dx, dy)
        errors.t_y, errors.y = errors.t_y[:1], errors.y[:1]
        change = velocities(scene.bodies, constraints.V @ (y + dy), h + dh) - U
        if not np.isfinite(dy).all() or np.abs(np.diff(change)).max(initial=0.0) > USELESS:
            return np.full(len(change), np.nan)
        if scene.material.modes:
            # The stress of the run is balanced after a remeshing, which leaves velocities as they were, that of x_c is
            # not. The velocities that it drives are forgotten as solvent and elastic stress exchange their loads, in a
            # time xi De.
            memory = scene.material.xi * scene.material.longest
            left = math.exp(-(t - past.t[0]) / memory) if memory > 0 else 0.0
            errors.imbalance = errors.imbalance * left
            if remeshed:
                weights = extrapolation_weights(errors.t[1 : len(errors.U) + 1], t)
                errors.imbalance = change - sum(w * old for w, old in zip(weights, errors.U, strict=True))
        errors.U = [np.asarray(change - errors.imbalance), *errors.U[:1]]
        return errors.U[0]

    def _irregular_dU(self, newton: Newton, x: Array, g: float) -> Array:
        """The half-width of dU that the scatter of a viscosity makes, as of quasi-steady solutions, (N-1,).

        The adjoints are those of a time step: what changing shapes add is less by the order of Ca_e.
        """
        scene, constraints = newton.scene, newton.constraints
        if scene.material.has_memory or scene.material.newtonian or len(scene.bodies) < 2:
            return np.zeros(max(len(scene.bodies) - 1, 0))
        means = np.zeros((len(scene.bodies), scene.h_size))
        for row, body in zip(means, scene.bodies, strict=True):
            axial = row[body.start : body.start + body.size : 2]
            axial[:] = 1 / len(axial)
        rows = np.diff((constraints.V.T @ means.T).T, axis=0)
        adjoints = newton.linear_solve(rows, transposed=True, tolerance=ROUGH)
        adjoints[:, constraints.integrated] /= g
        with newton.clock("assembly"):
            contributions = viscosity_scatter(self._on(newton), x, (constraints.T.T @ adjoints.T).T)
        return np.asarray(VISCOUS * np.sqrt((contributions**2).sum(axis=1)))

    def _guess(self, newton: Newton, scheme: Scheme) -> Array:
        """First guess of the error: that of the last step, with velocities that keep the errors of all positions.

        Velocities that are extrapolated, or those of the last step, let the errors of elastic shapes oscillate and grow
        where the factors are those of another step size.
        """
        guess, errors = self.errors.y[0].copy(), self.errors
        entries = newton.constraints.M.tocoo()
        velocity = (errors.h[0] - _combined(scheme, errors.h)) / scheme.g
        guess[entries.col] = velocity[entries.row]
        return guess

    def _state(self, newton: Newton, y: Array, h_star: Array, g: float, U_m: float) -> tuple[Array, Array]:
        h = newton.constraints.positions(y, h_star, g, U_m)
        return h, newton.constraints.expand(y, h)

    def _on(self, newton: Newton) -> EnrichedScene[EnrichedUnknowns]:
        if self._enriched is None or self._enriched.scene is not newton.scene:
            with newton.clock("jit"):
                self._enriched = EnrichedScene(newton.scene, EnrichedUnknowns, self._enriched)
        return self._enriched


def _iterations(contraction: float) -> int:
    """Number of iterations that leave less than LAG_TOLERANCE, at least one."""
    return max(1, math.ceil(math.log(LAG_TOLERANCE) / math.log(contraction))) if 0 < contraction < 1 else 1


def _combined(scheme: Scheme, values: list[Array]) -> Array:
    return np.asarray(sum(w * value for w, value in zip(scheme.weights, values, strict=True)))
