"""Master curves: quasi-steady solutions at many distances, points added where the curve bends, and its zeros."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from mpi4py import MPI
from scipy.interpolate import CubicHermiteSpline

from pairsim.case import SceneCase
from pairsim.continuation import begin, cold_start, follow, prepared, towards
from pairsim.curve_case import CurveCase
from pairsim.diagnostics import Observation, liquid_distortion
from pairsim.errors import MeshFailure, NoSteadyState
from pairsim.mesh import Array, MeshSettings
from pairsim.remeshing import GAP_RATIO
from pairsim.response import drift, sensitivities
from pairsim.steady import Parameters, Snapshot, Steady, SteadyProblem

# The mesh that tells the error of the wanted one: its cells are larger by this factor.
COARSER = 2**0.5
FEWEST_CELLS = 8
# The first place is walked to on cells larger by this factor: the way costs many solutions, and they are thrown away.
SCOUT = 2.0
# Where Newton finds no zero between two points, points are added half-way this many times; a zero may lie beside its
# two points by this factor.
HALVINGS, BESIDE = 5, 1.05
# A change of dU this many times larger than its slopes allow is a jump from one mesh to another.
JUMP = 3.0
# Neighbours whose distances have a ratio below exp of this get no point between them.
CLOSE = 0.1


@dataclass(frozen=True)
class Point:
    """A quasi-steady solution.

    Attributes:
        parameters: Where it is.
        observation: What is read off it.
        dp_plus: Pressure drop that the particles cause.
        slopes: d(dU)/dd of every gap when all distances change together.
        drifts: Change of every dU by the terms that a quasi-steady scene leaves out, to first order.
        sensitivities: Derivatives of every dU by Ca_e, De and beta where the scene has them; empty when not asked for.
        mesh_errors: |dU - dU on a mesh with cells 2^0.5 times larger|, None without that mesh.
        newton: Newton iterations on the way from the point before.
        meshes: Meshes made so far.
        distortion: Smallest ratio of a liquid cell's current to its reference Jacobian.
    """

    parameters: Parameters
    observation: Observation
    dp_plus: float
    slopes: Array
    drifts: Array
    sensitivities: dict[str, Array]
    mesh_errors: Array | None
    newton: int
    meshes: int
    distortion: float

    @property
    def gaps(self) -> tuple[float, ...]:
        """Distances, one a gap."""
        return self.parameters.gaps

    @property
    def d(self) -> float:
        """The distance of a curve over one distance."""
        return self.gaps[0]

    @property
    def dU(self) -> float:
        """Velocity of the leading particle relative to the trailing one."""
        return float(self.observation.U[-1] - self.observation.U[0])


@dataclass(frozen=True)
class Zero:
    """A point at which dU vanishes, with what it takes to come back to it: a snapshot of every scene."""

    point: Point
    snapshots: tuple[Snapshot, ...]


@dataclass(frozen=True)
class Equilibrium:
    """A distance at which the pair moves as one.

    Attributes:
        d: The distance.
        slope: d(dU)/dd there; negative is stable.
        peak: Largest |dU| between this zero and the next one or the end, over that of the whole curve.
        d_error: Error of d by the mesh, None without a coarser mesh.
        certain: Whether |dU| exceeds its mesh error somewhere on both sides, up to the next zeros; None without one.
    """

    d: float
    slope: float
    peak: float
    d_error: float | None
    certain: bool | None

    @property
    def stable(self) -> bool:
        """Whether a pair that is displaced a little comes back."""
        return self.slope < 0


def steady_problem(case: SceneCase, narrowest: float) -> SteadyProblem:
    """The part of a validated case that stays along its curve, whose least distance is `narrowest`."""
    settings = MeshSettings(**case.mesh.model_dump())
    return SteadyProblem(
        case.betas, case.tube_length, case.ends == "periodic", settings, case.polymer, narrowest=narrowest
    )


def coarser(problem: SteadyProblem, factor: float) -> SteadyProblem:
    """The same on cells larger by a factor."""
    mesh = problem.mesh
    return replace(
        problem,
        mesh=replace(
            mesh,
            Np=max(FEWEST_CELLS, round(mesh.Np / factor)),
            gap_cells=round(mesh.gap_cells / factor),
            wall_cells=round(mesh.wall_cells / factor),
            growth=mesh.growth * factor,
            max_size=mesh.max_size * factor,
        ),
    )


def walked(comm: MPI.Comm, problem: SteadyProblem, parameters: Parameters) -> Steady:
    """A scene carried to its first place from one that hardly deforms.

    Raises:
        NoSteadyState: The way ends before it.
    """
    scene = Steady(comm, problem, cold_start(parameters))
    try:
        begin(scene)
        follow(scene, parameters)
    except (NoSteadyState, MeshFailure):
        scene.close()
        raise
    return scene


def started(comm: MPI.Comm, problem: SteadyProblem, parameters: Parameters, scout: Steady | None) -> Steady:
    """A scene at its first place: from the solution of a scout on other cells, or walked where that does not do.

    Raises:
        NoSteadyState: There is no solution at the first place.
    """
    if scout is not None:
        scene = Steady(comm, problem, parameters)
        with suppress(MeshFailure):
            scene.adopt(scout)
            if scene.solve(parameters, prepared(scene, parameters, scene.y)).converged:
                return scene
        scene.close()
    return walked(comm, problem, parameters)


class Branch:
    """Solutions of one scene at any distances, each from its nearest neighbour.

    Args:
        comm: Communicator of the case.
        problem: What stays.
        parameters: The first place.
        mesh_error: Solve on a coarser mesh too.
        sensitivities: Find the derivatives by the parameters too.

    Raises:
        NoSteadyState: There is no solution at the first place.
    """

    def __init__(
        self,
        comm: MPI.Comm,
        problem: SteadyProblem,
        parameters: Parameters,
        mesh_error: bool,
        sensitivities: bool = False,
    ) -> None:
        self._sensitivities = sensitivities
        problems = [problem, coarser(problem, COARSER)] if mesh_error else [problem]
        scout = None
        if cold_start(parameters) != parameters:
            with suppress(NoSteadyState, MeshFailure):
                scout = walked(comm, coarser(problem, SCOUT), parameters)
        self.scenes = [started(comm, each, parameters, scout) for each in problems]
        if scout is not None:
            self.fine.take_over_costs(scout)
            scout.close()
        self._known = [[scene.snapshot] for scene in self.scenes]

    @property
    def fine(self) -> Steady:
        """The scene on the wanted mesh."""
        return self.scenes[0]

    def move(self, parameters: Parameters) -> None:
        """Go to the first place of another curve; counts and times begin anew, the solutions on the way are forgotten.

        Raises:
            NoSteadyState: The way there ends before it.
        """
        for scene in self.scenes:
            scene.iterations = scene.factorisations = scene.meshes = 0
            scene.clock.seconds.clear()
        self._nearest(parameters, 0.0)
        for scene in self.scenes:
            follow(scene, parameters)
        self._known = [[scene.snapshot] for scene in self.scenes]

    def at(self, parameters: Parameters) -> Point:
        """The solution at a place.

        Raises:
            NoSteadyState: The way there ends before it.
        """
        before = self.fine.iterations
        self._nearest(parameters)
        for scene, known in zip(self.scenes, self._known, strict=True):
            follow(scene, parameters)
            known.append(scene.snapshot)
        return self._read(before)

    def zero(self, left: float, right: float, guess: float) -> Point:
        """The distance between two others at which dU vanishes, with dU = 0 as one of the equations.

        Raises:
            NoSteadyState: It was not found.
        """
        fine = self.fine
        before = fine.iterations
        here = fine.parameters
        along = towards(here.with_gap(left), here.with_gap(right))
        start = (guess - left) / (right - left)
        self._nearest(along(start))
        follow(fine, along(start))
        point = self.zero_on(along, start, fine.y, settled=True)
        if point is None or not left / BESIDE < point.d < right * BESIDE:
            raise NoSteadyState(f"the zero of dU near d = {guess:.5g} was lost")
        return replace(point, newton=fine.iterations - before)

    def zero_on(self, along: Callable[[float], Parameters], tau: float, y: Array, *, settled: bool) -> Point | None:
        """The place on a line of parameters at which dU vanishes, None where Newton finds none.

        Args:
            along: The line.
            tau, y: First guess of the place and of the unknowns, on the scene's present mesh.
            settled: Solve again on a mesh made for this place, which does not depend on the way here.
        """
        fine = self.fine
        before = fine.iterations
        found, _ = fine.solve_with(along, tau, y, fine.velocity_row(), 0.0, 0.0)
        if found is not None and settled:
            found = self._settled(along, found)
        if found is None:
            return None
        for scene in self.scenes[1:]:
            follow(scene, fine.parameters)
        return self._read(before)

    def _settled(self, along: Callable[[float], Parameters], tau: float) -> float | None:
        """Solve a zero again on the mesh of its own distance, until the mesh and the distance belong together.

        Of two meshes that each lead to the other's distance, that of the smaller one is taken.
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
            place, _ = fine.solve_with(along, found, fine.y, fine.velocity_row(), 0.0, 0.0)
            if place is None or again:
                return place
            found, last = place, wanted

    @property
    def snapshots(self) -> tuple[Snapshot, ...]:
        """The present solution on every mesh."""
        return tuple(scene.snapshot for scene in self.scenes)

    def recall(self, snapshots: Sequence[Snapshot]) -> None:
        """Go back to a solution."""
        for scene, snapshot in zip(self.scenes, snapshots, strict=True):
            scene.recall(snapshot)

    def _nearest(self, parameters: Parameters, margin: float = float(np.log(GAP_RATIO))) -> None:
        """Start from the known solution that is nearest to a place, where it is nearer than the present one."""
        for scene, known in zip(self.scenes, self._known, strict=True):
            nearest = min(known, key=lambda snapshot: _apart(snapshot.parameters, parameters))
            if _apart(scene.parameters, parameters) > margin + _apart(nearest.parameters, parameters):
                scene.recall(nearest)

    def _read(self, iterations_before: int) -> Point:
        fine = self.fine
        fine.factor()
        gaps = fine.parameters.gaps
        velocities = fine.tie.fields["U_p"]
        slopes = np.zeros(len(gaps))
        if gaps:
            change = fine.tangent(lambda tau: replace(fine.parameters, gaps=tuple(d + tau for d in gaps)))
            slopes = np.diff(change[velocities])
        observation = fine.observe()
        errors = None
        if len(self.scenes) > 1:
            coarse = self.scenes[1]
            errors = np.abs(np.diff(observation.U) - np.diff(coarse.y[coarse.tie.fields["U_p"]]))
        return Point(
            fine.parameters,
            observation,
            observation.dp - fine.drop_without_particles(),
            slopes,
            np.diff(drift(fine)),
            sensitivities(fine) if self._sensitivities else {},
            errors,
            fine.iterations - iterations_before,
            fine.meshes,
            liquid_distortion(fine.scene, fine.state()[1]),
        )

    def close(self) -> None:
        """Give the solvers' memory back."""
        for scene in self.scenes:
            scene.close()


