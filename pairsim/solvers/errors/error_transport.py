"""Discretisation error of a run in time, carried forward from step to step along with the solution.

With x+ the solution x recovered one degree higher, the defect of a time step is R(x+; v), tested with the discrete test
functions v. A second solution x_c of the same scheme, with a history of its own, satisfies the equations corrected by
this defect,

    R(x_c + a; v) + dR(x; v)/d ln m = 0,    a = x+ - (its interpolant),

so that x_c - x is the error that all steps so far have accumulated in positions and stresses. The difference between a
goal, such as dU, at x_c and at x estimates its exact minus its discrete value at this time. (Error transport and defect
correction: Stetter, Numer. Math. 29, 425, 1978; Yan, thesis, University of British Columbia, 2018.) Newton's method
solves for x_c with the factors of the run's time step; as errors change little in a step, one to three iterations
suffice. The last term, in liquids with a yield stress only, is the effect of the rounding of the kink.

Where the viscosity law has a regularised yield stress, the stresses at x and at x+ may lie on different sides of the
kink, and Newton's method with these factors diverges: there x_c is the solution of the linearised equation, from one
iteration that starts at x.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pairsim.fem.algebra.constraints import PositionUpdate
from pairsim.fem.diagnostics import Observation, observe
from pairsim.fem.recovery.enriched_residual import EnrichedUnknowns
from pairsim.fem.recovery.enriched_scene import EnrichedScene
from pairsim.fem.recovery.recovered_solution import RecoveredSolution
from pairsim.fem.recovery.viscosity_scatter import viscosity_scatter
from pairsim.physics.liquids import Liquid
from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.estimate import VISCOUS
from pairsim.solvers.errors.regularisation import by_sharpness
from pairsim.solvers.goals import IN_TIME, Goal, U
from pairsim.solvers.nonlinear.factors import ROUGH
from pairsim.solvers.nonlinear.newton import Newton
from pairsim.solvers.solution import Solution
from pairsim.solvers.stepping.history import ErrorHistory, History
from pairsim.solvers.stepping.step_size import Scheme, extrapolation_weights

# Fraction of the change of the error in a step that iterations with lagged factors may leave; chosen: with three times
# this value the error of the stresses lags behind.
LAG_TOLERANCE = 0.15
FIRST_ITERATIONS = 3  # number of iterations where the error of the last step on this mesh is not known
# Estimate of the error of dU [U_av] above which it is useless; chosen, far above any estimate that was of use.
USELESS = 1.0


class ErrorTransport:
    """The error of a run in time.

    Args:
        errors: Errors of the last steps, which are zero at a start.

    Attributes:
        errors: Estimated exact minus discrete values of the last steps.
        irregular: f sigma_s of goals in the last step, half-widths due to the effect of its error on a viscosity that
            depends on the shear rate, beyond the first order, (k,) each; empty in a Newtonian liquid, in a liquid with
            a memory, and for fewer than two particles.
    """

    def __init__(self, errors: ErrorHistory) -> None:
        self.errors = errors
        self.irregular = dict[Goal, Array]()
        self._enriched: EnrichedScene[EnrichedUnknowns] | None = None

    def advance(
        self, newton: Newton, past: History, t: float, U_m: float, solution: Solution, observation: Observation
    ) -> dict[Goal, Array]:
        """Carry the error to the end of a step.

        Args:
            newton: The solver, after its solution of the step.
            past: Accepted values before the step.
            t: Time at its end [D_c/U_av].
            U_m: Velocity of the frame in the step.
            solution: The solution at the end of the step.
            observation: Its observed quantities.

        Returns:
            Estimates of exact minus discrete values of the goals `IN_TIME`, (k,) each; NaN if the iterations diverge or
            the estimate is useless, after which the error cannot be carried any further.
        """
        scene, constraints, errors = newton.scene, newton.constraints, self.errors
        y, h, x = solution.y, solution.h, solution.x
        scheme = Scheme.bdf(past.t, t)
        own = _combined(scheme, past.h)
        sharper = by_sharpness(newton, y, PositionUpdate(own, scheme.g, U_m))
        update = PositionUpdate(own + _combined(scheme, errors.h), scheme.g, U_m)
        star = corrected_star = None
        if scene.has_rates:
            star = scene.with_displacements(_combined(scheme, past.x), _combined(scheme, past.h))
            corrected_star = scene.with_displacements(star + _combined(scheme, errors.x), update.h_star)
        enriched = self._on(newton)
        self.irregular = self._irregular(newton, solution)
        with newton.clock("assembly"):
            recovered = RecoveredSolution.of(enriched, x, star, constraints.V @ y)
        corrected, remeshed = y.copy(), not errors.y and bool(errors.changes)
        count = _iterations(newton.matrix.contraction) if errors.y else FIRST_ITERATIONS
        if scene.material.regularisation:
            count = 1  # to first order, from x itself: beyond a kink of the stress further iterations diverge
        elif errors.y:
            corrected += self._guess(newton, scheme)
        for _ in range(count):
            h_c, x_c = constraints.state(corrected, update)
            with newton.clock("assembly"):
                local = recovered.residuals(x_c, corrected_star)
                residual = newton.restricted(local, x_c, scheme.g) + sharper
            corrected -= newton.linear_solve(residual, tolerance=ROUGH)
        h_c, x_c = constraints.state(corrected, update)
        dh, dx, dy = h_c - h, x_c - x, corrected - y
        errors.push(t, dh, dx, dy)
        errors.t_y, errors.y = errors.t_y[:1], errors.y[:1]
        corrected_solution = replace(solution, y=y + dy, h=h + dh, x=x + dx)
        changes = _changes(solution, corrected_solution, observation)
        if not np.isfinite(dy).all() or np.abs(np.diff(changes[U])).max(initial=0.0) > USELESS:
            return {goal: np.full_like(goal.value(solution, observation), np.nan) for goal in IN_TIME}
        if scene.material.modes:
            self._forget_imbalance(changes, t - past.t[0], scene.material, remeshed=remeshed)
        for goal, imbalance in (
            (goal, errors.imbalance[goal.name]) for goal in changes if goal.name in errors.imbalance
        ):
            changes[goal] = changes[goal] - imbalance
        errors.changes = [{goal.name: change for goal, change in changes.items()}, *errors.changes[:1]]
        return {goal: goal.combined(len(changes[goal.root])) @ changes[goal.root] for goal in IN_TIME}

    def _forget_imbalance(self, changes: Mapping[Goal, Array], dt: float, liquid: Liquid, *, remeshed: bool) -> None:
        """Update `errors.imbalance`, the part of the changes of goals that stems from a remeshing and is not an error.

        After a remeshing the stress of the run is balanced such that its velocities remain the same; that of x_c is
        not. The velocities and pressures that are driven by the imbalance decay in a time xi De, while load is
        transferred between solvent and elastic stress. Shapes do not change instantaneously, and have no such part.
        """
        errors, memory = self.errors, liquid.xi * liquid.longest
        left = math.exp(-dt / memory) if memory > 0 else 0.0
        errors.imbalance = {name: value * left for name, value in errors.imbalance.items()}
        if remeshed:
            weights = extrapolation_weights(errors.t[1 : len(errors.changes) + 1], errors.t[0])
            errors.imbalance = {
                goal.name: change - sum(w * old[goal.name] for w, old in zip(weights, errors.changes, strict=True))
                for goal, change in changes.items()
                if not goal.of_positions
            }

    def _irregular(self, newton: Newton, solution: Solution) -> dict[Goal, Array]:
        """f sigma_s of goals, half-widths due to the scatter of the viscosity as in quasi-steady solutions, (k,) each.

        The adjoints are those of a single time step: the effect by way of changing shapes is smaller by a factor of the
        order of Ca_e.
        """
        scene, constraints = newton.scene, newton.constraints
        if scene.material.has_memory or scene.material.newtonian or len(scene.bodies) < 2:
            return {}
        found = dict[Goal, Array]()
        for goal in IN_TIME:
            rows = goal.functional_at(solution).rows
            rows = goal.combined(len(rows)) @ rows
            adjoints = newton.linear_solve(rows, transposed=True, tolerance=ROUGH)
            adjoints[:, constraints.integrated] /= solution.g
            with newton.clock("assembly"):
                by_cell = viscosity_scatter(self._on(newton), solution.x, (constraints.T.T @ adjoints.T).T)
            found[goal] = np.asarray(VISCOUS * np.sqrt((by_cell**2).sum(axis=1)))
        return found

    def _guess(self, newton: Newton, scheme: Scheme) -> Array:
        """First guess of the error, (n_y,): that of the last step, with velocities that keep the errors of positions.

        With extrapolated velocities, or those of the last step, the errors of elastic shapes oscillate and grow where
        the factors are those of another step size.
        """
        guess, errors = self.errors.y[0].copy(), self.errors
        entries = newton.constraints.M.tocoo()
        velocity = (errors.h[0] - _combined(scheme, errors.h)) / scheme.g
        guess[entries.col] = velocity[entries.row]
        return guess

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


def _changes(solution: Solution, corrected: Solution, observation: Observation) -> dict[Goal, Array]:
    """Goals at a corrected solution minus those at the discrete one, (k,) each.

    Goals that are combinations of others are left out. A correction by a better evaluation (`Goal.reading`) is part of
    the difference.
    """
    y, h, x = corrected.y, corrected.h, corrected.x
    seen = observe(solution.scene, solution.constraints, y, h, x, observation.dp_without_particles)
    found = dict[Goal, Array]()
    for goal in IN_TIME:
        if goal.parent is None:
            change, reading = (
                goal.value(corrected, seen) - goal.value(solution, observation),
                goal.read_better(corrected),
            )
            found[goal] = change if reading is None else change + reading
    return found
