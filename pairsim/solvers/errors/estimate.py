"""Discretisation error of a quasi-steady solution by the adjoint-weighted residual.

For a functional J and the adjoint z of its linearisation, J(exact) - J(discrete) = -R(discrete; z - z_h) up to terms of
second order in the error, for every discrete z_h (Becker & Rannacher, Acta Numerica 10, 1, 2001). The exact z is
replaced by z+, the discrete adjoint (`pairsim.solvers.errors.adjoints`) recovered one degree higher
(`pairsim.fem.recovery.weighted_residual`). The formula of the half-width and its symbols are in
docs/explanation/error-estimate.md.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from pairsim.fem.diagnostics import Observation
from pairsim.fem.meshes.size_field import ORDER, VISCOUS_ORDER, CellIndicators
from pairsim.fem.recovery.enriched_residual import EnrichedTests, EnrichedUnknowns
from pairsim.fem.recovery.enriched_scene import EnrichedScene
from pairsim.fem.recovery.recovered_solution import RecoveredSolution
from pairsim.fem.recovery.weighted_residual import WeightedResidual
from pairsim.quantities.scales import FLOW_RATE
from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.adjoints import Adjoints
from pairsim.solvers.errors.end_effects import end_effects
from pairsim.solvers.errors.regularisation import by_regularisation, left_by_regularisation
from pairsim.solvers.errors.run_errors import OF_POINTS, widening
from pairsim.solvers.goals import DECIDING, Goal
from pairsim.solvers.solution import Solution
from pairsim.solvers.steady.linearisation import Linearisation
from pairsim.solvers.steady.scene import SteadySolver

# Factors of the scatter in a half-width. The first was determined on twelve solutions in liquids without a memory, the
# second on 24 scenes with three meshes each, when the larger one of scatter and correction counted in place of their
# sum (docs/explanation/error-estimate.md).
VISCOUS, ELASTIC = 3.0, 1.6
# Relative error of that part of the estimate which cancels between liquid and soft particles. Where spheres are far
# apart the contribution of each is a hundred times their sum. Determined on Newtonian curves of beta .4 (all of 30
# intervals hold), and checked on those of beta .2 and .6 (98 % of 51).
OF_CANCELLED = 0.015
OF_ENDS = 2.0  # half-width for the effect of the ends, relative to its estimate; chosen
# Ratio of the scatter to the magnitude of the estimate above which the sign of the estimate is not certain, and it is
# not added; chosen.
CANCELLING = 4.0


@dataclass(frozen=True)
class GoalEstimate:
    """Signed estimates of exact minus discrete values of a goal, and their errors; arrays are (k,) unless noted.

    Attributes:
        goal: The goal.
        correction: The estimate delta: `change`, plus that of a better evaluation of the goal (`Goal.reading`).
        change: The part of delta that is the adjoint-weighted residual, -R(x_h; z+ - z_h).
        spread: sigma_p, the change of delta when the adjoint pressures are recovered in another way.
        cancelled: delta_c, the magnitude of the contributions of liquid and particles to delta that cancel.
        scatter: sigma_s, the root-sum-square of the cell indicators, which are the cells' contributions to delta from
            the constitutive equation. Where stress or adjoint are not resolved, the indicators have random signs, and
            delta is no more than the remainder of a sum of this size. In a liquid without a memory the indicators are
            instead the effect of errors on the viscosity beyond the first order
            (`pairsim.fem.recovery.viscosity_scatter`); in a Newtonian liquid they are 0.
        beyond: Other errors due to the cells, which are not widened: |delta| if it counts although it is not added, and
            a term of second order.
        ends: epsilon_L, the effect of the ends of the tube on the goal.
        outside: epsilon_o, what the tube beyond the ends would add to the goal.
        by_regularisation: First and second derivatives with respect to the logarithm of the regularisation, (2, k).
        newton: epsilon_N, the signed error that Newton's method has left, to first order.
        widening: omega, the factor of the cells' part of the half-width where cells do not resolve the stress.
        of_scatter: Factor f of the scatter in the half-width.
        cells: The cell indicators; None if they were not asked for, and in a Newtonian liquid.
    """

    goal: Goal
    correction: Array
    change: Array
    spread: Array
    cancelled: Array
    scatter: Array
    beyond: Array
    ends: Array
    outside: float
    by_regularisation: Array
    newton: Array
    widening: float
    of_scatter: float
    cells: CellIndicators | None = None

    @property
    def half_width(self) -> Array:
        """Half-width of the interval around the reported value that is meant to contain the exact one."""
        return self.by_cells + self.ends_error + self.regularisation_error + np.abs(self.newton) + self.goal.rounding

    @property
    def regular(self) -> Array:
        """Error of the estimate if cells resolve stress and adjoint: |`change`| + sigma_p + 0.015 delta_c.

        It is at least the fraction `Goal.of_others` of the largest one of all values.
        """
        left = np.abs(self.change) + np.abs(self.spread) + OF_CANCELLED * self.cancelled
        return np.maximum(left, self.goal.of_others * left.max(initial=0.0))

    @property
    def irregular(self) -> Array:
        """Error of the estimate due to cells that do not resolve stress or adjoint: f sigma_s."""
        return self.of_scatter * self.scatter

    @property
    def by_cells(self) -> Array:
        """The cells' part of the half-width.

        The regular and the irregular error are added, as they may have the same sign.
        """
        return self.widening * (self.regular + self.irregular) + self.beyond

    @property
    def by_all_cells(self) -> Array:
        """The part of `by_cells` that is not the scatter of cell indicators, divided by the widening."""
        return self.regular + self.beyond / self.widening

    @property
    def ends_error(self) -> Array:
        """The part of the half-width that is due to the ends of the tube."""
        return OF_ENDS * self.ends + self.outside

    @property
    def regularisation_error(self) -> Array:
        """The part of the half-width that is due to the regularisation of the liquid."""
        return left_by_regularisation(self.by_regularisation)


@dataclass(frozen=True, eq=False)
class ErrorEstimate(Mapping[Goal, GoalEstimate]):
    """The estimates of the errors of all goals at a solution.

    Attributes:
        goals: The estimate of each goal, with empty arrays for goals without values in the scene.
        trusted: Whether estimates may be added to the goals at all. In a liquid with a memory they may not if the
            estimate of any dU (or of any force, if there are forces) is no more than the remainder of contributions
            that cancel. In other liquids they always may, as the scatter there is not that of the estimate itself.
    """

    goals: Mapping[Goal, GoalEstimate]
    trusted: bool

    def __getitem__(self, goal: Goal) -> GoalEstimate:
        return self.goals[goal]

    def __iter__(self) -> Iterator[Goal]:
        return iter(self.goals)

    def __len__(self) -> int:
        return len(self.goals)

    def corrected(self, discrete: Observation) -> Observation:
        """The observed quantities of a solution with the estimates of their errors added, if these are trusted."""
        if not self.trusted:
            return discrete
        added = {}
        for goal, each in self.goals.items():
            if goal.observed:
                change = each.correction if goal.per else float(each.correction[0])
                added[goal.observed] = getattr(discrete, goal.observed) + change
        return replace(discrete, **added)

    def value(self, goal: Goal, solution: Solution, corrected: Observation) -> Array:
        """The values of a goal at a solution, (k,), with their correction where it is added.

        Args:
            goal: The goal.
            solution: The discrete solution.
            corrected: Its observed quantities, as returned by `corrected`.
        """
        value = goal.value(solution, corrected)
        own = goal.added and self.trusted and not goal.root.observed  # the correction is not in `corrected` yet
        return np.asarray(value + self.goals[goal].correction if own else value)


class ErrorEstimator:
    """Estimates discretisation errors of quasi-steady solutions; keeps compiled data for further solutions on a mesh.

    Args:
        cells: Goals whose cell indicators are wanted.
    """

    def __init__(self, cells: Collection[Goal] = ()) -> None:
        self._cells = cells
        self._enriched: EnrichedScene[EnrichedTests] | None = None
        self._recovered: EnrichedScene[EnrichedUnknowns] | None = None

    def estimate(self, at: Linearisation, adjoints: Adjoints, discrete: Observation) -> ErrorEstimate:
        """The estimates at a solution, from one assembly of the enriched residual.

        Args:
            at: The solution.
            adjoints: Its adjoints.
            discrete: Its observed quantities, without corrections.
        """
        steady = at.steady
        scene, constraints = steady.scene, steady.constraints
        with steady.clock("jit"):
            if self._enriched is None or self._enriched.scene is not scene:
                self._enriched = EnrichedScene(scene, EnrichedTests, self._enriched)
        z, residual = adjoints.all, at.residual
        left = -z @ residual
        changes = -z @ _flow_rate_defect(steady, residual)
        ends = end_effects(steady, z, residual)
        sharper = by_regularisation(at, z, adjoints.apart)
        with steady.clock("assembly"):
            x = steady.state()[1]
            scene.set(x)
            tested = WeightedResidual.of(self._enriched, x, (constraints.T.T @ z.T).T)
        changes = changes - tested.sums
        elastic, found, solution = scene.material.has_memory, dict[Goal, GoalEstimate](), steady.solution
        for goal in adjoints:
            combined = adjoints.combination(goal)
            change, reading = combined @ changes, goal.read_better(solution)
            products = np.einsum("ik,kl,il->i", combined, tested.stress_products, combined)
            found[goal] = GoalEstimate(
                goal,
                correction=change if reading is None else reading + change,
                change=change,
                spread=combined @ tested.changes,
                cancelled=_cancelled(tested, combined),
                scatter=np.sqrt(np.maximum(products, 0.0)),
                beyond=self._second_order(steady, adjoints, goal, x, change),
                ends=np.abs(ends @ combined.T).max(axis=0),
                outside=goal.beyond_ends(solution) if goal.beyond_ends else 0.0,
                by_regularisation=sharper @ combined.T,
                newton=combined @ left,
                widening=widening(discrete.s_jump, OF_POINTS),
                of_scatter=ELASTIC if elastic else VISCOUS,
                cells=_indicators(self._enriched, tested, combined) if goal in self._cells else None,
            )
        trusted = not (elastic and _cancels(found))
        for goal, each in found.items():
            if goal.left_out_counts and not (goal.added and trusted):
                found[goal] = replace(each, beyond=each.beyond + np.abs(each.correction))
        return ErrorEstimate(found, trusted)

    def _second_order(self, steady: SteadySolver, adjoints: Adjoints, goal: Goal, x: Array, change: Array) -> Array:
        """The term of second order in the half-widths of a goal, (k,); zeros where it is not computed."""
        alone = len(steady.bodies) == 1 and steady.bodies[0].phase is not None
        if not (goal.second_order and alone and steady.problem.drive.free) or steady.scene.material.has_memory:
            return np.zeros(len(change))
        return np.asarray(np.abs(self._of_recovered_solution(steady, adjoints[goal], x) - change))

    def _of_recovered_solution(self, steady: SteadySolver, z: Array, x: Array) -> Array:
        """Estimates from the residual of the recovered solution, tested with the discrete adjoints, (k,).

        They differ from those of the discrete solution tested with the recovered adjoints by twice a term of second
        order that both lack. This term is not added to values, and counts twice in the half-width: once for itself, and
        once for the error of its estimate. It is small except on squeezed cells of soft particles.

        Args:
            steady: The solution.
            z: Adjoints, (k, n_y).
            x: The solution as a full vector, (n,).
        """
        with steady.clock("jit"):
            if self._recovered is None or self._recovered.scene is not steady.scene:
                self._recovered = EnrichedScene(steady.scene, EnrichedUnknowns, self._recovered)
        with steady.clock("assembly"):
            recovered = RecoveredSolution.of(self._recovered, x, None, steady.constraints.V @ steady.y)
            return np.asarray(-z @ steady.newton.restricted(recovered.residuals(x, None), x))


def _cancels(estimates: Mapping[Goal, GoalEstimate]) -> bool:
    """Whether the estimate of any value of the deciding goal is no more than the remainder of a sum that cancels."""
    known = (estimates[goal] for goal in DECIDING if goal in estimates)
    deciding = next((each for each in known if each.change.size), None)
    return deciding is not None and bool((deciding.scatter > CANCELLING * np.abs(deciding.change)).any())


def _indicators(
    enriched: EnrichedScene[EnrichedTests], tested: WeightedResidual, combined: Array
) -> CellIndicators | None:
    """The cell indicators of combinations, (k, K), of the functionals; None in a Newtonian liquid."""
    if tested.stress_by_cell is None:
        return None
    reference, squares = enriched.scene.reference, (combined @ tested.stress_by_cell).T ** 2
    order = ORDER if enriched.scene.material.has_memory else VISCOUS_ORDER
    return CellIndicators(reference.geometry, reference.mirrored, tested.corners, squares, order)


def _cancelled(tested: WeightedResidual, combined: Array) -> Array:
    """delta_c, (k,), the part that cancels between liquid and particles in combinations, (k, K), of the functionals."""
    parts = np.array([tested.in_liquid, tested.sums - tested.in_liquid]) @ combined.T
    return np.asarray(np.abs(parts).sum(axis=0) - np.abs(parts.sum(axis=0)))


def _flow_rate_defect(steady: SteadySolver, residual: Array) -> Array:
    """Change of the residual, (n_y,), when the velocity at prescribed ends is scaled such that its flow rate is exact.

    The profile of a viscoelastic liquid at the ends is interpolated. On coarse cells this changes the flow rate by up
    to 4e-5 of itself, and every velocity with it, which no residual shows.
    """
    scene = steady.scene
    if scene.periodic or scene.drive.flow == 0:
        return np.zeros(steady.constraints.size)
    x = steady.state()[1]
    index, weight = scene.scalar_terms.flow_rate
    excess = scene.drive.flow * FLOW_RATE / float(weight @ x[index]) - 1
    for nodes in (scene.nodes.inlet, scene.nodes.outlet):
        x[scene.liquid.index("u", nodes)] *= 1 + excess
    return steady.newton.reduce(x) - residual