def _apart(a: Parameters, b: Parameters) -> float:
    """How far two places are from each other: the largest ratio of a parameter, as a logarithm."""
    pairs = [*zip(a.gaps, b.gaps, strict=True), *zip(a.Ca_es, b.Ca_es, strict=True), (a.De, b.De)]
    return max((abs(float(np.log(x / y))) for x, y in pairs if x and y), default=0.0)


def interpolant(points: list[Point]) -> CubicHermiteSpline:
    """dU over log d, from values and slopes at points in ascending d."""
    d = np.array([p.d for p in points])
    return CubicHermiteSpline(np.log(d), [p.dU for p in points], [p.slopes[0] * p.d for p in points])


def _bend(a: Point, b: Point) -> float:
    """How far dU may be off between two points: two parabolas, each with one of their slopes, disagree there."""
    width = np.log(b.d / a.d)
    return float(abs((a.slopes[0] * a.d + b.slopes[0] * b.d) * width / 4 - (b.dU - a.dU) / 2) / 2)


def _doubtful(points: list[Point], tol: float) -> list[tuple[Point, Point]]:
    """Neighbours between which dU may not be known to tol of its largest value, nor to the error of the mesh."""
    largest = max(abs(p.dU) for p in points)
    mesh = max((float(p.mesh_errors[0]) for p in points if p.mesh_errors is not None), default=0.0)
    return [(a, b) for a, b in pairwise(points) if np.log(b.d / a.d) > CLOSE and _bend(a, b) > max(tol * largest, mesh)]


