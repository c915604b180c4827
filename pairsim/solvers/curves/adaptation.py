"""Goal-oriented adaptive mesh refinement of quasi-steady solutions.

A point at which the estimated error of a goal is too large is solved again on a finer mesh, up to ROUNDS times. An
estimate has a signed part, which is the sum of the contributions of all cells, and a scatter, which is the root of the
sum of their squares. Where the scatter prevails, which happens in non-Newtonian liquids only, those cells become
smaller that contribute to it (`pairsim.fem.meshes.size_field`); where the signed part prevails, all cells do. Meshes
are made for certain distances (`SteadyProblem.nominal`), and rounds are counted for each of these: neighbouring points
share them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import reduce

import numpy as np

from pairsim.fem.diagnostics import liquid_distortion
from pairsim.fem.meshes.size_field import MOST_FACTOR, AdaptedSizes, CellIndicators, SizeField
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import BudgetSpent, MeshFailure, NoSteadyState
from pairsim.solvers.curves.branch import BESIDE, Branch
from pairsim.solvers.curves.interpolant import NEGLIGIBLE_DU
from pairsim.solvers.curves.point import Point
from pairsim.solvers.curves.scout import carried_over, found_within, largest_value
from pairsim.solvers.errors.estimate import ErrorEstimator
from pairsim.solvers.goals import Goal, Scale
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.continuation import IN_TIME
from pairsim.solvers.steady.ends import Ended
from pairsim.solvers.steady.first_solution import FEWEST_CELLS
from pairsim.solvers.steady.scene import Snapshot, SteadySolver

# Constants without another origin were chosen.
ROUNDS = 3
HELPS = 0.9  # ratio of the errors after and before a round above which no further round follows at these distances
AIM = 0.8  # fraction of the allowed error that a mesh is made for
LEAST_ROOM = 0.2  # least fraction of the allowed error that the effect of the ends must leave to the cells
ORDER = 3.0  # order of convergence of the signed part of the error without a memory; goals may have their own
ELASTIC_ORDER = 4.5  # the same in a viscoelastic liquid; measured (docs/explanation/decisions.md)
WIDENING_LEFT = 0.5  # power of the widening that is expected on finer cells; measured (docs/explanation/decisions.md)
FACTORS = 1.15, 1.6  # bounds on the factor by which all cells become smaller in a round
# A round in which only the cells that matter become smaller, for a goal that in general asks for smaller cells
# everywhere, is the last one if it leaves more than this multiple of the allowed error (chosen), and more than the
# fraction of the error that smaller cells everywhere would leave.
MISSED = 2.0
HELPS_FAR = FACTORS[1] ** -ELASTIC_ORDER
# Around a single particle, a solution on new cells that are deformed along with its shape is used only if their
# `liquid_distortion`, which is 1 for cells as made, is at least this fraction of that of the present ones.
LESS_DISTORTED = 0.9
# Largest processor time of a search for the solution on new cells that does not begin with that on the present cells
# [s], where the computation has no budget; chosen. In an Oldroyd-B liquid at De 0.99 continuation found none on finer
# cells in 40 minutes; for a dragged sphere at De 0.4 it took between four and five.
LONGEST_SEARCH = 600.0
LEAST_COMMON = 0.8  # least factor of the size of cells without a share in the scatter, in a second or third round

Place = tuple[float, ...]
"""Key by which rounds are counted: the distances for which a mesh is made, or Ca_e of a single particle."""


class AdaptiveBranch(Branch):
    """A branch whose points are solved on finer meshes until the estimated errors of its goals are small enough.

    Errors are compared with the scale of a goal, such as the largest |dU| of the points so far. Where an error is too
    large by this measure and cells can be adapted, solutions on coarse cells show how large dU is at other distances
    (`pairsim.solvers.curves.scout`).

    Args:
        solver, sensitivities, goals: As for `Branch`. If the quantity of interest is the distance at which a goal
            vanishes, only zeros are solved again on finer meshes, not the points between which they are searched for.
        wanted: Largest error of a goal, relative to its scale; infinite to keep the mesh.
        places: Distances of the points that the case requests [D_c], N-1 values each.
        fixed: Those of the settings Np and max_size of the mesh that the case fixes; with a fixed Np the mesh is not
            adapted.

    Attributes:
        largest: Largest known absolute value of each goal.
        rounds: Number of rounds so far, by `Place`.
        unknowns: Number of unknowns on the mesh with which a point was accepted, by `Place`.
    """

    def __init__(
        self,
        solver: SteadySolver,
        sensitivities: Collection[str] = (),
        *,
        goals: Sequence[Goal],
        wanted: float,
        places: Sequence[tuple[float, ...]] = (),
        fixed: frozenset[str] = frozenset(),
    ) -> None:
        super().__init__(solver, sensitivities, goals)
        self.wanted, self._fixed, self._places = wanted, fixed, places
        single_cells_count = not solver.parameters.liquid.newtonian and np.isfinite(wanted)
        self._estimator = ErrorEstimator(goals if single_cells_count else ())
        self.largest = dict.fromkeys(goals, 0.0)
        self._lasting = dict.fromkeys(goals, 0.0)  # the same without values on meshes that were replaced
        self._looked = dict.fromkeys(goals, 0.0)  # errors for which larger values have been looked for
        self._fields: dict[tuple[float, ...], SizeField] = {}
        self.rounds: Counter[Place] = Counter()
        self.unknowns: dict[Place, int] = {}

    @property
    def problem(self) -> SteadyProblem:
        """The problem with the cells of the present mesh."""
        return self.solver.problem

    def at(self, parameters: Parameters) -> Point | Ended:
        """As `Branch.at`, on a mesh on which the errors are small enough, if such a mesh is found."""
        if self._zeros_wanted:
            return super().at(parameters)
        found = self._kept(lambda _: self._begun_at(parameters))
        return self.completed(found) if isinstance(found, Point) else found

    def zero(self, left: float, right: float, guess: float) -> Point | None:
        """As `Branch.zero`, on a mesh on which the error of dU is small enough, if such a mesh is found."""
        again = super().zero
        return self._kept(lambda last: again(left, right, last.d if last else guess))

    def improved(self, zero: Point) -> Point:
        """The present zero, on a mesh on which the error of dU is small enough, if such a mesh is found."""
        if not self._missed(zero):
            return zero
        again = super().zero
        better = self._kept(lambda last: again(last.d / BESIDE, last.d * BESIDE, last.d) if last else zero)
        return better or zero

    def recall(self, snapshot: Snapshot) -> None:
        """Restore a stored solution; if it was stored with other cells, solve for it with the present ones.

        Raises:
            NoSteadyState: The continuation with the present cells did not reach the stored parameters.
        """
        if snapshot.reference.outlines[0] is self.solver.meshed.outlines[0]:
            super().recall(snapshot)
        else:
            self._nearest(snapshot.parameters)
            if (ended := self._follow(snapshot.parameters)) is not None:
                raise ended.failure

    def allowed(self, goal: Goal, point: Point) -> Array:
        """The largest errors of a goal that are allowed at a point, as far as its scale is known, shape (k,) or ()."""
        match goal.scale:
            case Scale.DISTANCE:
                return np.asarray(self.wanted * abs(point.slope_at_rest) * point.d)
            case Scale.ITSELF:
                size = np.abs(point.values[goal])
                return np.where(size > NEGLIGIBLE_DU, self.wanted * size, np.inf)
            case Scale.LARGEST:
                return np.asarray(self.wanted * self.largest[goal])

    def _missed(self, point: Point) -> list[Goal]:
        """The goals whose errors at a point are too large."""
        return [goal for goal in self.goals if self._too_large(goal, point)] if np.isfinite(self.wanted) else []

    def _too_large(self, goal: Goal, point: Point) -> bool:
        """Whether the error of a goal is too large at a point; may look for a larger value of the goal elsewhere."""
        self.largest[goal] = max(self._lasting[goal], _size(goal, point))
        if goal.creeps and point.arrested:  # where dU is creep, finer cells do not make it more accurate
            return False
        errors = point.estimate[goal].half_width
        if goal.scale is Scale.LARGEST:
            error = float(errors.max(initial=0.0))
            if goal.looked_for_with(self._fixed) and error > self.allowed(goal, point) and error > self._looked[goal]:
                self._looked[goal] = error
                found = largest_value(goal, self.solver, self._places, error / self.wanted)
                self._lasting[goal] = max(self._lasting[goal], found)
                self.largest[goal] = max(self.largest[goal], found)
            if self.largest[goal] <= NEGLIGIBLE_DU:
                return False  # nothing to compare errors with: dU of equal rigid spheres in Newtonian liquids is 0
        return bool((errors > self.allowed(goal, point)).any())

    def _kept[R: (Ended, None)](self, solve: Callable[[Point | None], Point | R]) -> Point | R:
        """Solve for a point, and again on finer meshes while its errors are too large and are reduced.

        Args:
            solve: Solves for the point, given that on coarser cells, or None at first.

        Returns:
            The point, or what the first call of `solve` returned in its place.
        """
        before, point = self.solver.iterations, solve(None)
        if not isinstance(point, Point):
            return point
        self.problem.monitor.has_result()  # finer cells only improve the result, and may take long
        while goals := self._improvable(point):
            coarser, fields, allowed = self.problem, dict(self._fields), {g: self.allowed(g, point) for g in goals}
            error = _worst(point, allowed)
            may_leave = max(MISSED, HELPS_FAR * error) if self._far(point, goals) else HELPS * error
            try:
                if not self._refine(point, goals):
                    break
            except BudgetSpent:  # the result so far is returned, as a budget promises
                break
            point = self._again(solve, point, coarser)
            finer_error = _worst(point, allowed)
            if _by_chance(point, goals):
                continue
            if finer_error > may_leave:
                self.rounds[self._place(point)] = ROUNDS
            if finer_error > error and self._go_on(coarser, point.parameters):
                # Near the softest shapes the finer mesh may be close to wrinkles that the coarser one does not resolve.
                self._fields = fields
                point = self._again(solve, point, coarser)
        for goal in self.goals if np.isfinite(self.wanted) else ():
            self.largest[goal] = self._lasting[goal] = max(self._lasting[goal], _size(goal, point))
        self.unknowns[self._place(point)] = self.solver.constraints.size
        return replace(point, newton=self.solver.iterations - before)

    def _again(
        self, solve: Callable[[Point | None], Point | Ended | None], point: Point, coarser: SteadyProblem
    ) -> Point:
        """The point on the present cells or, if it is not found on them, that on the coarser cells.

        A coarse point that is not complete has to be solved for again.

        Raises:
            NoSteadyState, MeshFailure: This point is not found again.
        """
        with suppress(NoSteadyState, MeshFailure):
            found = solve(point)
            if isinstance(found, Point):
                return found
        if point.complete:
            return point
        self._go_on(coarser, point.parameters)
        found = solve(point)
        if not isinstance(found, Point):
            raise NoSteadyState("the solution that finer cells were made for is not found again", advice=IN_TIME)
        return found

    def _place(self, point: Point) -> Place:
        return self._nominal(point) or point.parameters.Ca_es

    def _nominal(self, point: Point) -> tuple[float, ...]:
        return self.problem.nominal(point.gaps)

    def _improvable(self, point: Point) -> list[Goal]:
        """The goals whose errors at a point are too large, and for which another round of finer cells may help."""
        missed = self._missed(point)
        if self.rounds[self._place(point)] >= ROUNDS:
            return []
        return [goal for goal in missed if self._mesh_helps(goal, point)]

    def _mesh_helps(self, goal: Goal, point: Point) -> bool:
        """Whether finer cells may make the error of a goal small enough, in view of the parts not due to the cells."""
        estimate, allowed, room = point.estimate[goal], self.allowed(goal, point), self._room(goal, point)
        regularised = estimate.regularisation_error
        # Not before the first round, as coarse meshes overestimate the effect of the ends.
        if self.rounds[self._place(point)] and (room < LEAST_ROOM * allowed).any() and not regularised.any():
            return False
        if (regularised > np.maximum(allowed, estimate.by_cells)).any():
            return False
        # A pressure drop that nearly vanishes would need more cells than the remaining rounds can make.
        left = ROUNDS - self.rounds[self._place(point)]
        return not goal.everywhere or self._factor(point, {goal: self._most(goal, point)}) <= FACTORS[1] ** left

    def _room(self, goal: Goal, point: Point) -> Array:
        """The part of the allowed error of a goal that is left to the cells, (k,); negative if there is none."""
        estimate = point.estimate[goal]
        others = estimate.ends_error, estimate.regularisation_error, np.abs(estimate.newton)
        return np.asarray(self.allowed(goal, point) - others[0] - others[1] - others[2])

    def _most(self, goal: Goal, point: Point) -> Array:
        """The error of a goal due to the cells that a finer mesh is made for, (k,)."""
        least = np.maximum(LEAST_ROOM * self.allowed(goal, point), point.estimate[goal].regularisation_error / 2)
        return AIM * np.maximum(self._room(goal, point), least)

    def _factor(self, point: Point, most: Mapping[Goal, Array]) -> float:
        """The factor by which all cells would have to be smaller for their errors to be at most `most`."""
        order = ELASTIC_ORDER if point.parameters.liquid.has_memory else ORDER
        return max(_by_cells(point, {goal: each}) ** (1 / (goal.order or order)) for goal, each in most.items())

    def _far(self, point: Point, goals: Collection[Goal]) -> bool:
        """Whether one round of smaller cells everywhere would not be enough for goals that ask for it (`everywhere`).

        That is so where a few cells do not resolve the stress, as in the wake of a moved particle. Then only the cells
        that matter become smaller, and such a round is the last one if the error is still far too large after it.
        """
        most = {goal: self._most(goal, point) for goal in goals}
        return any(goal.everywhere for goal in goals) and self._factor(point, most) > FACTORS[1]

    def _refine(self, point: Point, goals: Sequence[Goal]) -> bool:
        """Continue on a finer mesh for the goals at a point; False if there is none, or no solution on it."""
        problem = self._finer(point, {goal: self._most(goal, point) for goal in goals})
        if problem is None:
            return False
        self.rounds[self._place(point)] += 1
        return self._go_on(problem, point.parameters)

    def _finer(self, point: Point, most: Mapping[Goal, Array]) -> SteadyProblem | None:
        """The problem with cells that are made for errors of at most `most`; None if the case fixes the cells."""
        found = {goal: point.estimate[goal] for goal in most}
        irregular = all(
            each.cells is not None and (each.irregular >= each.by_all_cells).all() for each in found.values()
        )
        everywhere = any(goal.everywhere for goal in most)
        if irregular and not self._fixed and (not everywhere or self._far(point, most)):
            self._fields[self._nominal(point)] = self._sizes(point, most)
            sizes = AdaptedSizes(tuple(self._fields.values()))
            return replace(self.problem, mesh=replace(self.problem.mesh, sizes=sizes))
        if "Np" in self._fixed:
            return None
        mesh = self.problem.mesh.scaled(1 / float(np.clip(self._factor(point, most), *FACTORS)), FEWEST_CELLS)
        kept = {name: getattr(self.problem.mesh, name) for name in self._fixed}
        return replace(self.problem, mesh=replace(mesh, **kept))

    def _sizes(self, point: Point, most: Mapping[Goal, Array]) -> SizeField:
        """Cell sizes that are made for errors of goals of at most `most` at a point."""
        found = {goal: point.estimate[goal] for goal in most}
        cells = reduce(CellIndicators.joined, (each.cells for each in found.values() if each.cells is not None))
        # Allowed scatter: it keeps its share of the cells' part of the half-width, and is widened with that.
        allowed = [
            most[goal] / (each.widening**WIDENING_LEFT * each.of_scatter * (1 + each.by_all_cells / each.irregular))
            for goal, each in found.items()
        ]
        largest_factor = MOST_FACTOR
        if self.rounds[self._place(point)]:  # smaller cells where the scatter comes from have not been enough
            largest_factor = float(np.clip(_by_cells(point, most) ** (-1 / ORDER), LEAST_COMMON, 1.0))
        mesh = self.problem.mesh
        field = cells.sizes(np.concatenate(allowed), largest_factor, mesh.rows or self.problem.length)
        # Without a memory, cells that contribute nothing to dU resolve the velocity profile and so the pressure drop.
        return field if point.parameters.liquid.has_memory else field.at_most(mesh.max_size)

    def _go_on(self, problem: SteadyProblem, parameters: Parameters) -> bool:
        """Carry the solution over to other cells; False if that fails, with the present cells kept."""
        solver = carried_over(problem, parameters, self.solver)
        if not parameters.gaps and (solver is None or _distortion(solver) < LESS_DISTORTED * _distortion(self.solver)):
            # New cells around a sphere are distorted by a shape far from it; on the way to this shape others are made.
            if solver is not None:
                solver.close()
            solver = found_within(LONGEST_SEARCH, problem, parameters)
        if solver is None:
            return False
        solver.take_over_costs(self.solver)
        self.solver.close()
        self.solver = solver
        self._known = [solver.snapshot]
        return True


def _distortion(solver: SteadySolver) -> float:
    """Smallest ratio of current to reference Jacobian of the liquid's cells; 1 where they are as they were made."""
    return liquid_distortion(solver.scene, solver.state()[1])


def _size(goal: Goal, point: Point) -> float:
    """The largest absolute value of a goal at a point."""
    return float(np.abs(point.values[goal]).max(initial=0.0))


def _worst(point: Point, allowed: Mapping[Goal, Array]) -> float:
    """The largest ratio of an error of the goals to the allowed one."""
    return max(float(np.max(point.estimate[goal].half_width / most)) for goal, most in allowed.items())


def _by_cells(point: Point, most: Mapping[Goal, Array]) -> float:
    """The largest ratio of the cells' part in an error of the goals to the largest such part `most`."""
    return max(float(np.max(point.estimate[goal].by_cells / each)) for goal, each in most.items())


def _by_chance(point: Point, goals: Sequence[Goal]) -> bool:
    """Whether errors may have grown on finer cells by chance.

    In liquids without a memory most of the scatter comes from the few cells in which the shear rate vanishes, and
    depends on where in such a cell it does.
    """
    found = [point.estimate[goal] for goal in goals]
    return not point.parameters.liquid.has_memory and any(bool((e.irregular > e.regular).any()) for e in found)
