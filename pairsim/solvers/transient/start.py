"""States from which a run starts: at rest, or the quasi-steady state of its first distances."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pairsim.fem.algebra.constraints import Constraints
from pairsim.fem.meshes.geometry import Geometry, Reference
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Array
from pairsim.runtime.clock import Clock
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.runtime.message import Message
from pairsim.solvers.errors.adjoints import Adjoints
from pairsim.solvers.errors.estimate import ErrorEstimator
from pairsim.solvers.goals import D_OF_EACH, IN_TIME
from pairsim.solvers.mesh_transfer import free_unknowns
from pairsim.solvers.meshed_scene import cut_particles
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import Problem, SteadyProblem
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.steady.first_solution import first_scene
from pairsim.solvers.steady.linearisation import Linearisation

SCALARS = ("p_s", "m", "dp")  # fields in the same numbering in scenes in time and quasi-steady scenes


@dataclass(frozen=True)
class Flow:
    """A quasi-steady flow, in numberings that it shares with a scene in time on the same meshes.

    Attributes:
        liquid: Values of its fields at the nodes that carry them by name, (nodes, components).
        velocity: Velocity of the particles' material [U_av], shape (n_h,).
        scalars: Free unknowns of the fields in SCALARS.
        U: Velocities of the particles [U_av], shape (N,).
        errors: Errors of the discrete values of goals, by their names; none of a particle on its own.
    """

    liquid: dict[str, Array]
    velocity: Array
    scalars: dict[str, Array]
    U: Array
    errors: dict[str, Array]

    @staticmethod
    def of(at: Linearisation, x: Array) -> Flow:
        """The flow of a quasi-steady solution.

        Args:
            at: The solution.
            x: Its full vector, shape (n,).
        """
        steady, y = at.steady, at.y
        liquid, constraints = steady.scene.liquid, steady.constraints
        nodal = {f.name: liquid.nodal(f.name, x) for f in liquid.fields}
        scalars = {name: y[constraints.fields[name]] for name in SCALARS if name in constraints.fields}
        return Flow(nodal, constraints.V @ y, scalars, y[constraints.fields["U_p"]], _errors(at))

    def unknowns(self, scene: Scene, constraints: Constraints) -> Array:
        """The free unknowns of a scene in time on the same meshes, shape (n_y,)."""
        liquid, x = scene.liquid, np.zeros(scene.size)
        for field in liquid.fields:
            if field.name in self.liquid:
                liquid.nodal(field.name, x)[:] = self.liquid[field.name]
        y, entry = free_unknowns(scene, constraints, x), constraints.M.tocoo()
        y[entry.col] = self.velocity[entry.row]
        for name, values in self.scalars.items():
            y[constraints.fields[name]] = values
        return y


def _errors(at: Linearisation) -> dict[str, Array]:
    """epsilon_0 of the goals of a run: errors of discrete values in a quasi-steady solution with gaps, by name."""
    steady = at.steady
    if len(steady.bodies) < 2:
        return {}
    estimator, discrete = ErrorEstimator(), steady.observe()
    estimates = {goal.name: each for goal, each in estimator.estimate(at, Adjoints.of(at), discrete).items()}
    if any(body.phase is not None for body in steady.bodies):
        shapes = estimator.estimate(at, Adjoints.of_goals(at, [D_OF_EACH]), discrete)
        estimates |= {goal.name: each for goal, each in shapes.items()}
    found = dict[str, Array]()
    for goal in IN_TIME:
        each = estimates[goal.name]
        if each.change.size:  # where estimates are never added, half-widths contain them
            found[goal.name] = each.half_width + (np.abs(each.correction) if each.goal.added else 0.0)
    return found


@dataclass(frozen=True)
class Start:
    """A state from which a run starts.

    Attributes:
        reference: Reference domain of the liquid.
        mesh: Its mesh; None: to be made.
        insides: Meshes of the particles, None for a rigid one.
        h: Positions of the material, shape (n_h,).
        flow: The flow; None: everything is at rest.
        newton: Newton iterations that it took.
        factorisations: Factorisations that it took.
    """

    reference: Reference
    mesh: SixNodeMesh | None
    insides: tuple[SixNodeMesh | None, ...]
    h: Array
    flow: Flow | None = None
    newton: int = 0
    factorisations: int = 0


def at_rest(problem: Problem, clock: Clock) -> Start:
    """Unstressed particles in an unstressed liquid.

    Raises:
        MeshFailure: A mesh could not be generated.
    """
    geometry = Geometry(problem.betas, problem.gaps, problem.length, problem.closed)
    with clock("mesh"):
        outlines, insides = cut_particles(problem.mesh, geometry, geometry.gaps, problem.solids)
    h = [np.empty(0)]
    for inside, centre in zip(insides, geometry.centres, strict=True):
        if inside is None:
            h.append(np.array([centre]))
        else:
            moved = inside.points if problem.start is None else problem.start(inside.points)
            h.append((moved - inside.points + [centre, 0.0]).ravel())
    return Start(Reference.spheres(geometry, outlines), None, tuple(insides), np.concatenate(h))


def quasi_steady(problem: Problem, clock: Clock) -> Start:
    """The quasi-steady state of the first distances, with developed flow at the ends of the tube.

    That of a yielding polymer is taken without its yield stress.

    Raises:
        NoSteadyState: There is none, or it was not found.
        MeshFailure: A mesh could not be generated.
    """
    try:
        steady = arrived(first_scene(*steady_scene(problem, problem.gaps)))
    except NoSteadyState as failure:
        message = Message("the run has no quasi-steady state to start from: {}", failure.message)
        raise NoSteadyState(message, advice="start: rest") from failure
    try:
        at = steady.linearise()
        h, x = steady.state()
        scene = steady.scene
        insides = tuple(None if body.phase is None else body.phase.six_node_mesh for body in steady.bodies)
        flow = Flow.of(at, x)
        work = steady.iterations, steady.factorisations
        for name, seconds in steady.clock.seconds.items():
            clock.seconds[name] += seconds
        return Start(scene.reference, scene.liquid.six_node_mesh, insides, h, flow, *work)
    finally:
        steady.close()


def settles(problem: Problem) -> bool:
    """Whether half-widths contain epsilon_0, the error of the quasi-steady state that a run approaches after its start.

    It does from rest, or where the flow is not the largest one at the start.
    """
    liquid, of_largest = problem.liquid, problem.drive.varies and problem.from_steady
    wanted = problem.dU_error and bool(problem.gaps) and liquid.yielding is None
    return wanted and (of_largest or (liquid.has_memory and not problem.from_steady))


def settled_errors(problem: Problem, clock: Clock) -> dict[str, Array]:
    """Errors of goals in the quasi-steady state of the first distances, by their names; none if it was not found.

    Where the flow varies it is that in the largest one.
    """
    drive = problem.drive
    at_most = replace(problem, drive=drive.constant(drive.largest)) if drive.varies else problem
    try:
        flow = quasi_steady(at_most, clock).flow
    except (NoSteadyState, MeshFailure):
        return {}
    return flow.errors if flow is not None else {}


def steady_scene(problem: Problem, gaps: tuple[float, ...]) -> tuple[SteadyProblem, Parameters]:
    """The quasi-steady problem of a run on its cells, and its parameters at given distances [D_c], N-1 values."""
    drive = problem.drive.constant(problem.drive.flow)
    steady = problem.of_kind(SteadyProblem, drive=drive, narrowest=min(problem.gaps, default=np.inf))
    return steady, Parameters(gaps, problem.solids, replace(problem.liquid, yielding=None))
