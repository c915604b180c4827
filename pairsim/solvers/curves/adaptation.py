"""Quasi-steady solutions on meshes that follow from the error wanted.

A point whose estimated error is too large is solved again on a mesh made for it, up to ROUNDS times. Where the scatter
of the estimate prevails, in viscoelastic liquids only, cells become smaller where they contribute to it
(`pairsim.fem.meshes.size_field`); where its signed part prevails all cells do. Meshes are kept by the distances for
which meshes are made (`SteadyProblem.nominal`): neighbouring points share them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from pairsim.fem.meshes.size_field import MOST_FACTOR, AdaptedSizes, SizeField
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.solvers.curves.branch import BESIDE, Branch, Point
from pairsim.solvers.curves.curve import ROUNDING
from pairsim.solvers.errors.estimate import SAFETY, ErrorEstimator
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.continuation import follow
from pairsim.solvers.steady.first_solution import COARSER, SCOUT_TOLERANCE, coarser, scouted, started, walked
from pairsim.solvers.steady.scene import Steady
from pairsim.solvers.steady.snapshot import Snapshot

ROUNDS = 3
# Factors of the cells of the mesh from which adaptation starts in a Newtonian and in a viscoelastic liquid, over those
# that `accuracy` sets everywhere, and its fewest cells on a half-circle; chosen.
START, ELASTIC_START, START_CELLS = 1.4, 1.8, 14
# Part of the error allowed that a mesh is made for, and the part that the ends of the tube must leave to the cells.
AIM, LEAST_ROOM = 0.8, 0.2
# Order in the cell size of the signed part of the error in a Newtonian (chosen) and a viscoelastic liquid (measured:
# docs/explanation/decisions.md), and bounds on the factor by which all cells become smaller in a round; chosen.
ORDER, ELASTIC_ORDER, FACTORS = 3.0, 4.5, (1.15, 2.0)
# Least factor of the cells that contribute nothing to the scatter, in a second or third round; chosen.
LEAST_COMMON = 0.8
# Distances of the scout that gives the size of dU where the case itself has few distances [D_c], the largest number of
# those of the case that are taken, and the scout's cells: number on a half-circle, growth, and largest size relative to
# the smallest diameter. Chosen; of ten peaks (beta .2 to .6, De 0 to 2) the largest dU at the three distances was 83 to
# 100 %.
SCALE_DISTANCES, ENOUGH, MOST_PLACES = (0.4, 0.2, 0.1), 3, 6
SCALE_CELLS, SCALE_GROWTH, SCALE_SIZE = 10, 0.3, 0.35


@dataclass(frozen=True)
class Scale:
    """The size of dU to which errors are compared.

    Attributes:
        dU: Largest |dU| of a coarse solution [U_av].
        at: Distances at which it was looked for, of each solution.
    """

    dU: float
    at: tuple[tuple[float, ...], ...]


def reference_scale(
    problem: SteadyProblem, parameters: Parameters, places: Sequence[tuple[float, ...]]
) -> tuple[Scale, Steady]:
    """The largest |dU| of a curve, or of the curve that a single point lies on, from coarse solutions.

    Args:
        problem: The problem.
        parameters: Its first parameters.
        places: The distances of the case.

    Returns:
        The scale, and the coarse scene at the first parameters.

    Raises:
        NoSteadyState: There is no solution at the first parameters.
        MeshFailure: No mesh could be made for them.
    """
    first = parameters.gaps
    wanted = set(places)
    if len(wanted) < ENOUGH:
        # Distances are widened only as far as meshes for them fit into the tube.
        others = {tuple(d for _ in first) for d in SCALE_DISTANCES}
        room = problem.length - sum(problem.betas) - max(map(sum, wanted))
        wanted |= {o for o in others if sum(o) - max(map(sum, wanted)) < room / 4}
    elif len(wanted) > MOST_PLACES:
        ordered = sorted(wanted)
        wanted = {ordered[i] for i in np.linspace(0, len(ordered) - 1, MOST_PLACES).round().astype(int)}
    size = max(problem.mesh.max_size, SCALE_SIZE * min(problem.betas))
    cells = replace(problem.mesh, Np=SCALE_CELLS, growth=SCALE_GROWTH, max_size=size, gap_cells=0, wall_cells=0)
    rough = replace(problem.newton, tolerance=SCOUT_TOLERANCE)
    try:
        scout = walked(replace(problem, mesh=cells, newton=rough), parameters)
    except NoSteadyState:  # cells as large as these may miss it
        scout = scouted(problem, parameters)
    start, found = scout.snapshot, {first: _largest(scout)}
    wider = sorted(gaps for gaps in wanted if gaps > first)
    narrower = sorted((gaps for gaps in wanted if gaps < first), reverse=True)
    for side in (wider, narrower):
        with suppress(NoSteadyState, MeshFailure):  # soft particles at the narrowest distances
            for gaps in side:
                follow(scout, replace(parameters, gaps=gaps))
                found[gaps] = _largest(scout)
        scout.recall(start)
    return Scale(max(found.values()), tuple(sorted(found, reverse=True))), scout


def _largest(scout: Steady) -> float:
    """The largest |dU| of a solution [U_av]."""
    return float(np.abs(np.diff(scout.y[scout.constraints.fields["U_p"]])).max())


class AdaptiveBranch(Branch):
    """A branch whose points are solved on finer meshes until their estimated errors are small enough.

    Args:
        problem: The problem, with the cells that `accuracy` sets everywhere.
        parameters, mesh_error, sensitivities, scout: As for `Branch`.
        allowed: Largest error of dU as a function of the parameters [U_av].
        zeros_only: Whether only zeros are solved again, not the points among which they are looked for.

    Attributes:
        rounds: Number of rounds at each of the distances for which meshes are made.
        unknowns: Unknowns of the meshes with which points were accepted, by the same distances.
    """

    def __init__(
        self,
        problem: SteadyProblem,
        parameters: Parameters,
        mesh_error: bool,
        sensitivities: bool = False,
        *,
        allowed: Callable[[Parameters], float],
        zeros_only: bool = False,
        scout: Steady | None = None,
    ) -> None:
        self._allowed, self._zeros_only = allowed, zeros_only
        start = coarser(problem, ELASTIC_START if parameters.liquid.modes else START, START_CELLS)
        super().__init__(start, parameters, mesh_error, sensitivities, scout=scout)
        self._estimator = ErrorEstimator(cells=True)
        self._fields: dict[tuple[float, ...], SizeField] = {}
        self.rounds: Counter[tuple[float, ...]] = Counter()
        self.unknowns: dict[tuple[float, ...], int] = {}

    @property
    def problem(self) -> SteadyProblem:
        """The problem with the cells of the present mesh."""
        return self.fine.problem

    def at(self, parameters: Parameters) -> Point:
        """The solution at given parameters, on a mesh that keeps its error small where one was found."""
        if self._zeros_only:
            return super().at(parameters)
        return self._kept(lambda _: super(AdaptiveBranch, self).at(parameters))

    def zero(self, left: float, right: float, guess: float) -> Point:
        """A zero of dU as by `Branch.zero`, on a mesh that keeps the error of dU small where one was found."""
        return self._kept(lambda last: super(AdaptiveBranch, self).zero(left, right, last.d if last else guess))

    def improved(self, zero: Point) -> Point:
        """The present zero on a mesh that keeps the error of dU small where one was found."""
        if not self._too_large(zero):
            return zero
        again = super().zero
        return self._kept(lambda last: again(last.d / BESIDE, last.d * BESIDE, last.d) if last else zero)

    def recall(self, snapshots: Sequence[Snapshot]) -> None:
        """Restore stored solutions; what was stored with other cells is solved for with the present ones.

        Raises:
            NoSteadyState: The continuation with the present cells did not reach the stored parameters.
        """
        if snapshots[0].reference.outlines[0] is self.fine.meshed.outlines[0]:
            super().recall(snapshots)
        else:
            self._nearest(snapshots[0].parameters)
            self._follow(snapshots[0].parameters)

    def _too_large(self, point: Point) -> bool:
        return bool((point.estimate.dU_error > self._allowed(point.parameters)).any())

    def _kept(self, solve: Callable[[Point | None], Point]) -> Point:
        """Solve for a point, and again on finer meshes while its error is too large."""
        before, point = self.fine.iterations, solve(None)
        while self._too_large(point) and self._refine(point):
            with suppress(NoSteadyState, MeshFailure):
                point = solve(point)
        self.unknowns[self._nominal(point)] = self.fine.constraints.size
        return replace(point, newton=self.fine.iterations - before)

    def _nominal(self, point: Point) -> tuple[float, ...]:
        return self.problem.nominal(point.gaps)

    def _refine(self, point: Point) -> bool:
        """Go on to a finer mesh for a point; False if there is none."""
        place = self._nominal(point)
        if self.rounds[place] >= ROUNDS:
            return False
        estimate, allowed = point.estimate, self._allowed(point.parameters)
        room = allowed - estimate.ends_error - np.abs(estimate.newton_dU)
        least = LEAST_ROOM * allowed
        if self.rounds[place] and (room < least).any():  # no mesh helps; coarse ones overestimate what the ends do
            return False
        room = np.maximum(room, least)
        self.rounds[place] += 1
        most = AIM * room / SAFETY
        elastic = bool(point.parameters.liquid.modes)
        if not elastic or (estimate.regular_dU > estimate.scatter_dU).any():
            order = ELASTIC_ORDER if elastic else ORDER
            finer = float(np.max(estimate.cells_dU / most)) ** (1 / order)
            problem = coarser(self.problem, 1 / float(np.clip(finer, *FACTORS)))
        else:
            self._fields[place] = self._sizes(point, most)
            sizes = AdaptedSizes(tuple(self._fields.values()))
            problem = replace(self.problem, mesh=replace(self.problem.mesh, sizes=sizes))
        return self._go_on(problem, point.parameters)

    def _sizes(self, point: Point, most: Array) -> SizeField:
        """Cell sizes for a point."""
        cells = point.estimate.cells
        assert cells is not None, "an elastic liquid has them"
        largest_factor = MOST_FACTOR
        if self.rounds[self._nominal(point)] > 1:  # smaller cells where the scatter came from were not enough
            common = float(np.max(point.estimate.cells_dU / most))
            largest_factor = float(np.clip(common ** (-1 / ORDER), LEAST_COMMON, 1.0))
        return cells.sizes(most, largest_factor, self.problem.mesh.rows or self.problem.length)

    def _go_on(self, problem: SteadyProblem, parameters: Parameters) -> bool:
        """Carry the solution over to other cells; False, with the old ones kept, if that fails."""
        scenes: list[Steady] = []
        try:
            scenes.append(started(problem, parameters, self.fine))
            if len(self.scenes) > 1:
                scenes.append(started(coarser(problem, COARSER), parameters, self.fine))
        except (NoSteadyState, MeshFailure):
            for scene in scenes:
                scene.close()
            return False
        for scene, old in zip(scenes, self.scenes, strict=True):
            scene.take_over_costs(old)
            old.close()
        self.scenes = scenes
        self._known = [[scene.snapshot] for scene in scenes]
        return True


def has_scale(scale: Scale) -> bool:
    """Whether there is a dU to which errors can be compared: that of equal rigid spheres in Newtonian liquids is 0."""
    return scale.dU > ROUNDING
