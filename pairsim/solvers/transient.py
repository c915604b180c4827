"""Time-dependent runs: variable-step BDF3 on the particles' material, error-controlled, with remeshing of the liquid.

A remeshing keeps every particle's mesh and history, which is all that a Newtonian scene remembers, and puts a new
reference mesh of the liquid around undeformed spheres at the current spacing, or around the shapes where that one would
be too distorted; a viscoelastic liquid's stress and its past are carried over.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pairsim.fem import diagnostics
from pairsim.fem.constraints import extension_constraints, transient_constraints
from pairsim.fem.diagnostics import Observation
from pairsim.fem.geometry import Geometry, MeshSettings, Outline, Reference
from pairsim.fem.meshing import liquid_mesh, make_outlines, particle_meshes
from pairsim.fem.remeshing import FRESH_DISTORTION, needs_mesh, on_root
from pairsim.fem.scene import BoundaryVelocity, Scene, make_bodies, poiseuille
from pairsim.fem.six_node_mesh import SixNodeMesh
from pairsim.physics.materials.polymer import Polymer
from pairsim.physics.pipe import Pipe
from pairsim.runtime.arrays import Array
from pairsim.runtime.clock import Clock
from pairsim.runtime.errors import InvertedCell, MeshFailure, NewtonFailure, StepTooSmall
from pairsim.runtime.fenicsx import MPI
from pairsim.solvers import mesh_transfer
from pairsim.solvers.history import Counts, History, State
from pairsim.solvers.newton import Newton, Report
from pairsim.solvers.step_size import Scheme, StepControl, extrapolation_weights, land, reached, velocity_error
from pairsim.solvers.stress_balance import balanced

RELATIVE_WEIGHT = 20.0
CONFORMATION_WEIGHT = 0.4
# A matrix and its factors cost some 13 iterations with those in hand, which serve while they contract by SLOW: more of
# those are allowed than of iterations with a matrix each.
MOST_ITERATIONS, SLOW = 25, 0.3
SURE_STEP = 1e-3  # a first step that Newton's method finds from a liquid at rest
NO_ERROR = 1e-12  # in units of the tolerance: of scenes that do not change at all; 0 is an error that is not known


@dataclass(frozen=True)
class Step:
    """An accepted step.

    Attributes:
        t, dt: Its end and its size.
        error: Local error in units of the tolerance (0 where it cannot be known).
        report: How Newton went.
        observation: What is read off the solution.
        distortion: Smallest ratio of a liquid cell's current to its reference Jacobian.
        scene: The scene it was computed on.
        mesh_id: Number of remeshings before it.
        x, h: Full vector and material positions.
        velocity: Velocity of the material, as h.
    """

    t: float
    dt: float
    error: float
    report: Report
    observation: Observation
    distortion: float
    scene: Scene
    mesh_id: int
    x: Array
    h: Array
    velocity: Array


@dataclass(frozen=True)
class Problem:
    """What a transient needs to know of a case.

    Attributes:
        betas, Ca_es, gaps, length: The scene.
        periodic: Kind of the ends.
        mesh: Cell sizes.
        control: Step control.
        first_step: Size of the first step.
        boundary_velocity: Velocity on wall and ends when they are not periodic.
        U_m: First guess of the particles' velocity.
        start: Starting positions of the material, from the undeformed ones (None: undeformed).
        newton_tolerance: Tolerance of every Newton solve.
        polymer: Viscoelastic part of the liquid.
        t_end: Time up to which the flow without particles is needed.
    """

    betas: tuple[float, ...]
    Ca_es: tuple[float, ...]
    gaps: tuple[float, ...]
    length: float
    periodic: bool
    mesh: MeshSettings
    control: StepControl
    first_step: float
    boundary_velocity: BoundaryVelocity = poiseuille
    U_m: float = 2.0
    start: Callable[[Array], Array] | None = None
    newton_tolerance: float = 1e-9
    polymer: Polymer | None = None
    t_end: float = 1000.0


class Transient:
    """Marches one case in time.

    Args:
        comm: Communicator of the case.
        problem: The case.
        state: What to go on from, the same on every process; None: from rest.

    Raises:
        MeshFailure: The first mesh could not be made.
    """

    def __init__(self, comm: MPI.Comm, problem: Problem, state: State | None = None) -> None:
        self.comm, self.problem = comm, problem
        self.clock, self.counts = Clock(), Counts()
        # The flow without particles: what the ends carry, and the pressure drop that particles add to.
        self.pipe = Pipe(problem.polymer).until(problem.t_end)
        self._U_m, self._dt, self._due = problem.U_m, problem.control.fixed or problem.first_step, False
        self.history = History()
        self.newton: Newton | None = None
        self._extension: Newton | None = None
        self._deformed, self._carried = False, None
        if state is None:
            self._begin()
        else:
            self._restore(state)

    def _begin(self) -> None:
        """Particles at rest at their places, without stress."""
        problem = self.problem
        geometry = Geometry(problem.betas, problem.gaps, problem.length)
        with self.clock("mesh"):
            self.outlines, meshes = on_root(self.comm, lambda: self._particles(geometry))
        self._embody(meshes)
        h = np.zeros(sum(body.size for body in self.bodies))
        for body, centre in zip(self.bodies, geometry.centres, strict=True):
            if body.phase is None:
                h[body.start] = centre
            else:
                points = body.phase.six_node_mesh.points
                moved = points if problem.start is None else problem.start(points)
                h[body.start : body.start + body.size] = (moved - points + [centre, 0.0]).ravel()
        self.history = History([0.0], [h])
        self._mesh(Reference.spheres(geometry, self.outlines))
        self.history.x = [np.zeros(self.scene.size)]

    def _restore(self, state: State) -> None:
        """Where an earlier march was."""
        self.outlines = list(state.reference.outlines)
        self._embody(state.inside)
        self._mesh(state.reference, state.mesh)
        self.history, self.counts = replace(state.history), replace(state.counts)
        self._U_m, self._dt, self._due, self._deformed = state.U_m, state.dt, state.due, state.reference.deformed
        if state.matrix_state is not None and self.newton is not None:
            self.newton.recall(state.matrix_state)
        for name, seconds in state.seconds.items():
            self.clock.seconds[name] += seconds

    @property
    def state(self) -> State:
        """What the next step depends on; it stays as it is when the march goes on."""
        return State(
            history=replace(self.history),
            reference=self.scene.reference,
            mesh=self.scene.liquid.six_node_mesh,
            inside=tuple(body.phase.six_node_mesh if body.phase is not None else None for body in self.bodies),
            dt=self._dt,
            U_m=self._U_m,
            matrix_state=self.newton.matrix_state if self.newton is not None else None,
            due=self._due,
            counts=replace(self.counts),
            seconds=dict(self.clock.seconds),
        )

    def _embody(self, meshes: Sequence[SixNodeMesh | None]) -> None:
        with self.clock("jit"):
            self.bodies = make_bodies(self.comm, self.problem.betas, self.problem.Ca_es, self.outlines, meshes)

    def _particles(self, geometry: Geometry) -> tuple[list[Outline], list[SixNodeMesh | None]]:
        settings = self.problem.mesh
        outlines = make_outlines(geometry, settings)
        return outlines, particle_meshes(geometry, settings, outlines, self.problem.Ca_es)

    def _mesh(self, reference: Reference, mesh: SixNodeMesh | None = None) -> None:
        """Put a mesh of the reference domain around the particles, a new one unless it is given."""
        if mesh is None:
            with self.clock("mesh"):
                mesh = on_root(self.comm, lambda: liquid_mesh(reference, self.problem.mesh))
        self.close()
        with self.clock("jit"):
            self.scene = Scene(
                self.comm,
                reference,
                mesh,
                self.bodies,
                periodic=self.problem.periodic,
                boundary_velocity=self.problem.boundary_velocity,
                polymer=self.problem.polymer,
            )
        self.constraints = transient_constraints(self.scene)
        tolerance, most = self.problem.newton_tolerance, MOST_ITERATIONS
        self.newton = Newton(
            self.scene, self.constraints, tolerance=tolerance, max_iterations=most, slow=SLOW, clock=self.clock
        )
        self.history.y, self.history.t_y = [], []
        self._material = np.concatenate(
            [self.constraints.fields.get(name, np.empty(0, int)) for name in ("v", "U_p", "p_s")]
        )

    def _prescribe_ends(self, x: Array, t: float) -> None:
        """Give the ends in a full vector the developed flow of this time."""
        self.scene.prescribe_ends(x, self.comm.bcast(self.pipe(t)))

    def _extend(self, h: Array) -> tuple[Array, Array]:
        """Displacement of the liquid's mesh for given material positions: its free part, and the full vector."""
        if self._extension is None:
            self._extension = Newton(self.scene, extension_constraints(self.scene), clock=self.clock)
        eta, _ = self._extension.solve(np.zeros(self._extension.constraints.size), h, 1.0, 0.0)
        return eta, self._extension.state(eta)[1]

    def _first_guess(self, U_m: float) -> Array:
        """A guess on a new mesh: what was carried over; a liquid that remembers nothing is at rest."""
        y = mesh_transfer.free_unknowns(self.constraints, self.history.x[0])
        if self._carried is not None:
            y[self._material] = self._carried
        else:
            y[self.constraints.M.T @ self.constraints.a > 0] = U_m
        return y

    def _solved(self, guess: Array, dt: float, U_m: float) -> tuple[Array, Report]:
        """Newton's method for a step of size dt from the history."""
        assert self.newton is not None
        past, t = self.history, self.history.t[0] + dt
        scheme = Scheme.bdf(past.t, t)
        h_star = np.asarray(sum(w * h for w, h in zip(scheme.weights, past.h, strict=True)))
        star = None
        if self.problem.polymer is not None:
            if not self.problem.periodic:
                self._prescribe_ends(self.constraints.base, t)
            star = np.asarray(sum(w * x for w, x in zip(scheme.weights, past.x, strict=True)))
        if len(past.y) < 3 and self.scene.moving:
            # Too little is known to extrapolate the liquid's mesh: put it where the material's guess wants it.
            guess[self.constraints.fields["eta"]], _ = self._extend(
                self.constraints.positions(guess, h_star, scheme.g, U_m)
            )
        return self.newton.solve(guess, h_star, scheme.g, U_m, star)

    def _approached(self, guess: Array, dt: float, U_m: float) -> tuple[Array, Report]:
        """A step without an earlier solution on this mesh: its guess is the solution of a smaller one, and so on.

        From a liquid at rest Newton's method finds no step that deforms the particles much.
        """
        sizes = [dt]
        while sizes[0] > SURE_STEP:
            sizes.insert(0, sizes[0] / 10)
        iterations = factorisations = 0
        for size in sizes:
            guess, report = self._solved(guess, size, U_m)
            iterations, factorisations = iterations + report.iterations, factorisations + report.factorisations
            if not report.converged:
                break
        return guess, replace(report, iterations=iterations, factorisations=factorisations)

    def _attempt(self, dt: float, gradually: bool = False) -> tuple[Array, Array, Array, Report, float]:
        """One step of size dt from the history: y, h, x, report, error in units of the tolerance."""
        assert self.newton is not None
        past = self.history
        # Every process must march the very same state: a difference in the last digit between two of them, as norms
        # and integrators leave it, is no solution of anything and grows a hundredfold a step.
        dt, U_m = self.comm.bcast((dt, self._U_m))
        t = past.t[0] + dt
        if past.y:
            weights = extrapolation_weights(past.t_y, t)
            guess = np.asarray(sum(w * y for w, y in zip(weights, past.y, strict=True)))
        else:
            guess = self._first_guess(U_m)
        y, report = self._approached(guess, dt, U_m) if gradually else self._solved(guess, dt, U_m)
        h, x = self.newton.state(y)
        error = 0.0
        if len(past.t) > 2 and report.converged:
            weights = extrapolation_weights(past.t, t)
            predicted = sum(w * old for w, old in zip(weights, past.h, strict=True))
            size = self._size_of(h - predicted)
            if self.problem.polymer is not None:
                predicted = sum(w * old for w, old in zip(weights, past.x, strict=True))
                change = self.scene.liquid.nodal("s", x - predicted)
                size = max(size, CONFORMATION_WEIGHT * float(np.sqrt(np.mean(change**2))))
            error = size * velocity_error(past.t, t) / self.problem.control.tolerance
            error = max(error, NO_ERROR)
        h, x, error = self.comm.bcast((h, x, error))
        return y, h, x, report, error

    def _size_of(self, difference: Array) -> float:
        """Norm of a difference of material positions, in which the particles' relative motion counts most.

        dU is a small difference of velocities of order one: an error in the distances weighs RELATIVE_WEIGHT times one
        in the shapes. The frame's own motion is no error: the common translation is taken out.
        """
        if difference.size == 0:
            return 0.0
        on_axis = self.constraints.a > 0
        difference = difference.copy()
        difference[on_axis] -= difference[on_axis].mean()
        shape = float(np.sqrt(2 * np.mean(difference**2)))
        centres = [difference[body.start : body.start + body.size : 2].mean() for body in self.bodies]
        return max(shape, RELATIVE_WEIGHT * float(np.ptp(centres)))

    def _remesh(self) -> None:
        """A new reference mesh at the current spacing; the solids' histories stay.

        The reference domain is that around undeformed spheres (mirrored where the scene is) while the particles'
        shapes allow it, and from then on that around the shapes as they are.
        """
        h = self.history.h[0]
        distances = self.comm.bcast(diagnostics.gaps(self.bodies, h))
        if distances.size and distances.min() <= 0:
            raise MeshFailure("the particles touch")
        geometry = Geometry(self.problem.betas, tuple(map(float, distances)), self.problem.length)
        # Bring the particles back to the middle of the tube: the ends are far away and nothing else has a place.
        centres = [h[body.start : body.start + body.size : 2].mean() for body in self.bodies]
        shift = self.comm.bcast(float(np.mean(geometry.centres) - np.mean(centres)))
        self.history.h = [positions + shift * (self.constraints.a > 0) for positions in self.history.h]
        h = self.history.h[0]
        if self.history.y:
            self._carried = self.history.y[0][self._material]
        self.counts.remeshings += 1
        old = self.scene
        if not self._deformed:
            self._mesh(Reference.spheres(geometry, self.outlines))
            distortion = diagnostics.liquid_distortion(self.scene, self._extend(h)[1])
            self._deformed = self.comm.bcast(distortion < FRESH_DISTORTION)
        if self._deformed:
            outlines = tuple(body.outline_points(h) for body in self.bodies)
            self._mesh(Reference(geometry, tuple(self.outlines), outlines, True))
        past = zip(self.history.t, self.history.x, self.history.h, strict=True)
        self.history.x = self.comm.bcast([self._carried_over(old, t, x, h, shift) for t, x, h in past])
        if self.problem.polymer is not None and self._carried is not None:
            self._balance()

    def _carried_over(self, old: Scene, t: float, x: Array, h: Array, shift: float) -> Array:
        """The liquid at one old time on the new mesh, of which s and the mesh's displacement are remembered."""
        if self.problem.polymer is None:
            return np.zeros(self.scene.size)
        new = mesh_transfer.carry_liquid(old, x, self.scene, self._extend(h)[1], shift)
        if not self.problem.periodic:
            self._prescribe_ends(new, t)
        return new

    def _balance(self) -> None:
        """Give s on the new mesh the balance of momentum that it had on the old one, at all three old times alike."""
        liquid, h = self.scene.liquid, self.history.h[0]
        if not self.problem.periodic:
            self._prescribe_ends(self.constraints.base, self.history.t[0])
        y = self._first_guess(self._U_m)
        y[self.constraints.fields.get("eta", [])] = self._extend(h)[0] if self.scene.moving else []
        x = self.constraints.expand(y, h)
        change = balanced(self.scene, x, h, self.constraints.M @ y, self._U_m, self.clock) - x
        begin, end = liquid.offsets["s"], liquid.offsets["s"] + 4 * len(liquid.six_node_mesh.points)
        self.history.x = [x + change, *map(np.copy, self.history.x[1:])]
        for past in self.history.x[1:]:
            past[begin:end] += change[begin:end]

    def _remesh_or_say_when(self) -> None:
        try:
            self._remesh()
        except MeshFailure as failure:
            t, step = self.history.t[0], self.counts.steps
            advice = "a larger mesh.Np; very soft particles may have no steady shape"
            raise MeshFailure(failure.message, t=t, step=step, advice=advice) from failure

    def steps(self, milestones: Iterator[float]) -> Iterator[Step]:
        """March through the milestones, yielding every accepted step.

        Args:
            milestones: Times to land on, ascending; the run ends after the last.

        Raises:
            RunFailure: A typed reason why the run could not go on.
        """
        control = self.problem.control
        remeshed = False
        for milestone in milestones:
            while not reached(self.history.t[0], milestone):
                t = self.history.t[0]
                if self._due:
                    self._remesh_or_say_when()
                    self._due, remeshed = False, True
                size = land(t, self._dt, milestone)
                unknown = not self.counts.steps or (control.fixed is not None and remeshed)
                y, h, x, report, error = self._attempt(size, gradually=unknown and not self.history.y)
                self.counts.newton += report.iterations
                self.counts.factorisations += report.factorisations
                valid = report.converged and diagnostics.solid_distortion(self.bodies, h) > 0
                distortion = diagnostics.liquid_distortion(self.scene, x) if valid else 0.0
                valid, distortion = self.comm.bcast((valid, distortion))
                if valid and distortion > 0 and control.accepts(error):
                    self.counts.steps += 1
                    self.history.push(t + size, h, x, y)
                    without_particles = self.pipe(t + size).gradient * self.problem.length
                    observation = diagnostics.observe(self.scene, self.constraints, y, h, x, without_particles)
                    self._U_m = float(observation.U.mean()) if observation.U.size else 0.0
                    self._dt = control.next(self._dt, size, error)
                    self._due = needs_mesh(distortion, observation.d, self.scene.reference.geometry.gaps)
                    remeshed = False
                    yield Step(
                        t=t + size,
                        dt=size,
                        error=error,
                        report=report,
                        observation=observation,
                        distortion=distortion,
                        scene=self.scene,
                        mesh_id=self.counts.remeshings,
                        x=x,
                        h=h,
                        velocity=self.constraints.M @ y,
                    )
                    continue
                self.counts.rejected += 1
                if valid and distortion > 0:
                    self._dt = min(control.next(size, size, error), 0.7 * size)
                elif not remeshed and self.history.y:
                    self._remesh_or_say_when()
                    remeshed = True
                elif control.fixed is not None:
                    self._give_up(t, report, False, error)
                else:
                    self._dt = size / 3
                if self._dt < control.smallest:
                    self._give_up(t, report, valid and distortion > 0, error)

    def _give_up(self, t: float, report: Report, valid: bool, error: float) -> None:
        step, fixed = self.counts.steps, self.problem.control.fixed
        kept = f"time.fixed_step = {fixed:g} could not be kept at t = {t:g}: " if fixed is not None else ""
        advice = "a smaller time.fixed_step, or leave it out" if kept else "a finer mesh (mesh.Np)"
        if not report.converged:
            advice += "" if kept else " or a smaller time.first_step"
            raise NewtonFailure(kept + report.reason, t=t, step=step, advice=advice)
        if not valid:
            raise InvertedCell(f"{kept}a cell turned over", t=t, step=step, advice=advice)
        message = f"the local error is {error:.2g} times the tolerance at the smallest step"
        raise StepTooSmall(message, t=t, step=step, advice="a larger time.tol")

    def close(self) -> None:
        """Give the solver's memory back."""
        for solver in (self.newton, self._extension):
            if solver is not None:
                solver.destroy()
        self.newton = self._extension = None
