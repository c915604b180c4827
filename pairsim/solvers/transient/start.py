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

SCALARS = ("p_s", "m", "dp")  # fields numbered alike in time-dependent and quasi-steady scenes


@dataclass(frozen=True)
class Flow:
    """A quasi-steady flow, in numberings that a time-dependent scene on the same meshes has, too.

    Attributes:
        liquid: Values of the liquid's fields by name, at the nodes that carry them, (nodes, components).
        velocity: Velocity of the particles' material [U_av], shape (n_h,).
        scalars: Free unknowns of the fields in SCALARS.
        U: Velocities of the particles [U_av], shape (N,).
        errors: epsilon_0, errors of the discrete values of goals, by their names, (k,) each; empty for fewer than two
            particles.
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
        """The free unknowns of a time-dependent scene on the same meshes, shape (n_y,)."""
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
    """epsilon_0 of the goals of a run: errors of their discrete values in a quasi-steady solution, by name, (k,) each.

    It is empty for fewer than two particles.
    """
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
        if each.change.size:  # half-widths of goals to which estimates are never added contain the estimate already
            found[goal.name] = each.half_width + (np.abs(each.correction) if each.goal.added else 0.0)
    return found


@dataclass(frozen=True)
class Start:
    """A state from which a run starts.

    Attributes:
        reference: Reference domain of the liquid.
        mesh: Mesh of this domain; None if it is still to be generated.
        insides: Meshes of the particles, None for rigid ones.
        h: Positions of the material, shape (n_h,).
        flow: The flow; None if everything is at rest.
        newton: Newton iterations that were needed to find this state.
        factorisations: Factorisations that were needed.
    """

    reference: Reference
    mesh: SixNodeMesh | None
    insides: tuple[SixNodeMesh | None, ...]
    h: Array
    flow: Flow | None = None
    newton: int = 0
    factorisations: int = 0


def at_rest(problem: Problem, clock: Clock) -> Start:
    """The state at rest: unstressed particles (unless `Problem.start` deforms them) in an unstressed liquid.

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
    """The quasi-steady state at the first distances, with developed flow at the ends of the tube.

    The yield stress of a polymer is left out of this state.

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
    """Whether epsilon_0 has to be found from a quasi-steady state other than the one from which the run starts.

    That is so if errors are estimated, in a run from rest in a liquid with a memory, which approaches this state, and
    in a run from a quasi-steady state whose flow varies, where the largest flow counts. There is no epsilon_0 of a
    polymer with a yield stress.
    """
    liquid, of_largest = problem.liquid, problem.drive.varies and problem.from_steady
    wanted = problem.dU_error and bool(problem.gaps) and liquid.yielding is None
    return wanted and (of_largest or (liquid.has_memory and not problem.from_steady))


def settled_errors(problem: Problem, clock: Clock) -> dict[str, Array]:
    """Errors of goals in the quasi-steady state at the first distances, by their names; empty if it was not found.

    Where the flow varies, it is the state in the largest flow.
    """
    drive = problem.drive
    at_most = replace(problem, drive=drive.constant(drive.largest)) if drive.varies else problem
    try:
        flow = quasi_steady(at_most, clock).flow
    except (NoSteadyState, MeshFailure):
        return {}
    return flow.errors if flow is not None else {}


def steady_scene(problem: Problem, gaps: tuple[float, ...]) -> tuple[SteadyProblem, Parameters]:
    """The quasi-steady problem of a run with its cell sizes, and parameters at distances `gaps` [D_c], N-1 values."""
    drive = problem.drive.constant(problem.drive.flow)
    steady = problem.of_kind(SteadyProblem, drive=drive, narrowest=min(problem.gaps, default=np.inf))
    return steady, Parameters(gaps, problem.solids, replace(problem.liquid, yielding=None))
