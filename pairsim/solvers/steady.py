"""Quasi-steady scenes: distances prescribed, d/dt at fixed X dropped, shapes, stresses and all velocities at once.

One object holds a scene at given parameters, solves it from a neighbouring solution, and gives what continuation
needs: tangents, a new mesh where the old one is too distorted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pairsim.fem import diagnostics
from pairsim.fem.constraints import extension_constraints, steady_constraints
from pairsim.fem.diagnostics import Observation
from pairsim.fem.geometry import Geometry, Outline, Reference
from pairsim.fem.meshing import liquid_mesh, make_outlines, particle_meshes
from pairsim.fem.remeshing import needs_mesh, on_root
from pairsim.fem.scene import Scene, make_bodies
from pairsim.fem.six_node_mesh import SixNodeMesh
from pairsim.physics.pipe import Pipe, PipeState
from pairsim.runtime.arrays import Array
from pairsim.runtime.clock import Clock
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.runtime.fenicsx import MPI
from pairsim.runtime.signals import heed
from pairsim.solvers.mesh_transfer import carry_liquid, carry_particle, free_unknowns
from pairsim.solvers.newton import Newton, Report
from pairsim.solvers.parameters import Parameters, SteadyProblem

# Relative step of the differences that give derivatives with respect to parameters: the residual is smooth.
DIFFERENCE = 1e-5
# Relative change of De over which the developed flow is taken from the one known.
ALL_BUT_THE_SAME = 0.01
# A steady branch is followed to where shapes barely exist, and there distorted cells make rims buckle too early
# (beta .4, d .1: at Ca_e .14 around spheres, at .16 around the shapes): a new mesh comes sooner than in time.
LEAST_STEADY, FRESH_STEADY = 0.6, 0.75


@dataclass(frozen=True)
class Snapshot:
    """A solution and its mesh, to come back to.

    Attributes:
        parameters, y: The solution.
        reference, mesh: Reference domain of the liquid and its mesh.
    """

    parameters: Parameters
    y: Array
    reference: Reference
    mesh: SixNodeMesh


class Steady:
    """A quasi-steady scene at one set of parameters.

    Args:
        comm: Communicator of the case.
        problem: What stays.
        parameters: Where to begin; which particles are rigid is fixed here.

    Attributes:
        y: Free unknowns of the last solution (a guess before the first one).

    Raises:
        MeshFailure: The first mesh could not be made.
    """

    def __init__(self, comm: MPI.Comm, problem: SteadyProblem, parameters: Parameters) -> None:
        self.comm, self.problem, self.parameters = comm, problem, parameters
        self.clock = Clock()
        self.newton: Newton | None = None
        self._extension: Newton | None = None
        self._flows: dict[float, PipeState] = {}
        self.meshes = self.iterations = self.factorisations = 0
        geometry = Geometry(problem.betas, parameters.gaps, problem.length)
        with self.clock("mesh"):
            narrowest = tuple(min(d, problem.narrowest) for d in parameters.gaps)
            self.outlines = make_outlines(Geometry(problem.betas, narrowest, problem.length), problem.mesh)
            meshes = on_root(comm, lambda: particle_meshes(geometry, problem.mesh, self.outlines, parameters.Ca_es))
        with self.clock("jit"):
            self.bodies = make_bodies(comm, problem.betas, parameters.Ca_es, self.outlines, meshes)
        self._sphere_points: list[Array | None] = [
            None if b.phase is None else b.phase.mesh.geometry.x.copy() for b in self.bodies
        ]
        # Where a mesh around spheres did not do for the shapes, last.
        self._refused: Parameters | None = None
        # Where the factors in hand were made: its y and parameters.
        self._factored: tuple[Array, Parameters] | None = None
        self._mesh(Reference.spheres(replace(geometry, gaps=problem.nominal(parameters.gaps)), self.outlines))
        self.y = self._cold_guess()

    # Meshes

    def _mesh(self, reference: Reference, mesh: SixNodeMesh | None = None) -> None:
        """Everything that belongs to one reference mesh, made for the reference domain where none is given."""
        if mesh is None:
            with self.clock("mesh"):
                mesh = on_root(self.comm, lambda: liquid_mesh(reference, self.problem.mesh))
            self.meshes += 1
        self.close()
        self._liquid_mesh, self._factored = mesh, None
        polymer = self.problem.polymer
        with self.clock("jit"):
            self.scene = Scene(
                self.comm,
                reference,
                mesh,
                self.bodies,
                periodic=self.problem.periodic,
                boundary_velocity=self.problem.boundary_velocity,
                polymer=polymer,
                steady=True,
            )
        self.constraints = steady_constraints(self.scene, self._unit_extensions())
        self._untouched = self.constraints.base.copy()
        self.newton = Newton(self.scene, self.constraints, tolerance=self.problem.newton_tolerance, clock=self.clock)
        self._material = np.concatenate(
            [self.constraints.fields.get(name, np.empty(0, int)) for name in ("h", "U_p", "p_s")]
        )

    def _extend(self, h: Array) -> Array:
        """Full vector with the liquid's mesh displacement for given material positions."""
        if self._extension is None:
            self._extension = Newton(self.scene, extension_constraints(self.scene), clock=self.clock)
        eta, _ = self._extension.solve(np.zeros(self._extension.constraints.size), h, 1.0, 0.0)
        return self._extension.state(eta)[1]

    def _unit_extensions(self) -> Array:
        """The mesh's velocity for unit velocity of each particle, at the vertices, (N, n_vertices, 2)."""
        scene, vertices = self.scene, self.scene.liquid.six_node_mesh.vertices
        if scene.polymer is None or not scene.moving:
            return np.ones((len(self.bodies), len(vertices), 2)) * [1.0, 0.0]
        h = np.concatenate([np.zeros(body.size) for body in self.bodies])
        still = scene.liquid.nodal("eta", self._extend(h))[vertices]
        fields = []
        for body in self.bodies:
            moved = h.copy()
            moved[body.start : body.start + body.size : 2] = 1.0
            fields.append(scene.liquid.nodal("eta", self._extend(moved))[vertices] - still)
        return np.array(fields)

    def remesh(self, parameters: Parameters | None = None, y: Array | None = None, *, afresh: bool = False) -> None:
        """A new reference mesh for a state, by default the solution's; `y` becomes that state on it, as a guess.

        Args:
            parameters, y: The state, whose mesh must not be folded.
            afresh: Try a mesh around spheres again, also where an earlier one did not do.

        Raises:
            MeshFailure: It could not be made.
        """
        parameters = parameters or self.parameters
        old_y = self.y if y is None else y
        old, (h, x) = self.scene, self._state_at(parameters, old_y)
        distances = self.comm.bcast(diagnostics.gaps(self.bodies, h))
        if distances.size and distances.min() <= 0:
            raise MeshFailure("the particles touch")
        material = old_y[self._material]
        geometry = Geometry(self.problem.betas, tuple(map(float, distances)), self.problem.length)
        if around_spheres := afresh or not self._as_refused(parameters):
            # Meshes around spheres exist for certain distances only.
            self._mesh(Reference.spheres(replace(geometry, gaps=self.problem.nominal(parameters.gaps)), self.outlines))
            if self.scene.moving:
                distortion = self.comm.bcast(diagnostics.liquid_distortion(self.scene, self._extend(h)))
                distortion = self.comm.bcast(self._shape_alone(distortion, parameters, FRESH_STEADY))
                around_spheres = distortion >= FRESH_STEADY
            self._refused = None if around_spheres else parameters
        if not around_spheres:
            outlines = tuple(body.outline_points(h) for body in self.bodies)
            self._mesh(Reference(geometry, tuple(self.outlines), outlines, True))
        self.parameters = parameters
        self.y = self.comm.bcast(self._carried_over(old, x, h, material))

    def _as_refused(self, there: Parameters) -> bool:
        """Whether shapes at a place are at least as soft and as close as the last that needed a mesh of their own."""
        last = self._refused
        if last is None or there.De > last.De:
            return False
        closer = all(d <= before for d, before in zip(there.gaps, last.gaps, strict=True))
        return closer and all(Ca_e >= before for Ca_e, before in zip(there.Ca_es, last.Ca_es, strict=True))

    def _shape_alone(self, distortion: float, parameters: Parameters, least: float) -> float:
        """Distortion of a mesh around spheres without what their distance, not that of the mesh, does to it.

        A squeezed mesh of undeformed spheres is as good as any, and its mirror image makes dU of equal ones exact: only
        shapes are a reason to give it up. Evaluated where the whole distortion is below `least`.
        """
        if distortion >= least or self.scene.reference.deformed:
            return distortion
        undeformed = diagnostics.liquid_distortion(self.scene, self._extend(self.h_star(parameters)))
        return distortion / min(1.0, undeformed) if undeformed > 0 else distortion

    def adopt(self, other: Steady) -> None:
        """Take the solution of the same scene on other cells as the guess here; the mesh is made for its parameters."""
        h, x = other.state()
        displaced = h - other.h_star(other.parameters)
        y, there, p_s = np.zeros(self.constraints.size), np.zeros(self.scene.h_size), []
        for body, coarse in zip(self.bodies, other.bodies, strict=True):
            displacement, p = carry_particle(coarse, other.scene, x, displaced, body)
            there[body.start : body.start + body.size] = displacement
            p_s.append(p)
        entry = self.constraints.M.tocoo()
        y[entry.col] = there[entry.row]
        y[self.constraints.fields["U_p"]] = other.y[other.constraints.fields["U_p"]]
        if "p_s" in self.constraints.fields:
            y[self.constraints.fields["p_s"]] = np.concatenate(p_s)
        h = self.h_star(other.parameters) + self.constraints.M @ y
        self.parameters = other.parameters
        self._flows |= other._flows
        self.y = self.comm.bcast(self._carried_over(other.scene, x, h, y[self._material]))

    def take_over_costs(self, other: Steady) -> None:
        """Count another scene's work as this one's."""
        self.iterations += other.iterations
        self.factorisations += other.factorisations
        self.meshes += other.meshes
        for name, seconds in other.clock.seconds.items():
            self.clock.seconds[name] += seconds

    @property
    def snapshot(self) -> Snapshot:
        """The present solution."""
        return Snapshot(self.parameters, self.y, self.scene.reference, self._liquid_mesh)

    def recall(self, snapshot: Snapshot) -> None:
        """Go back to a solution."""
        if snapshot.mesh is not self._liquid_mesh:
            self._mesh(snapshot.reference, snapshot.mesh)
        self.parameters, self.y = snapshot.parameters, snapshot.y

    def _carried_over(self, old: Scene, x: Array, h: Array, material: Array) -> Array:
        """The old solution on the new mesh."""
        new = carry_liquid(old, x, self.scene, self._extend(h) if self.scene.moving else np.zeros(self.scene.size))
        y = free_unknowns(self.constraints, new)
        y[self._material] = material
        if self.scene.dp is not None:
            assert old.dp is not None
            y[self.constraints.fields["dp"]] = x[old.dp]
        return y

    def _cold_guess(self) -> Array:
        """Undeformed spheres in the developed flow."""
        liquid, constraints = self.scene.liquid, self.constraints
        mesh = liquid.six_node_mesh
        nodes = np.arange(len(mesh.points))
        x = self._extend(self.h_star(self.parameters)) if self.scene.moving else np.zeros(self.scene.size)
        if self.scene.polymer is None:
            u = self.problem.boundary_velocity(mesh.points)
        else:
            flow = self._flow(self.parameters.De)
            axial, *s = flow.profiles(mesh.points[:, 1])
            u = np.column_stack([axial, np.zeros(len(nodes))])
            for c in range(4):
                x[liquid.index("s", nodes, c)] = s[c]
        for c in range(2):
            x[liquid.index("u", nodes, c)] = u[:, c]
        y = free_unknowns(self.constraints, x)
        largest = max(self.problem.betas, default=0.0)
        on_axis = self.problem.boundary_velocity(np.zeros((1, 2)))[0, 0]
        y[constraints.fields["U_p"]] = on_axis * (1 - 2 / 3 * largest**2)
        return y

    # Parameters

    def _flow(self, De: float) -> PipeState:
        """The developed flow at a Deborah number."""
        if De not in self._flows:
            polymer = self.problem.polymer
            known = min(self._flows, key=lambda other: abs(other - De), default=np.inf)
            near = self._flows[known] if abs(known - De) <= ALL_BUT_THE_SAME * De else None
            self._flows[De] = self.comm.bcast(Pipe(replace(polymer, De=De) if polymer else None).steady(near))
        return self._flows[De]

    def h_star(self, parameters: Parameters) -> Array:
        """Positions of undeformed spheres at the wanted distances."""
        betas = tuple(beta * parameters.size for beta in self.problem.betas)
        centres = Geometry(betas, parameters.gaps, self.problem.length).centres
        h = np.zeros(self.scene.h_size)
        for body, centre in zip(self.bodies, centres, strict=True):
            h[body.start : body.start + body.size : 2] = centre
        return h

    def apply(self, parameters: Parameters) -> Array:
        """Put the forms and the constraints at these parameters; h*."""
        assert self.newton is not None
        scene, base = self.scene, self.constraints.base
        base[:] = self._untouched if parameters.size == 1.0 else self._base_at(parameters.size)
        for body, points, Ca_e in zip(self.bodies, self._sphere_points, parameters.Ca_es, strict=True):
            if body.phase is not None and points is not None:
                body.phase.constants["Ca_e"].value = Ca_e
                body.phase.mesh.geometry.x[:] = points * parameters.size
        if scene.polymer is not None:
            liquid, flow = scene.liquid, self._flow(parameters.De)
            liquid.constants["De"].value = parameters.De
            liquid.constants["rate"].value = 0.0
            if not scene.periodic:
                scene.prescribe_ends(base, flow)
        h_star = self.h_star(parameters)
        self.newton.place(h_star)
        return h_star

    def _base_at(self, size: float) -> Array:
        """Constant part of the constraints with all diameters multiplied."""
        bodies = self.scene.bodies
        self.scene.bodies = [
            replace(body, outline=Outline(body.outline.radius * size, body.outline.angles)) for body in bodies
        ]
        try:
            count = len(self.scene.liquid.six_node_mesh.vertices)
            return steady_constraints(self.scene, np.zeros((len(bodies), count, 2))).base
        finally:
            self.scene.bodies = bodies

    def state(self) -> tuple[Array, Array]:
        """h and x of the solution; forms, and with them `Body.Ca_e` and `Scene.polymer`, are put at its parameters."""
        return self._state_at(self.parameters, self.y)

    def _state_at(self, parameters: Parameters, y: Array) -> tuple[Array, Array]:
        assert self.newton is not None
        self.apply(parameters)
        return self.newton.state(y)

    # Solving

    def solve(self, parameters: Parameters, guess: Array | None = None) -> Report:
        """Solve at these parameters; on success they and y become the scene's.

        Args:
            parameters: Where.
            guess: First guess, by default the last solution.
        """
        heed(self.comm)
        assert self.newton is not None
        h_star, self._factored = self.apply(parameters), None
        y, report = self.newton.solve(self.y if guess is None else guess, h_star, 1.0, 0.0)
        self.iterations += report.iterations
        self.factorisations += report.factorisations
        if report.converged and self.distortion_of(*self.newton.state(y)) <= 0:
            report = replace(report, converged=False, reason="a cell turned over")
            self.newton.forget()
        if report.converged:
            self.y, self.parameters = y, parameters
        return report

    def forget(self) -> None:
        """Give up the factors in hand."""
        assert self.newton is not None
        self.newton.forget()
        self._factored = None

    def distortion_of(self, h: Array, x: Array) -> float:
        """Smallest distortion of all cells; not positive where one is turned over."""
        solid = diagnostics.solid_distortion(self.bodies, h)
        return self.comm.bcast(diagnostics.liquid_distortion(self.scene, x) if solid > 0 else 0.0)

    def distorted(self, parameters: Parameters | None = None, y: Array | None = None) -> bool:
        """Whether a state, by default the solution, asks for a new mesh."""
        parameters = parameters or self.parameters
        h, x = self._state_at(parameters, self.y if y is None else y)
        reference = self.scene.reference
        if not reference.deformed and self.problem.nominal(parameters.gaps) != reference.geometry.gaps:
            return True
        gaps = self.comm.bcast(diagnostics.gaps(self.bodies, h))
        distortion = self.distortion_of(h, x)
        if self.scene.moving:
            distortion = self.comm.bcast(self._shape_alone(distortion, parameters, LEAST_STEADY))
        return needs_mesh(distortion, gaps, reference.geometry.gaps, LEAST_STEADY)

    def folded(self, parameters: Parameters, y: Array) -> bool:
        """Whether a cell of a state's mesh is turned over."""
        return self.distortion_of(*self._state_at(parameters, y)) <= 0

    def factor(self) -> None:
        """Factor the exact matrix at the solution; tangents need it, and the next solve begins with it.

        Raises:
            NoSteadyState: The matrix is singular.
        """
        assert self.newton is not None
        self.apply(self.parameters)
        if self._factored is not None and self._factored[0] is self.y and self._factored[1] == self.parameters:
            return
        self.factorisations += 1
        if not self.newton.factor_at(self.y):
            raise NoSteadyState("Newton's matrix is singular at a solution", advice="a larger mesh.Np")
        self._factored = self.y, self.parameters

    def residual_change(self, along: Callable[[float], Parameters]) -> Array:
        """dR/dtau at fixed y along a line of parameters, `along(0)` being here; tau of order one matters."""
        assert self.newton is not None
        ends = []
        for tau in (DIFFERENCE, -DIFFERENCE):
            self.apply(along(tau))
            ends.append(self.newton.residual_at(self.y))
        self.apply(self.parameters)
        return (ends[0] - ends[1]) / (2 * DIFFERENCE)

    def tangent(self, along: Callable[[float], Parameters]) -> Array:
        """dy/dtau along a line of parameters; `factor` first."""
        assert self.newton is not None
        return -self.newton.linear_solve(self.residual_change(along))

    def residual(self) -> Array:
        """The residual at the solution."""
        assert self.newton is not None
        self.apply(self.parameters)
        return self.newton.residual_at(self.y)

    def velocity_row(self) -> Array:
        """Row c with c . y = U of the leading particle minus U of the trailing one."""
        row = np.zeros(self.constraints.size)
        row[self.constraints.fields["U_p"][[0, -1]]] = -1.0, 1.0
        return row

    def observe(self) -> Observation:
        """What is read off the solution."""
        h, x = self.state()
        without_particles = self.developed_flow.gradient * self.problem.length
        return diagnostics.observe(self.scene, self.constraints, self.y, h, x, without_particles)

    @property
    def developed_flow(self) -> PipeState:
        """The flow without particles."""
        return self._flow(self.parameters.De)

    @property
    def centres(self) -> Array:
        """Axial positions of undeformed spheres at these distances, (N,)."""
        return Geometry(self.problem.betas, self.parameters.gaps, self.problem.length).centres

    def close(self) -> None:
        """Give the solver's memory back."""
        for solver in (self.newton, self._extension):
            if solver is not None:
                solver.destroy()
        self.newton = self._extension = None
