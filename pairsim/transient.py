"""Time-dependent runs: variable-step BDF2 on the particles' material, error-controlled, with remeshing of the liquid.

In a Newtonian liquid only the solids remember. A remeshing therefore keeps every particle's mesh and history and only
puts a new reference mesh of the liquid around undeformed spheres at the current spacing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from mpi4py import MPI

from pairsim import diagnostics
from pairsim.diagnostics import Observation
from pairsim.errors import InvertedCell, MeshFailure, NewtonFailure, RunFailure, StepTooSmall
from pairsim.mesh import Array, Geometry, MeshSettings, QuadraticMesh, liquid_mesh, make_outlines, particle_meshes
from pairsim.scene import BoundaryVelocity, Scene, make_bodies, poiseuille
from pairsim.solver import Newton, Phases, Report
from pairsim.stepsize import Scheme, StepControl, error_factor, extrapolation_weights, land
from pairsim.ties import extension_tie, transient_tie

# A cell squeezed below this fraction of its reference area, or a gap changed by this factor, calls for a new mesh.
LEAST_DISTORTION = 0.25
GAP_RATIO = 1.6


@dataclass
class Counts:
    """What a run took."""

    steps: int = 0
    rejected: int = 0
    newton: int = 0
    factorisations: int = 0
    remeshings: int = 0


@dataclass(frozen=True)
class Step:
    """An accepted step."""

    t: float
    dt: float
    error: float
    report: Report
    observation: Observation
    x: Array
    h: Array
    velocity: Array
    remeshed: bool


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
    newton_tolerance: float = 1e-8


@dataclass
class _History:
    """Accepted values, newest first."""

    t: list[float] = field(default_factory=list)
    h: list[Array] = field(default_factory=list)
    y: list[Array] = field(default_factory=list)
    t_y: list[float] = field(default_factory=list)

    def push(self, t: float, h: Array, y: Array) -> None:
        self.t, self.h = [t, *self.t[:2]], [h, *self.h[:2]]
        self.t_y, self.y = [t, *self.t_y[:2]], [y, *self.y[:2]]


class Transient:
    """Marches one case in time.

    Args:
        comm: Communicator of the case.
        problem: The case.

    Raises:
        MeshFailure: The first mesh could not be made.
    """

    def __init__(self, comm: MPI.Comm, problem: Problem) -> None:
        self.comm, self.problem = comm, problem
        self.clock, self.counts = Phases(), Counts()
        geometry = Geometry(problem.betas, problem.gaps, problem.length)
        with self.clock("mesh"):
            self.outlines, meshes = self._on_root(lambda: self._particles(geometry))
        with self.clock("jit"):
            self.bodies = make_bodies(comm, problem.betas, problem.Ca_es, self.outlines, meshes)
        h = np.zeros(sum(body.size for body in self.bodies))
        for body, centre in zip(self.bodies, geometry.centres, strict=True):
            if body.phase is None:
                h[body.start] = centre
            else:
                points = body.phase.quadratic.points
                moved = points if problem.start is None else problem.start(points)
                h[body.start : body.start + body.size] = (moved - points + [centre, 0.0]).ravel()
        self.history = _History([0.0], [h])
        self.newton: Newton | None = None
        self._mesh(geometry)

    def _on_root(self, make: Callable[[], object]) -> object:
        """Run gmsh on one process; every process gets the result, or raises the same error."""
        result: object = None
        if self.comm.rank == 0:
            try:
                result = make()
            except RunFailure as error:
                result = error
        result = self.comm.bcast(result)
        if isinstance(result, RunFailure):
            raise result
        return result

    def _particles(self, geometry: Geometry) -> tuple[list, list[QuadraticMesh | None]]:
        settings = self.problem.mesh
        outlines = make_outlines(geometry, settings)
        if not any(Ca_e > 0 for Ca_e in self.problem.Ca_es):
            return outlines, [None] * len(outlines)
        return outlines, list(particle_meshes(geometry, settings, outlines))

    def _mesh(self, geometry: Geometry) -> None:
        """Put a reference mesh of the liquid around the particles."""
        with self.clock("mesh"):
            mesh = self._on_root(lambda: liquid_mesh(geometry, self.problem.mesh, self.outlines))
        if self.newton is not None:
            self.newton.destroy()
        with self.clock("jit"):
            self.scene = Scene(
                self.comm,
                geometry,
                mesh,
                self.bodies,
                periodic=self.problem.periodic,
                boundary_velocity=self.problem.boundary_velocity,
            )
        self.tie = transient_tie(self.scene)
        self.newton = Newton(self.scene, self.tie, tolerance=self.problem.newton_tolerance, clock=self.clock)
        self.history.y, self.history.t_y = [], []
        self._material = np.concatenate([self.tie.fields.get(name, np.empty(0, int)) for name in ("v", "U_p", "p_s")])

    def _first_guess(self, material: Array | None, h_star: Array, g: float, U_m: float) -> Array:
        """A guess on a new mesh: material unknowns carried over, mesh displacement extended, liquid at rest."""
        y = np.zeros(self.tie.size)
        if material is not None:
            y[self._material] = material
        else:
            for name in ("U_p",):
                y[self.tie.fields.get(name, np.empty(0, int))] = U_m
            velocity = self.tie.M.T @ self.tie.a
            y += U_m * (velocity > 0)
        if self.scene.moving:
            h = self.tie.positions(y, h_star, g, U_m)
            x = self.tie.expand(y, h)
            tie = extension_tie(self.scene, x)
            extension = Newton(self.scene, tie, clock=self.clock)
            eta, _ = extension.solve(np.zeros(tie.size), h, 1.0, 0.0)
            extension.destroy()
            y[self.tie.fields["eta"]] = eta
        return y

    def _attempt(self, dt: float) -> tuple[Array, Array, Array, Report, float]:
        """One step of size dt from the history: y, h, x, report, error in units of the tolerance."""
        assert self.newton is not None
        past = self.history
        t = past.t[0] + dt
        scheme = Scheme.bdf(dt, past.t[0] - past.t[1] if len(past.t) > 1 else None)
        h_star = sum(w * h for w, h in zip(scheme.weights, past.h, strict=False))
        U_m = self._U_m
        if past.y:
            weights = extrapolation_weights(past.t_y, t)
            guess = np.asarray(sum(w * y for w, y in zip(weights, past.y, strict=True)))
        else:
            guess = self._first_guess(self._carried, h_star, scheme.g, U_m)
        y, report = self.newton.solve(guess, h_star, scheme.g, U_m)
        h, x = self.newton.state(y)
        error = 0.0
        if len(past.t) > 2 and report.converged:
            weights = extrapolation_weights(past.t, t)
            predicted = sum(w * old for w, old in zip(weights, past.h, strict=True))
            difference = h - predicted
            # The frame's own motion is no error: take the common translation out.
            on_axis = self.tie.a > 0
            difference[on_axis] -= difference[on_axis].mean()
            local = error_factor(past.t, t) * np.sqrt(np.mean(difference**2) * 2)
            error = float(local / scheme.g / self.problem.control.tolerance)
        return y, h, x, report, error

    def _remesh(self) -> None:
        """A new reference mesh at the current spacing; the solids' histories stay."""
        h = self.history.h[0]
        distances = diagnostics.gaps(self.bodies, h)
        if distances.size and distances.min() <= 0:
            raise MeshFailure("the particles touch")
        equal = len(set(np.round(distances, 9))) <= 1
        gaps = tuple(float(distances.mean()) if equal else float(d) for d in distances)
        geometry = Geometry(self.problem.betas, gaps, self.problem.length)
        # Bring the particles back to the middle of the tube: the ends are far away and nothing else has a place.
        centres = [np.mean(diagnostics.extents(body.outline_points(h))[:2]) for body in self.bodies]
        shift = np.mean(geometry.centres) - np.mean(centres)
        for old in self.history.h:
            old += shift * (self.tie.a > 0)
        carried = self.history.y[0][self._material] if self.history.y else None
        self._mesh(geometry)
        self._carried = carried
        self.counts.remeshings += 1

    def steps(self, milestones: Iterator[float]) -> Iterator[Step]:
        """March through the milestones, yielding every accepted step.

        Args:
            milestones: Times to land on, ascending; the run ends after the last.

        Raises:
            RunFailure: A typed reason why the run could not go on.
        """
        control = self.problem.control
        self._U_m, self._carried = self.problem.U_m, None
        dt = control.fixed or self.problem.first_step
        remeshed = False
        for milestone in milestones:
            while self.history.t[0] < milestone - 1e-12 * max(1.0, milestone):
                t = self.history.t[0]
                size = land(t, dt, milestone)
                y, h, x, report, error = self._attempt(size)
                self.counts.newton += report.iterations
                self.counts.factorisations += report.factorisations
                valid = report.converged and diagnostics.solid_distortion(self.bodies, h) > 0
                distortion = diagnostics.liquid_distortion(self.scene, x) if valid else 0.0
                if valid and distortion > 0 and control.accepts(error):
                    self.counts.steps += 1
                    self.history.push(t + size, h, y)
                    observation = diagnostics.observe(self.scene, self.tie, y, h, x)
                    self._U_m = float(observation.U.mean()) if observation.U.size else 0.0
                    if size >= dt * (1 - 1e-9) or error > 1:
                        dt = control.next(size, error) if error > 0 else size
                    yield Step(t + size, size, error, report, observation, x, h, self.tie.M @ y, remeshed)
                    remeshed = self._needs_mesh(distortion, observation)
                    if remeshed:
                        self._remesh()
                    continue
                self.counts.rejected += 1
                if valid and distortion > 0:
                    dt = min(control.next(size, error), 0.7 * size)
                elif not remeshed and self.history.y:
                    self._remesh()
                    remeshed = True
                else:
                    dt = size / 3
                if dt < control.smallest:
                    self._give_up(t, report, valid, error)

    def _needs_mesh(self, distortion: float, observation: Observation) -> bool:
        if distortion < LEAST_DISTORTION:
            return True
        ratio = observation.d / np.array(self.scene.geometry.gaps) if observation.d.size else np.ones(1)
        return bool(ratio.max() > GAP_RATIO or ratio.min() < 1 / GAP_RATIO)

    def _give_up(self, t: float, report: Report, valid: bool, error: float) -> None:
        where = {"t": t, "step": self.counts.steps}
        if not report.converged:
            raise NewtonFailure(report.reason, **where, advice="a finer mesh (mesh.Np) or a smaller time.first_step")
        if not valid:
            raise InvertedCell("a cell turned over", **where, advice="a finer mesh (mesh.Np)")
        raise StepTooSmall(
            f"the local error is {error:.2g} times the tolerance at the smallest step",
            **where,
            advice="a larger time.tol",
        )

    def close(self) -> None:
        """Give the solver's memory back."""
        if self.newton is not None:
            self.newton.destroy()
            self.newton = None
