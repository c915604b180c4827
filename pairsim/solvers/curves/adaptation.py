"""Quasi-steady solutions on meshes that follow from the error wanted.

A point whose estimated error is too large is solved again on a mesh made for it, up to ROUNDS times. Where the scatter
of the estimate prevails, in viscoelastic liquids only, cells become smaller where they contribute to it
(`pairsim.fem.meshes.size_field`); where its signed part prevails all cells do. Meshes are kept by the distances for
which meshes are made (`SteadyProblem.nominal`): neighbouring points share them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.fem.meshes.size_field import MOST_FACTOR, AdaptedSizes, SizeField
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.solvers.curves.branch import BESIDE, Branch, Point
from pairsim.solvers.curves.interpolant import NEGLIGIBLE_DU
from pairsim.solvers.errors.estimate import ErrorEstimator
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.continuation import prepared
from pairsim.solvers.steady.ends import Ended
from pairsim.solvers.steady.first_solution import FEWEST_CELLS, first_scene, try_from_other_mesh
from pairsim.solvers.steady.scene import Snapshot, SteadySolver

# Constants without another origin were chosen.
ROUNDS = 3
HELPS = 0.9  # part of the error that a round may leave, or it was the last one at its distance
AIM = 0.8  # part of the error allowed that a mesh is made for
LEAST_ROOM = 0.2  # part of the error allowed that the ends of the tube must leave to the cells
ORDER = 3.0  # in the cell size, of the signed part of the error in a Newtonian liquid
ELASTIC_ORDER = 4.5  # the same in a viscoelastic liquid; measured (docs/explanation/decisions.md)
FACTORS = 1.15, 1.6  # bounds on the factor by which all cells become smaller in a round
LEAST_COMMON = 0.8  # factor of the cells that contribute nothing to the scatter, in a second or third round
ENOUGH = 3  # distances of a case from which on they tell the size of dU
# Distances of the scout that tells it elsewhere [D_c]. Of ten peaks (beta .2 to .6, De 0 to 2) the largest dU at these
# was 83 to 100 %.
SCALE_DISTANCES = 0.4, 0.2, 0.1
SCALE_CELLS = 10  # of the scout on a half-circle
SCALE_GROWTH = 0.3  # of its cells
SCALE_SIZE = 0.35  # of its largest cells, relative to the smallest diameter
STEP = 1.6  # largest ratio of distances in a step of it


def largest_dU(known: SteadySolver, places: Sequence[tuple[float, ...]], enough: float) -> float:
    """The largest |dU| of a curve, or of the curve that a single point lies on, from coarse solutions [U_av].

    Args:
        known: A solver at a solution of the curve.
        places: The distances of the case.
        enough: Value beyond which no larger one is looked for [U_av].

    Returns:
        The largest |dU| [U_av], 0 if no solution was found on coarse cells.
    """
    problem, parameters = known.problem, known.parameters
    here, wanted = parameters.gaps, {*places, parameters.gaps}
    if len(wanted) < ENOUGH:
        # Distances are widened only as far as meshes for them fit into the tube.
        others = {tuple(d for _ in here) for d in SCALE_DISTANCES}
        room = problem.length - sum(problem.betas) - max(map(sum, wanted))
        wanted |= {o for o in others if sum(o) - max(map(sum, wanted)) < room / 4}
    else:
        wanted = {min(wanted, key=lambda gaps: abs(np.log(sum(gaps) / len(gaps) / d))) for d in SCALE_DISTANCES}
    size = max(problem.mesh.max_size, SCALE_SIZE * min(problem.betas))
    cells = MeshSettings(Np=SCALE_CELLS, growth=SCALE_GROWTH, max_size=size, rows=problem.mesh.rows)
    coarse, found = replace(problem, mesh=cells), 0.0
    scout = _carried_over(coarse, parameters, known)
    if scout is None:  # far apart very soft particles may have no solution on such cells that follows from a fine one
        for gaps in sorted(wanted - {here}, reverse=True):
            if found < enough:
                found = max(found, _found_anew(coarse, replace(parameters, gaps=gaps)))
        return found
    try:
        start, found = scout.snapshot, _largest(scout)
        wider = sorted(gaps for gaps in wanted if gaps > here)
        narrower = sorted((gaps for gaps in wanted if gaps < here), reverse=True)
        for side in (wider, narrower):
            with suppress(NoSteadyState, MeshFailure):  # soft particles at the narrowest distances
                for gaps in side:
                    if found >= enough or not _moved(scout, gaps):
                        break
                    found = max(found, _largest(scout))
            scout.recall(start)
        return found
    finally:
        scout.close()


def _carried_over(problem: SteadyProblem, parameters: Parameters, known: SteadySolver) -> SteadySolver | None:
    """The scene on other cells; None unless Newton's method converges from the interpolated solution.

    No continuation is tried then: it may take longer than what it is wanted for.
    """
    solver: SteadySolver | None = None
    with suppress(NoSteadyState, MeshFailure):
        solver = SteadySolver(problem, parameters)
        if try_from_other_mesh(solver, parameters, known):
            return solver
    if solver is not None:
        solver.close()
    return None


def _found_anew(problem: SteadyProblem, parameters: Parameters) -> float:
    """The largest |dU| of a solution that is found without an earlier one, 0 if none is found [U_av]."""
    found: SteadySolver | Ended | None = None
    with suppress(NoSteadyState, MeshFailure):
        found = first_scene(problem, parameters)
    if not isinstance(found, SteadySolver):
        return 0.0
    dU = _largest(found)
    found.close()
    return dU


def _moved(scout: SteadySolver, gaps: tuple[float, ...]) -> bool:
    """Continue to other distances in steps of a given length; False where one fails, as shorter ones may take long."""
    here = np.array(scout.parameters.gaps)
    count = int(np.ceil(np.abs(np.log(np.divide(gaps, here))).max() / np.log(STEP)))
    for part in np.arange(1, count + 1) / count:
        there = replace(scout.parameters, gaps=tuple(map(float, here ** (1 - part) * np.array(gaps) ** part)))
        step = np.subtract(there.gaps, scout.parameters.gaps) @ scout.linearise().gap_tangents
        scout.forget()
        if not scout.solve(there, prepared(scout, there, scout.y + step)).converged:
            return False
    return True


def _largest(scout: SteadySolver) -> float:
    """The largest |dU| of a solution [U_av]."""
    return float(np.abs(np.diff(scout.y[scout.constraints.fields["U_p"]])).max())


class AdaptiveBranch(Branch):
    """A branch whose points are solved on finer meshes until their estimated errors are small enough.

    Errors are compared with the largest |dU| of the points so far. Where this does not do, coarse solutions at other
    distances tell how large dU is.

    Args:
        solver, sensitivities: As for `Branch`.
        wanted: Largest error of dU, relative to its largest value; infinite to keep the mesh.
        places: Distances of the case.
        held: Settings of the mesh that the case fixes, of Np and max_size; where Np is fixed the mesh is not adapted.
        zeros_only: Whether only zeros are solved again, not the points among which they are looked for. The error of
            the distance of a zero is then relative to this distance.

    Attributes:
        dU: Largest |dU| known [U_av].
        rounds: Number of rounds at each of the distances for which meshes are made.
        unknowns: Unknowns of the meshes with which points were accepted, by the same distances.
    """

    def __init__(
        self,
        solver: SteadySolver,
        sensitivities: Collection[str] = (),
        *,
        wanted: float,
        places: Sequence[tuple[float, ...]] = (),
        held: frozenset[str] = frozenset(),
        zeros_only: bool = False,
    ) -> None:
        super().__init__(solver, sensitivities)
        self.wanted, self._held, self._zeros_only = wanted, held, zeros_only
        self._estimator = ErrorEstimator(cells=not solver.parameters.liquid.newtonian and np.isfinite(wanted))
        self._places, self._looked, self.dU = places, 0.0, 0.0  # error for which a larger dU was looked for
        self._fields: dict[tuple[float, ...], SizeField] = {}
        self.rounds: Counter[tuple[float, ...]] = Counter()
        self.unknowns: dict[tuple[float, ...], int] = {}

    @property
    def problem(self) -> SteadyProblem:
        """The problem with the cells of the present mesh."""
        return self.solver.problem

    def at(self, parameters: Parameters) -> Point | Ended:
        """As `Branch.at`, on a mesh that keeps the error small where one was found."""
        if self._zeros_only:
            return super().at(parameters)
        return self._kept(lambda _: super(AdaptiveBranch, self).at(parameters))

    def zero(self, left: float, right: float, guess: float) -> Point | None:
        """A zero of dU as by `Branch.zero`, on a mesh that keeps the error of dU small where one was found."""
        again = super().zero
        return self._kept(lambda last: again(left, right, last.d if last else guess))

    def improved(self, zero: Point) -> Point:
        """The present zero on a mesh that keeps the error of dU small where one was found."""
        if not self._too_large(zero):
            return zero
        again = super().zero
        better = self._kept(lambda last: again(last.d / BESIDE, last.d * BESIDE, last.d) if last else zero)
        return better or zero

    def recall(self, snapshot: Snapshot) -> None:
        """Restore a stored solution; one that was stored with other cells is solved for with the present ones.

        Raises:
            NoSteadyState: The continuation with the present cells did not reach the stored parameters.
        """
        if snapshot.reference.outlines[0] is self.solver.meshed.outlines[0]:
            super().recall(snapshot)
        else:
            self._nearest(snapshot.parameters)
            if (ended := self._follow(snapshot.parameters)) is not None:
                raise ended.failure

    def allowed(self, point: Point) -> float:
        """The largest error of dU that is allowed at a point, from the largest |dU| known so far [U_av]."""
        if self._zeros_only:
            return self.wanted * abs(point.slope_at_rest) * point.d
        return self.wanted * self.dU

    def _too_large(self, point: Point) -> bool:
        if not np.isfinite(self.wanted):
            return False
        self.dU = max(self.dU, float(np.abs(point.dUs).max()))
        if point.held_together:  # where dU is creep no cells make it more exact
            return False
        error = float(point.estimate.dU_error.max())
        if error > self.allowed(point) and error > self._looked and not self._zeros_only:
            self._looked = error
            self.dU = max(self.dU, largest_dU(self.solver, self._places, error / self.wanted))
        # There is no dU that errors could be compared to: that of equal rigid spheres in Newtonian liquids is 0.
        return error > self.allowed(point) and (self._zeros_only or self.dU > NEGLIGIBLE_DU)

    def _kept[R: (Ended, None)](self, solve: Callable[[Point | None], Point | R]) -> Point | R:
        """Solve for a point, and again on finer meshes while its error is too large and becomes smaller.

        Args:
            solve: Solves for it, from the point on coarser cells if there is one.

        Returns:
            The point, or what `solve` returned in its place at first.
        """
        before, point = self.solver.iterations, solve(None)
        if not isinstance(point, Point):
            return point
        while self._too_large(point):
            coarser, fields, error = self.problem, dict(self._fields), float(point.estimate.dU_error.max())
            if not self._refine(point):
                break
            point = self._again(solve, point)
            finer_error = float(point.estimate.dU_error.max())
            if self._by_chance(point):
                continue
            if finer_error > HELPS * error:
                self.rounds[self._nominal(point)] = ROUNDS
            if finer_error > error and self._go_on(coarser, point.parameters):
                # Near the softest shapes the finer mesh may be close to wrinkles that the coarser one does not resolve.
                self._fields = fields
                point = self._again(solve, point)
        self.unknowns[self._nominal(point)] = self.solver.constraints.size
        return replace(point, newton=self.solver.iterations - before)

    def _again(self, solve: Callable[[Point | None], Point | Ended | None], point: Point) -> Point:
        """The point on the present cells, or as it was if it is not found on them."""
        with suppress(NoSteadyState, MeshFailure):
            found = solve(point)
            return found if isinstance(found, Point) else point
        return point

    def _by_chance(self, point: Point) -> bool:
        """Whether the error may have grown with finer cells by chance.

        In liquids without modes most of the scatter is that of a few cells, those in which the shear rate vanishes. How
        large it is there depends on where in the cell it vanishes.
        """
        estimate = point.estimate
        return not point.parameters.liquid.has_memory and bool((estimate.irregular_dU > estimate.regular_dU).any())

    def _nominal(self, point: Point) -> tuple[float, ...]:
        return self.problem.nominal(point.gaps)

    def _refine(self, point: Point) -> bool:
        """Go on to a finer mesh for a point; False if there is none."""
        place = self._nominal(point)
        if self.rounds[place] >= ROUNDS:
            return False
        estimate, allowed = point.estimate, self.allowed(point)
        room = allowed - estimate.ends_error - estimate.regularisation_error - np.abs(estimate.newton_dU)
        least = np.maximum(LEAST_ROOM * allowed, estimate.regularisation_error / 2)
        # No mesh helps; coarse ones overestimate what the ends do.
        if self.rounds[place] and (room < LEAST_ROOM * allowed).any() and not estimate.regularisation_error.any():
            return False
        if (estimate.regularisation_error > np.maximum(allowed, estimate.cells_dU)).any():
            return False
        room = np.maximum(room, least)
        problem = self._finer(point, AIM * room)
        if problem is None:
            return False
        self.rounds[place] += 1
        return self._go_on(problem, point.parameters)

    def _finer(self, point: Point, most: Array) -> SteadyProblem | None:
        """The problem with cells that should leave no more than `most` of every dU; None if all cells are held."""
        estimate, elastic = point.estimate, point.parameters.liquid.has_memory
        if estimate.cells is not None and not self._held and (estimate.irregular_dU >= estimate.regular_dU).all():
            self._fields[self._nominal(point)] = self._sizes(point, most)
            sizes = AdaptedSizes(tuple(self._fields.values()))
            return replace(self.problem, mesh=replace(self.problem.mesh, sizes=sizes))
        if "Np" in self._held:
            return None
        order = ELASTIC_ORDER if elastic else ORDER
        finer = float(np.max(estimate.cells_dU / most)) ** (1 / order)
        mesh = self.problem.mesh.scaled(1 / float(np.clip(finer, *FACTORS)), FEWEST_CELLS)
        kept = {name: getattr(self.problem.mesh, name) for name in self._held}
        return replace(self.problem, mesh=replace(mesh, **kept))

    def _sizes(self, point: Point, most: Array) -> SizeField:
        """Cell sizes for a point."""
        estimate, cells = point.estimate, point.estimate.cells
        assert cells is not None, "liquids that are not Newtonian have them"
        scatter = estimate.of_scatter * (1 + estimate.regular_dU / estimate.irregular_dU)
        largest_factor = MOST_FACTOR
        if self.rounds[self._nominal(point)]:  # smaller cells where the scatter came from were not enough
            common = float(np.max(estimate.cells_dU / most))
            largest_factor = float(np.clip(common ** (-1 / ORDER), LEAST_COMMON, 1.0))
        mesh = self.problem.mesh
        field = cells.sizes(most / scatter, largest_factor, mesh.rows or self.problem.length)
        # Without modes cells that contribute nothing to dU carry the profile, and with it the pressure drop.
        return field if point.parameters.liquid.has_memory else field.at_most(mesh.max_size)

    def _go_on(self, problem: SteadyProblem, parameters: Parameters) -> bool:
        """Carry the solution over to other cells; False, with the old ones kept, if that fails."""
        solver = _carried_over(problem, parameters, self.solver)
        if solver is None:
            return False
        solver.take_over_costs(self.solver)
        self.solver.close()
        self.solver = solver
        self._known = [solver.snapshot]
        return True
