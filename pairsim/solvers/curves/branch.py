"""A branch of quasi-steady solutions: its meshes, points and zeros."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pairsim.fem.diagnostics import Observation, liquid_distortion
from pairsim.fem.meshes.remeshing import GAP_RATIO
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.solvers.curves.sensitivities import sensitivities
from pairsim.solvers.curves.slow_manifold import SlowMotion, slow_motion
from pairsim.solvers.errors.adjoints import Adjoints
from pairsim.solvers.errors.estimate import ErrorEstimate, ErrorEstimator
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.bordered import solve_with
from pairsim.solvers.steady.continuation import follow, new_mesh
from pairsim.solvers.steady.first_solution import COARSER, coarser, first_scene, started
from pairsim.solvers.steady.relaxation import relaxation_time
from pairsim.solvers.steady.scene import Steady
from pairsim.solvers.steady.snapshot import Snapshot
from pairsim.solvers.steady.tangents import gap_tangents

# Factor by which a zero may lie outside the interval between two points of opposite sign; chosen.
BESIDE = 1.05
# Logarithm of the ratio of parameters between known solutions. Closer ones are not kept: a solution takes much memory,
# and a known one is only needed where the present one is far away. Chosen.
SPACING = 0.05


@dataclass(frozen=True)
class Point:
    """A quasi-steady solution.

    Attributes:
        parameters: Parameters of the solution.
        held: Quantities evaluated from the solution, with the distances held.
        motion: What moving adds to the velocities.
        t_relax: Slowest decay time of a disturbance at held distances [D_c/U_av].
        slopes: Derivative of every dU at held distances when all distances change equally, shape (N-1,).
        sensitivities: Derivatives of the same dU with respect to Ca_e, De and beta; empty unless requested.
        estimate: Estimate of the discretisation errors.
        mesh_errors: |dU - dU on a mesh with cells 2^0.5 times larger|, None without that mesh.
        newton: Newton iterations since the previous point.
        meshes: Number of meshes generated so far.
        distortion: Smallest ratio of a liquid cell's current to its reference Jacobian.
    """

    parameters: Parameters
    held: Observation
    motion: SlowMotion
    t_relax: float
    slopes: Array
    sensitivities: dict[str, Array]
    estimate: ErrorEstimate
    mesh_errors: Array | None
    newton: int
    meshes: int
    distortion: float

    @property
    def gaps(self) -> tuple[float, ...]:
        """Distances between facing surfaces, N-1 values."""
        return self.parameters.gaps

    @property
    def d(self) -> float:
        """First distance; for a curve all distances are equal."""
        return self.gaps[0]

    @property
    def observation(self) -> Observation:
        """The quantities of the solution with the velocities of particles that move, on the slow manifold."""
        return replace(self.held, U=self.held.U + self.motion.U)

    @property
    def dUs(self) -> Array:
        """Relative velocities of neighbouring particles that move, on the slow manifold, shape (N-1,)."""
        return np.diff(self.held.U + self.motion.U)

    @property
    def held_dUs(self) -> Array:
        """Relative velocities of neighbouring particles at held distances, shape (N-1,)."""
        return self.held.dU

    @property
    def dU(self) -> float:
        """First relative velocity, that of a pair."""
        return float(self.dUs[0])

    @property
    def dU_errors(self) -> Array:
        """Errors of the relative velocities, half-widths of intervals, (N-1,)."""
        return self.estimate.dU_error + self.motion.remainder

    @property
    def slope_at_rest(self) -> float:
        """Derivative of the dU of a pair by its distance where dU vanishes, to first order in the neglected terms."""
        return float(self.slopes[0]) * (1 + self.motion.response)


class Branch:
    """Solutions of one scene at any parameters, each continued from the nearest known solution.

    Args:
        problem: The problem.
        parameters: Parameters of the first solution.
        mesh_error: Whether to solve on a coarser mesh too, as a check of the estimated error.
        sensitivities: Whether to compute derivatives with respect to Ca_e, De and beta.
        scout: A solution on a coarser mesh at these parameters to start from, which is closed; None to find one.

    Raises:
        NoSteadyState: No solution was found at the first parameters.
        MeshFailure: A mesh could not be generated.
    """

    def __init__(
        self,
        problem: SteadyProblem,
        parameters: Parameters,
        mesh_error: bool,
        sensitivities: bool = False,
        *,
        scout: Steady | None = None,
    ) -> None:
        self._sensitivities, self._estimator = sensitivities, ErrorEstimator()
        self.scenes: list[Steady] = []
        try:
            self.scenes.append(first_scene(problem, parameters, scout))
            if mesh_error:
                with _for_the_error():
                    self.scenes.append(started(coarser(problem, COARSER), parameters, self.fine))
        except (NoSteadyState, MeshFailure):
            self.close()
            raise
        self._known = [[scene.snapshot] for scene in self.scenes]

    @property
    def fine(self) -> Steady:
        """The scene on the mesh of the problem, as opposed to the coarser one."""
        return self.scenes[0]

    def move(self, parameters: Parameters) -> None:
        """Continue to the first parameters of another curve; resets counters, times and the list of known solutions.

        Raises:
            NoSteadyState: The continuation did not reach the parameters.
        """
        for scene in self.scenes:
            scene.forget_costs()
        self._nearest(parameters, 0.0)
        self._follow(parameters)
        for scene in self.scenes:
            if scene.scene.reference.deformed:  # as for a curve that is computed on its own, try spheres first
                new_mesh(scene, afresh=True)
        self._known = [[scene.snapshot] for scene in self.scenes]

    def at(self, parameters: Parameters) -> Point:
        """The solution at given parameters.

        Raises:
            NoSteadyState: The continuation did not reach the parameters.
        """
        before = self.fine.iterations
        self._nearest(parameters)
        self._follow(parameters)
        for scene, known in zip(self.scenes, self._known, strict=True):
            if min(_apart(snapshot.parameters, parameters) for snapshot in known) > SPACING:
                known.append(scene.snapshot)
        return self._read(before)

    def _follow(self, parameters: Parameters) -> None:
        """Continue the solutions on all meshes to given parameters."""
        follow(self.fine, parameters)
        with _for_the_error():
            for scene in self.scenes[1:]:
                follow(scene, parameters)

    def zero(self, left: float, right: float, guess: float) -> Point:
        """Solve for a distance between two others at which dU vanishes, with dU = 0 as additional equation.

        Args:
            left: Smaller distance.
            right: Larger distance.
            guess: First guess of the zero.

        Raises:
            NoSteadyState: No zero was found; the previous solutions are restored.
        """
        fine, old = self.fine, self.snapshots
        before = fine.iterations
        here = fine.parameters
        along = partial(here.with_gap(left).towards, here.with_gap(right))
        start = (guess - left) / (right - left)
        try:
            self._nearest(along(start))
            follow(fine, along(start))
            point = self.zero_on(along, start, fine.y, settled=True)
            if point is None or not left / BESIDE < point.d < right * BESIDE:
                raise NoSteadyState(f"the zero of dU near d = {guess:.5g} was not found")
        except (NoSteadyState, MeshFailure):
            self.recall(old)
            raise
        return replace(point, newton=fine.iterations - before)

    def improved(self, zero: Point) -> Point:
        """The present zero on a mesh that keeps its error small; without adaptation the zero itself."""
        return zero

    def zero_on(self, along: Callable[[float], Parameters], tau: float, y: Array, *, settled: bool) -> Point | None:
        """Solve for the point on a line of parameters at which dU vanishes; None if Newton's method fails.

        Args:
            along: Parameters as a function of tau.
            tau: First guess of tau.
            y: First guess of the unknowns, on the present mesh of the scene, shape (n_y,).
            settled: Whether to solve again on the mesh for the distance of the zero, so that the result does not depend
                on the previous solutions.
        """
        fine = self.fine
        before = fine.iterations
        found, _ = solve_with(fine, along, tau, y, fine.velocity_row(), 0.0, 0.0)
        if found is not None and settled:
            found = self._settled(along, found)
        if found is None:
            return None
        self._follow(fine.parameters)
        return self._read(before)

    def _settled(self, along: Callable[[float], Parameters], tau: float) -> float | None:
        """Solve for a zero again on the mesh for its distance, until the zero does not change the mesh.

        If two meshes lead alternately to the distance of the other one, the mesh for the smaller distance is used.
        """
        fine, found = self.fine, tau
        made: set[tuple[float, ...]] = set()
        last: tuple[float, ...] = (np.inf,)
        while True:
            wanted = fine.problem.nominal(fine.parameters.gaps)
            if wanted in made and wanted >= last:
                return found
            again = wanted in made
            made.add(wanted)
            fine.remesh(afresh=True)
            place, _ = solve_with(fine, along, found, fine.y, fine.velocity_row(), 0.0, 0.0)
            if place is None or again:
                return place
            found, last = place, wanted

    @property
    def snapshots(self) -> tuple[Snapshot, ...]:
        """Present solutions on all meshes."""
        return tuple(scene.snapshot for scene in self.scenes)

    def recall(self, snapshots: Sequence[Snapshot]) -> None:
        """Restore stored solutions on all meshes."""
        for scene, snapshot in zip(self.scenes, snapshots, strict=True):
            scene.recall(snapshot)

    def _nearest(self, parameters: Parameters, margin: float = float(np.log(GAP_RATIO))) -> None:
        """Restore the known solution nearest to given parameters if it is nearer than the present one."""
        for scene, known in zip(self.scenes, self._known, strict=True):
            nearest = min(known, key=lambda snapshot: _apart(snapshot.parameters, parameters))
            if _apart(scene.parameters, parameters) > margin + _apart(nearest.parameters, parameters):
                scene.recall(nearest)

    def _read(self, iterations_before: int) -> Point:
        fine = self.fine
        fine.factor()
        adjoints = Adjoints.of(fine)
        slopes = np.diff(gap_tangents(fine).sum(axis=0)[fine.constraints.fields["U_p"]])
        held = fine.observe()
        errors = None
        if len(self.scenes) > 1:
            coarse = self.scenes[1]
            errors = np.abs(held.dU - np.diff(coarse.y[coarse.constraints.fields["U_p"]]))
        estimate, t_relax = self._estimator.estimate(fine, adjoints), relaxation_time(fine)
        return Point(
            fine.parameters,
            held,
            slow_motion(fine, adjoints, t_relax, float(estimate.dU_error.min(initial=np.inf))),
            t_relax,
            slopes,
            sensitivities(fine, adjoints) if self._sensitivities else {},
            estimate,
            errors,
            fine.iterations - iterations_before,
            fine.meshes,
            liquid_distortion(fine.scene, fine.state()[1]),
        )

    def close(self) -> None:
        """Free the memory of the solvers."""
        for scene in self.scenes:
            scene.close()


@contextmanager
def _for_the_error() -> Iterator[None]:
    """Context that marks failures as those of the coarser mesh, which serves to estimate the error."""
    try:
        yield
    except (NoSteadyState, MeshFailure) as failure:
        message = f"on the coarser mesh from which mesh_error is estimated: {failure.message}"
        raise NoSteadyState(message, advice="mesh_error: false, or a larger mesh.Np") from failure


def _apart(a: Parameters, b: Parameters) -> float:
    """Distance between two sets of parameters: logarithm of the largest ratio of a parameter."""
    pairs = [*zip(a.gaps, b.gaps, strict=True), *zip(a.Ca_es, b.Ca_es, strict=True), (a.De, b.De)]
    return max((abs(float(np.log(x / y))) for x, y in pairs if x and y), default=0.0)
