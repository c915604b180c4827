"""A branch of quasi-steady solutions: points at arbitrary parameters, with their errors, and zeros of dU."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

import numpy as np

from pairsim.fem.diagnostics import Observation, liquid_distortion
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.runtime.message import Message
from pairsim.solvers.curves.point import Point, moving
from pairsim.solvers.curves.sensitivities import by_each_particle, sensitivities
from pairsim.solvers.curves.slow_manifold import FirstOrder, SlowMotion
from pairsim.solvers.curves.unyielded_bridge import UnyieldedBridge
from pairsim.solvers.errors.adjoints import Adjoints
from pairsim.solvers.errors.estimate import ErrorEstimate, ErrorEstimator, GoalEstimate
from pairsim.solvers.goals import Goal, Scale, dU
from pairsim.solvers.meshed_scene import GAP_RATIO
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.bordered import solve_with
from pairsim.solvers.steady.continuation import IN_TIME, follow, where
from pairsim.solvers.steady.ends import Ended
from pairsim.solvers.steady.first_solution import scene_past_end
from pairsim.solvers.steady.linearisation import Linearisation
from pairsim.solvers.steady.relaxation import relaxation_time
from pairsim.solvers.steady.scene import Snapshot, SteadySolver

# Factor in distance by which a zero may lie outside the interval between two points of opposite sign; chosen.
BESIDE = 1.05
# Least distance between stored solutions, as the logarithm of a ratio of parameters. Closer ones are not stored: a
# solution takes much memory, and is only needed where the present one is far away. Chosen.
SPACING = 0.05
ZERO_TOLERANCE = 0.1  # fraction of its half-width up to which dU counts as zero; chosen
# Largest |dU| over its half-width, and largest step to the zero relative to d, at which the zero is extrapolated from a
# point with the slope of dU. Chosen.
NEAR_ZERO, BESIDE_ZERO = 1.0, 0.02
MOST_CORRECTIONS = 4  # largest number of solutions on the way to `ZERO_TOLERANCE`; chosen
NEWTON_PART = 0.1  # fraction of a goal's half-width above which the error of Newton's method is reduced; chosen
MOST_STEPS = 6  # largest number of further steps that this takes; chosen
# Fraction w of such a step that is taken. Where the stress of a power law of exponent n vanishes, a step multiplies the
# error by 1 - w/n, which alternates its sign if w is 1; elsewhere by 1 - w.
SHORTER = 0.7


class Branch:
    """Solutions of one scene at arbitrary parameters, each continued from the nearest known solution.

    Args:
        solver: The solver at its first solution; `close` closes it.
        sensitivities: Names of parameters with respect to which dU is differentiated, as for the function
            `sensitivities`.
        goals: Quantities of interest.
        by_particle: Whether velocities are differentiated with respect to diameter and Ca_e of each particle.

    Attributes:
        goals: Quantities of interest.
        solver: The solver at the present solution.
    """

    def __init__(
        self,
        solver: SteadySolver,
        sensitivities: Collection[str] = (),
        goals: Sequence[Goal] = (dU,),
        by_particle: bool = False,
    ) -> None:
        self._by_particle = by_particle
        self.goals, self._sensitivities, self._estimator = goals, sensitivities, ErrorEstimator()
        self._zeros_wanted = any(goal.scale is Scale.DISTANCE for goal in goals)
        self._at_zero = 0.0  # correction of dU at the last zero, which is expected at the next one
        self.solver = solver
        self._known = [self.solver.snapshot]
        self._first: FirstOrder | None = None  # that of the last point

    def at(self, parameters: Parameters) -> Point | Ended:
        """The solution at given parameters, or the reason why the continuation did not reach them.

        Raises:
            NoSteadyState: The error there cannot be estimated, or the matrix is singular.
        """
        found = self._begun_at(parameters)
        return found if isinstance(found, Ended) else self.completed(found)

    def _begun_at(self, parameters: Parameters) -> Point | Ended:
        """As `at`, but the point is not complete unless the liquid has a yield stress."""
        before = self.solver.iterations
        self._nearest(parameters)
        if (ended := self._follow(parameters)) is not None:
            return ended
        if min(_apart(snapshot.parameters, parameters) for snapshot in self._known) > SPACING:
            self._known.append(self.solver.snapshot)
        return self._read(before)

    def _follow(self, parameters: Parameters) -> Ended | None:
        """Continue to other parameters; None if they are reached, otherwise the reason why not.

        Where the branch of a single particle seems to end, finer cells on the particle are tried: they may have a
        solution beyond that end, from which the branch then continues.
        """
        ended = follow(self.solver, parameters)
        if ended is None or not ended.kind or parameters.gaps:
            return ended
        found = scene_past_end(self.solver.problem, parameters, ended)
        if isinstance(found, Ended):
            return found
        found.take_over_costs(self.solver)
        self.solver.close()
        self.solver, self._known = found, [found.snapshot]
        return None

    def zero(self, left: float, right: float, guess: float) -> Point | None:
        """The solution at a distance between two others at which dU vanishes, by Newton's method in the distance.

        Every iterate is solved on the mesh for its own distance. If two such meshes each have their zero at the
        distance of the other one, the zero on the last mesh is returned.

        Args:
            left: Smaller distance [D_c].
            right: Larger distance [D_c].
            guess: First guess of the zero [D_c].

        Returns:
            The zero. If distances of zeros are a goal, it is a complete point. Otherwise it is not complete, and may be
            a point beside the zero, but so near that the zero can be extrapolated with the slope of dU. None if no zero
            was found; the previous solution is then restored.

        Raises:
            NoSteadyState, MeshFailure: As for `at`; the previous solution is restored.
        """
        solver, old = self.solver, self.solver.snapshot
        before, parameters, d = solver.iterations, solver.parameters, guess
        try:
            for _ in range(MOST_CORRECTIONS):
                found = self._begun_at(parameters.with_gap(d))
                if isinstance(found, Ended):
                    break
                point = found
                left_over, half_width = float(point.held_dUs[0]), float(point.estimate[dU].half_width[0])
                step = -left_over / float(point.slopes[0])
                near = abs(left_over) <= NEAR_ZERO * half_width and abs(step) <= BESIDE_ZERO * d
                if abs(left_over) <= ZERO_TOLERANCE * half_width or (near and not self._zeros_wanted):
                    return self._zero_of(point, before)
                d += step
                if not left / BESIDE < d < right * BESIDE:
                    break
            else:  # meshes for two distances may each have their zero at the distance of the other mesh
                self._at_zero = float(point.correction[0])
                on_mesh = self.zero_on(parameters.with_gap, point.d, solver.y, settled=False)
                if on_mesh is not None and left / BESIDE < on_mesh.d < right * BESIDE:
                    return self._zero_of(on_mesh, before)
        except (NoSteadyState, MeshFailure):
            self.recall(old)
            raise
        self.recall(old)
        return None

    def _zero_of(self, point: Point, iterations_before: int) -> Point:
        """The present point as a zero, with the number of Newton iterations since there were `iterations_before`."""
        found = self.completed(point) if self._zeros_wanted else point
        return replace(found, newton=self.solver.iterations - iterations_before)

    def improved(self, zero: Point) -> Point:
        """The present zero on a mesh on which its error is small enough; without adaptation, the zero itself."""
        return zero

    def zero_on(self, along: Callable[[float], Parameters], tau: float, y: Array, *, settled: bool) -> Point | None:
        """Solve for the point on a line of parameters at which the corrected dU vanishes; None if that fails.

        Args:
            along: Parameters as a function of tau.
            tau: First guess of tau.
            y: First guess of the unknowns, on the present mesh of the scene, shape (n_y,).
            settled: Whether to solve again on the mesh for the distance of the zero, so that the result does not depend
                on earlier solutions.
        """
        solver = self.solver
        before, place, point = solver.iterations, tau, None
        for _ in range(MOST_CORRECTIONS):
            found = solve_with(solver, along, place, y, solver.velocity_row(), -self._at_zero)
            if found is not None and settled and not solver.as_made:
                found = self._settled(along, found)
            if found is None:
                return None
            point, place, y = self._read(before), found, solver.y
            left, self._at_zero = point.held_dUs[0], float(point.correction[0])
            if abs(left) <= ZERO_TOLERANCE * point.estimate[dU].half_width[0]:
                break
        return None if point is None else self.completed(point)

    def _settled(self, along: Callable[[float], Parameters], tau: float) -> float | None:
        """Solve for a zero again on the mesh for its distance, until the mesh does not change any more.

        If each of two meshes has its zero at the distance of the other one, the mesh for the smaller distance is used.

        Returns:
            The coordinate tau of the zero; None if it was not found.
        """
        solver, found = self.solver, tau
        made: set[tuple[float, ...]] = set()
        last: tuple[float, ...] = (np.inf,)
        while True:
            wanted = solver.problem.nominal(solver.parameters.gaps)
            if wanted in made and wanted >= last:
                return found
            again = wanted in made
            made.add(wanted)
            solver.remesh(afresh=True)
            place = solve_with(solver, along, found, solver.y, solver.velocity_row(), -self._at_zero)
            if place is None or again:
                return place
            found, last = place, wanted

    def recall(self, snapshot: Snapshot) -> None:
        """Restore a stored solution."""
        self.solver.recall(snapshot)

    def return_to(self, zero: Point, snapshot: Snapshot) -> None:
        """Restore a stored zero; the correction of dU at the next zero is expected to be the same."""
        self.recall(snapshot)
        self._at_zero = float(zero.correction[0])

    def _nearest(self, parameters: Parameters) -> None:
        """Restore the stored solution nearest to given parameters if it is much nearer than the present one."""
        margin = float(np.log(GAP_RATIO))
        nearest = min(self._known, key=lambda snapshot: _apart(snapshot.parameters, parameters))
        if _apart(self.solver.parameters, parameters) > margin + _apart(nearest.parameters, parameters):
            self.solver.recall(nearest)

    def _read(self, iterations_before: int) -> Point:
        """The present solution as a point, which is not complete unless the liquid has a yield stress."""
        solver = self.solver
        at, adjoints, discrete, estimate = self._estimated()
        most = {goal: _allowed_to_newton(estimate[goal]) for goal in self.goals}
        if any((np.abs(estimate[goal].newton) > most[goal]).any() for goal in self.goals):
            for _ in range(MOST_STEPS):
                solver.forget()
                residual = solver.linearise(SHORTER).residual
                if all((np.abs(adjoints.change(goal, residual)) <= most[goal]).all() for goal in self.goals):
                    break
            at, adjoints, discrete, estimate = self._estimated()
        held_slopes = at.gap_tangents[:, solver.constraints.fields["U_p"]].T
        varied = solver.parameters.varied
        if not all(np.isfinite(each.correction).all() for each in estimate.values()):
            said = Message("the estimate of the error is no number at {}", where(solver.parameters))
            raise NoSteadyState(said, advice=IN_TIME)
        held = estimate.corrected(discrete)
        self._first = first = FirstOrder.of(at, held.dU, adjoints)
        gaps = np.zeros(len(held.dU))
        point = Point(
            solver.parameters,
            discrete,
            held,
            first.motion,
            np.nan,
            np.diff(held_slopes.sum(axis=1) if varied is None else held_slopes[:, varied]),
            held_slopes,
            {},
            estimate,
            self._values(estimate, held, first.motion),
            UnyieldedBridge(gaps, np.full_like(gaps, np.nan), 0.0),
            solver.iterations - iterations_before,
            solver.meshes,
            liquid_distortion(solver.scene, solver.state()[1]),
            complete=False,
        )
        # Whether unyielded liquid holds the particles together affects what is computed next, and takes another solve.
        return self.completed(point) if solver.parameters.liquid.plastic.yield_stress else point

    def completed(self, point: Point) -> Point:
        """The complete point; `point` must be complete already, or be the last one of this branch."""
        if point.complete:
            return point
        first, solver, errors = self._first, self.solver, point.estimate[dU].half_width
        assert first is not None
        assert first.at is solver.linearised, "the solver has gone on to another point"
        t_relax = relaxation_time(first.at)
        motion = first.slow_motion(t_relax, float(errors.min(initial=np.inf)))
        known = first.at, first.adjoints, first.dU, motion
        sensitive = sensitivities(*known, self._sensitivities) if self._sensitivities else {}
        by_particle = by_each_particle(*known) if self._by_particle else point.by_particle
        undecided = np.abs(np.diff(point.held.U + motion.U)) <= errors + motion.remainder
        return replace(
            point,
            motion=motion,
            t_relax=t_relax,
            sensitivities=sensitive,
            values=self._values(point.estimate, point.held, motion),
            by_particle=by_particle,
            unyielded=UnyieldedBridge.of(solver, undecided),
            complete=True,
        )

    def _values(self, estimate: ErrorEstimate, held: Observation, motion: SlowMotion) -> dict[Goal, Array]:
        solution, observation = self.solver.solution, moving(held, motion)
        return {goal: estimate.value(goal, solution, observation) for goal in self.goals}

    def _estimated(self) -> tuple[Linearisation, Adjoints, Observation, ErrorEstimate]:
        """The present solution after a step with the exact matrix, with its adjoints, quantities and their errors."""
        at = self.solver.linearise()
        adjoints, discrete = Adjoints.of(at, self.goals), self.solver.observe()
        return at, adjoints, discrete, self._estimator.estimate(at, adjoints, discrete)

    def close(self) -> None:
        """Free the memory of the solvers."""
        self.solver.close()


def _allowed_to_newton(estimate: GoalEstimate) -> Array:
    """The error of a goal that Newton's method may leave, (k,)."""
    return NEWTON_PART * (estimate.half_width - np.abs(estimate.newton))


def _apart(a: Parameters, b: Parameters) -> float:
    """Distance between two sets of parameters: the logarithm of the largest ratio of a distance, a Ca_e or De."""
    pairs = [*zip(a.gaps, b.gaps, strict=True), *zip(a.Ca_es, b.Ca_es, strict=True), (a.De, b.De)]
    return max((abs(float(np.log(x / y))) for x, y in pairs if x and y), default=0.0)