def trace(
    branch: Branch,
    places: Sequence[tuple[float, ...]],
    tol: float,
    max_points: int,
    found: Callable[[Point, bool], None],
) -> list[Point]:
    """Solve at every wanted place and, where each has one distance for all gaps, at added ones.

    Args:
        branch: A solution.
        places: The wanted distances, in the order in which they are solved.
        tol: Points are added until dU between them is known to this part of its largest value.
        max_points: Most points.
        found: Called with every point and whether it was asked for.

    Returns:
        All points, in ascending d where there is one distance, otherwise in the given order.

    Raises:
        RunFailure: The branch could not be followed; `found` has seen the points before.
    """
    parameters = branch.fine.parameters
    points = []
    for place in places:
        points.append(branch.at(replace(parameters, gaps=place)))
        found(points[-1], True)
    if not all(place and len(set(place)) == 1 for place in places):
        return points
    points.sort(key=lambda p: p.d)
    known: set[tuple[float, float]] = set()
    while len(points) < max_points:
        new = [(a, b) for a, b in _doubtful(points, tol) if (a.d, b.d) not in known]
        if not new:
            break
        curve = interpolant(points)
        largest = max(abs(p.dU) for p in points)
        new = new[: max_points - len(points)]
        if abs(branch.fine.parameters.gaps[0] - new[-1][1].d) < abs(branch.fine.parameters.gaps[0] - new[0][0].d):
            new.reverse()  # begin with the nearest
        for a, b in new:
            d = float(np.sqrt(a.d * b.d))
            point = branch.at(parameters.with_gap(d))
            found(point, False)
            # Halves of a smooth curve bend eight times less; where they do not, what bends is the meshes' difference.
            rough = max(_bend(a, point), _bend(point, b)) > _bend(a, b) / 2
            if rough or abs(point.dU - curve(np.log(d))) < tol * largest:
                known |= {(a.d, d), (d, b.d)}
            points.append(point)
        points.sort(key=lambda p: p.d)
    return points


def order(case: CurveCase) -> list[tuple[float, ...]]:
    """The places in the order in which they are solved: from the widest distance down, where the start is easy."""
    places = case.places
    if case.common:
        wanted = {place[0] for place in places} | set(case.fields)
        return [(d,) * (case.n - 1) for d in sorted(wanted, reverse=True)]
    return places


def find_zeros(branch: Branch, points: list[Point], lost: Callable[[str], None]) -> list[Zero]:
    """All zeros of dU between the points of a curve over one distance.

    Args:
        branch: Any solution.
        points: In ascending d.
        lost: Called with what to tell of a change of sign at which there is no zero.

    Raises:
        NoSteadyState: A zero is there and was not found.
    """
    zeros = []
    for a, b in pairwise(points):
        if a.dU * b.dU < 0:
            found = _zero_between(branch, a, b)
            if isinstance(found, Zero):
                zeros.append(found)
            else:
                lost(found)
    return zeros


def _zero_between(branch: Branch, a: Point, b: Point) -> Zero | str:
    """The zero between two points whose dU have different signs; where dU jumps instead, words for it.

    Raises:
        NoSteadyState: dU goes through zero smoothly and Newton did not find the place.
    """
    for _ in range(HALVINGS):
        roots = interpolant([a, b]).solve(0.0, extrapolate=False)
        middle = float(np.sqrt(a.d * b.d))
        with suppress(NoSteadyState, MeshFailure):
            return Zero(branch.zero(a.d, b.d, float(np.exp(roots[0])) if len(roots) else middle), branch.snapshots)
        point = branch.at(a.parameters.with_gap(middle))
        a, b = (a, point) if a.dU * point.dU < 0 else (point, b)
    if abs(b.dU - a.dU) < JUMP * max(abs(a.slopes[0]), abs(b.slopes[0])) * (b.d - a.d):
        raise NoSteadyState(f"the zero of dU between d = {a.d:.5g} and {b.d:.5g} was lost")
    return (
        f"dU jumps from {a.dU:.2g} to {b.dU:.2g} between d = {a.d:.5g} and {b.d:.5g}, where the mesh changes: "
        "its sign is within the error of the mesh there; a larger mesh.Np tells"
    )


def equilibria(zeros: list[Zero], points: list[Point]) -> list[Equilibrium]:
    """What is told of the zeros of a curve.

    Args:
        zeros: In ascending d.
        points: Those of the curve, in ascending d.
    """
    if not zeros:
        return []
    curve = interpolant(points)
    largest = max(abs(p.dU) for p in points)
    ends = [points[0].d, *(z.point.d for z in zeros), points[-1].d]
    result = []
    for before, zero, end in zip(ends, (z.point for z in zeros), ends[2:], strict=False):
        left, right = ([p for p in points if a <= p.d <= b] for a, b in ((before, zero.d), (zero.d, end)))
        between = np.abs(curve(np.linspace(np.log(zero.d), np.log(end), 50)))
        peak = max([*(abs(p.dU) for p in right), float(between.max())]) / largest
        slope, error, certain = float(zero.slopes[0]), None, None
        if zero.mesh_errors is not None:
            error = float(zero.mesh_errors[0]) / abs(slope)
            certain = all(
                any(p.mesh_errors is not None and abs(p.dU) > p.mesh_errors[0] for p in side) for side in (left, right)
            )
        result.append(Equilibrium(zero.d, slope, peak, error, certain))
    return result
