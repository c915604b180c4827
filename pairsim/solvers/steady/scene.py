"""Quasi-steady solutions of a scene at given parameters, on a mesh that is replaced as they require.

Distances are prescribed, and time derivatives at fixed X are dropped. Shapes, stresses, flow and velocities are solved
for together; see "Quasi-steady solutions" in docs/explanation/numerics.md. First guesses are made by the functions of
`predictors`; linear systems with the matrix at a solution are solved by its `linearisation`.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from pairsim.fem import diagnostics
from pairsim.fem.algebra.constraints import Constraints, PositionUpdate
from pairsim.fem.algebra.scene_constraints import steady_base, steady_constraints
from pairsim.fem.diagnostics import Observation
from pairsim.fem.meshes.geometry import Geometry, Reference
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.fem.scene import Scene
from pairsim.physics.pipe import PipeState
from pairsim.runtime.arrays import Array
from pairsim.runtime.clock import Clock
from pairsim.runtime.errors import NoSteadyState
from pairsim.solvers.mesh_transfer import free_unknowns
from pairsim.solvers.meshed_scene import Cells, MeshedScene, MeshedSolver, cut_particles, needs_mesh
from pairsim.solvers.nonlinear.convergence import Report
from pairsim.solvers.nonlinear.factors import LAST
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.solution import Solution
from pairsim.solvers.steady.developed_flow import DevelopedFlows
from pairsim.solvers.steady.linearisation import Linearisation

# Stricter than in runs, since near the end of a branch rims buckle too early on distorted cells: at Ca_e 0.14 instead
# of 0.16 (beta 0.4, d 0.1).
LEAST_STEADY = 0.6  # ratio of current to reference Jacobian of a cell below which a mesh is replaced
FRESH_STEADY = 0.75  # least such ratio at which a new mesh around spheres is accepted


@dataclass(frozen=True)
class Snapshot:
    """A stored solution and its mesh.

    Attributes:
        parameters: Parameters of the solution.
        y: Free unknowns, shape (n_y,).
        reference: Reference domain of the liquid.
        mesh: Mesh of the reference domain.
    """

    parameters: Parameters
    y: Array
    reference: Reference
    mesh: SixNodeMesh


def cells_around_spheres(problem: SteadyProblem, parameters: Parameters) -> Cells:
    """Cells around undeformed spheres, without a mesh of the liquid, which is still to be generated.

    Raises:
        MeshFailure: The mesh of a particle could not be generated.
    """
    geometry = Geometry(problem.betas, parameters.gaps, problem.length, problem.closed)
    narrowest = tuple(min(d, problem.narrowest) for d in parameters.gaps)
    outlines, insides = cut_particles(problem.mesh, geometry, narrowest, parameters.solids)
    return Cells(insides, Reference.spheres(replace(geometry, gaps=problem.nominal(parameters.gaps)), outlines))


class SteadySolver(MeshedSolver):
    """Solver of a quasi-steady scene at one set of parameters after another.

    Args:
        problem: The problem.
        parameters: Initial parameters. Rigid particles remain rigid, and materials keep their laws.
        cells: The cells to begin with; by default cells around spheres.

    Attributes:
        parameters: Parameters of the last solution, or of the first guess.
        y: Free unknowns of the last solution, or the first guess, shape (n_y,); zero at first.
        linearised: What `linearise` returned last; None after a solve, a change of mesh, or `forget`.
        iterations: Number of Newton iterations so far.
        factorisations: Number of factorisations so far.
        flows: Developed flows of the liquids so far.

    Raises:
        MeshFailure: The first mesh could not be generated.
        NoSteadyState: There is no developed flow of the initial liquid.
    """

    def __init__(self, problem: SteadyProblem, parameters: Parameters, cells: Cells | None = None) -> None:
        self.problem, self.clock, self.flows = problem, Clock(), DevelopedFlows(problem.drive.flow)
        self.iterations = self.factorisations = 0
        # Parameters at which a mesh around spheres was last found to be too distorted.
        self._refused: Parameters | None = None
        self.linearised: Linearisation | None = None
        if cells is None:
            with self.clock("mesh"):
                cells = cells_around_spheres(problem, parameters)
        outlines, solids, liquid = cells.reference.outlines, parameters.solids, parameters.liquid
        self.meshed = MeshedScene(
            *(problem, outlines, cells.insides, solids),
            liquid=liquid,
            steady=True,
            constrain=self._constrain,
            clock=self.clock,
        )
        self._sphere_points: list[Array | None] = [
            None if b.phase is None else b.phase.mesh.geometry.x.copy() for b in self.bodies
        ]
        self.meshed.put(cells.reference, cells.mesh)
        self.parameters, self.y = parameters, np.zeros(self.constraints.size)

    def _constrain(self, meshed: MeshedScene) -> Constraints:
        """Constraints on a new mesh; discards the factors."""
        self.linearised = None
        constraints = self._constraints_on(meshed)
        self._untouched = constraints.base.copy()
        return constraints

    def _constraints_on(self, meshed: MeshedScene) -> Constraints:
        return steady_constraints(meshed.scene)

    def h_star(self, parameters: Parameters) -> Array:
        """Material positions h* of undeformed spheres at the distances of the parameters, shape (n_h,)."""
        betas = parameters.diameters(self.problem.betas)
        centres = Geometry(betas, parameters.gaps, self.problem.length).centres
        if self.problem.closed:  # the first particle stays where its cells are
            centres = centres - centres[0] + self.scene.reference.geometry.centres[0]
        h = np.zeros(self.scene.h_size)
        for body, centre in zip(self.bodies, centres, strict=True):
            h[body.start : body.start + body.size : 2] = centre
        return h

    def apply(self, parameters: Parameters) -> PositionUpdate:
        """Set forms and constraints to the given parameters.

        Returns:
            How the positions of the material follow from the unknowns; h* is that of undeformed spheres.
        """
        scene, base = self.scene, self.constraints.base
        sizes = parameters.sizes or (1.0,) * len(self.bodies)
        base[:] = steady_base(scene, sizes) if parameters.sizes else self._untouched
        for body, points, solid, size in zip(self.bodies, self._sphere_points, parameters.solids, sizes, strict=True):
            if body.phase is not None and points is not None and solid is not None:
                body.phase.become(solid)
                body.phase.mesh.geometry.x[:] = points * size
        scene.liquid.become(parameters.liquid)
        for phase in scene.phases:
            if "rate" in phase.constants:
                phase.constants["rate"].value = 0.0
        if not (scene.material.newtonian or scene.periodic):
            scene.prescribe_ends(base, self.flows.at(parameters.liquid))
        return PositionUpdate(self.h_star(parameters))

    @contextmanager
    def changed_to(self, parameters: Parameters) -> Iterator[PositionUpdate]:
        """Context in which forms and constraints are those of other parameters; afterwards they are the solution's."""
        try:
            yield self.apply(parameters)
        finally:
            self.apply(self.parameters)

    def residual_at(self, parameters: Parameters, y: Array) -> Array:
        """The residual at free unknowns y and given parameters, shape (n_y,)."""
        with self.changed_to(parameters) as update:
            return self.newton.residual_at(y, update)

    def state_at(self, parameters: Parameters, y: Array) -> tuple[Array, Array]:
        """Material positions h, (n_h,), and full vector x, (n,), of free unknowns y at given parameters."""
        with self.changed_to(parameters) as update:
            return self.constraints.state(y, update)

    def distortion_of(self, h: Array, x: Array) -> float:
        """Smallest ratio of current to reference Jacobian in the liquid; not positive if any cell is inverted.

        Args:
            h: Positions of the material, shape (n_h,).
            x: Full vector, shape (n,).
        """
        solid = diagnostics.solid_distortion(self.bodies, h)
        return diagnostics.liquid_distortion(self.scene, x) if solid > 0 else 0.0

    def _shape_alone(self, distortion: float, parameters: Parameters, least: float) -> float:
        """Distortion of a mesh around spheres by the shapes alone, without that by a change of the distances.

        A mesh around spheres that is merely stretched to other distances remains accurate and symmetric; only the
        deformation of the shapes is a reason to replace it. Ratios of at least `least`, and those of meshes around
        deformed shapes, are returned unchanged.
        """
        if distortion >= least or self.scene.reference.deformed:
            return distortion
        undeformed = diagnostics.liquid_distortion(self.scene, self.meshed.displaced(self.h_star(parameters)))
        return distortion / min(1.0, undeformed) if undeformed > 0 else distortion

    @property
    def meshes(self) -> int:
        """Number of meshes generated so far."""
        return self.meshed.made

    @property
    def as_made(self) -> bool:
        """Whether the mesh is the one around spheres that would be made for the present distances."""
        reference = self.scene.reference
        return not reference.deformed and reference.geometry.gaps == self.problem.nominal(self.parameters.gaps)

    def remesh(self, parameters: Parameters | None = None, y: Array | None = None, *, afresh: bool = False) -> None:
        """Remesh the liquid for a state, and interpolate the state to the new mesh as a first guess.

        Args:
            parameters: Parameters of the state, by default those of the solution.
            y: Free unknowns of the state, by default the solution, in which no cell may be inverted.
            afresh: Whether a mesh around spheres is tried even if an earlier one was too distorted.

        Raises:
            MeshFailure: The mesh could not be generated.
        """
        parameters = parameters or self.parameters
        old_y = self.y if y is None else y
        old, (h, x) = self.scene, self.state_at(parameters, old_y)
        geometry, material = self.meshed.geometry_at(h), old_y[self.meshed.material]
        spheres = None
        if afresh or not self._as_refused(parameters):
            # Meshes around spheres are made for the distances of `SteadyProblem.nominal` only.
            spheres = replace(geometry, gaps=self.problem.nominal(parameters.gaps))

        def good_enough(distortion: float) -> bool:
            shape = self._shape_alone(distortion, parameters, FRESH_STEADY)
            self._refused = None if shape >= FRESH_STEADY else parameters
            return self._refused is None

        self.meshed.remesh(h, geometry, spheres, good_enough)
        self.parameters = parameters
        self.y = self.carried_over(old, x, h, material)

    def _as_refused(self, there: Parameters) -> bool:
        """Whether a mesh around spheres would be refused again, as it was for the last parameters in `_refused`.

        That is so if particles are at least as soft and as close as there, at a De that is no larger.
        """
        last = self._refused
        if last is None or there.De > last.De:
            return False
        closer = all(d <= before for d, before in zip(there.gaps, last.gaps, strict=True))
        return closer and all(Ca_e >= before for Ca_e, before in zip(there.Ca_es, last.Ca_es, strict=True))

    def take_over_costs(self, other: SteadySolver) -> None:
        """Add the iterations, factorisations, meshes and times that another scene has taken to those of this one."""
        self.iterations += other.iterations
        self.factorisations += other.factorisations
        self.meshed.made += other.meshes
        for name, seconds in other.clock.seconds.items():
            self.clock.seconds[name] += seconds

    @property
    def snapshot(self) -> Snapshot:
        """The present solution and its mesh."""
        return Snapshot(self.parameters, self.y, self.scene.reference, self.scene.liquid.six_node_mesh)

    def recall(self, snapshot: Snapshot) -> None:
        """Restore a stored solution and its mesh."""
        if snapshot.mesh is not self.scene.liquid.six_node_mesh:
            self.meshed.put(snapshot.reference, snapshot.mesh)
        self.parameters, self.y = snapshot.parameters, snapshot.y

    def reopen(self) -> None:
        """Create the solvers of a closed scene again, on its mesh."""
        self.meshed.put(self.scene.reference, self.scene.liquid.six_node_mesh)

    def carried_over(self, old: Scene, x: Array, h: Array, material: Array) -> Array:
        """Free unknowns of a solution interpolated from another mesh, shape (n_y,).

        Args:
            old: The scene on the other mesh.
            x: Its full vector, shape (n,).
            h: Positions of the material, shape (n_h,), which are the same on both meshes.
            material: Free unknowns of the particles.
        """
        new = self.meshed.carried(old, x, h)
        y = free_unknowns(self.scene, self.constraints, new)
        y[self.meshed.material] = material
        if self.scene.dp is not None:
            assert old.dp is not None
            y[self.constraints.fields["dp"]] = x[old.dp]
        if len(self.scene.F):
            y[self.constraints.fields["F"]] = x[old.F]
        return y

    def state(self) -> tuple[Array, Array]:
        """Material positions h, (n_h,), and full vector x, (n,), of the solution; sets the forms to its parameters."""
        return self.constraints.state(self.y, self.apply(self.parameters))

    @property
    def solution(self) -> Solution:
        """The solution as functionals see it; sets the forms to its parameters."""
        (h, x), geometry, parameters = self.state(), self.scene.reference.geometry, self.parameters
        free = (geometry.length - sum(parameters.diameters(self.problem.betas)) - sum(parameters.gaps)) / 2
        gradient = self.developed_flow.gradient
        return Solution(self.scene, self.constraints, self.y, h, x, g=1.0, free=free, gradient=gradient)

    def solve(self, parameters: Parameters, guess: Array | None = None) -> Report:
        """Solve at given parameters. On success `parameters` and `y` are updated.

        Args:
            parameters: Parameters at which to solve.
            guess: First guess, by default the last solution, shape (n_y,).

        Raises:
            NoSteadyState: There is no developed flow of this liquid.
            BudgetSpent: The time given to the computation is over.
            Stopped: A signal was received.
        """
        self.problem.monitor.check()
        self.linearised = None
        with self.changed_to(parameters) as update:
            y, report = self.newton.solve(self.y if guess is None else guess, update)
            self.iterations += report.iterations
            self.factorisations += report.factorisations
            if report.converged and self.distortion_of(*self.constraints.state(y, update)) <= 0:
                report = replace(report, converged=False, reason="a cell is inverted")
                self.newton.forget()
            if report.converged:
                self.y, self.parameters = y, parameters
        return report

    def forget(self) -> None:
        """Discard the factors."""
        self.newton.forget()
        self.linearised = None

    def distorted(self, parameters: Parameters | None = None, y: Array | None = None) -> bool:
        """Whether a state, by default the solution, requires a new mesh, for its distortion or its distances."""
        parameters = parameters or self.parameters
        h, x = self.state_at(parameters, self.y if y is None else y)
        reference = self.scene.reference
        if not reference.deformed and self.problem.nominal(parameters.gaps) != reference.geometry.gaps:
            return True
        gaps = diagnostics.gaps(self.bodies, h)
        distortion = self.distortion_of(h, x)
        if self.scene.moving:
            distortion = self._shape_alone(distortion, parameters, LEAST_STEADY)
        return needs_mesh(distortion, gaps, reference.geometry.gaps, LEAST_STEADY)

    def folded(self, parameters: Parameters, y: Array) -> bool:
        """Whether a cell of the mesh is inverted in a state."""
        return self.distortion_of(*self.state_at(parameters, y)) <= 0

    def linearise(self, part: float = 1.0) -> Linearisation:
        """The equations linearised at the solution, whose matrix is factorised unless the present factors will do.

        A Newton step with this matrix is added to the solution, to remove the error that lagged matrices have left.

        Args:
            part: Fraction of this step that is taken.

        Raises:
            NoSteadyState: The matrix is singular.
        """
        update = self.apply(self.parameters)
        if (at := self.linearised) is not None and at.y is self.y and at.parameters == self.parameters:
            return at
        self.linearised, before = None, self.newton.factorisations
        regular = self.newton.linearise_at(self.y, update)
        self.factorisations += self.newton.factorisations - before
        if not regular:
            raise NoSteadyState("Newton's matrix is singular at the solution", advice="a larger mesh.Np")
        self.y = self.y - part * self.newton.linear_solve(self.newton.residual_at(self.y, update), tolerance=LAST)
        self.iterations += 1
        self.linearised = Linearisation(self)
        return self.linearised

    def velocity_row(self) -> Array:
        """Coefficients c, (n_y,), for which c . y is the velocity of the last particle minus that of the first one."""
        row = np.zeros(self.constraints.size)
        row[self.constraints.fields["U_p"][[0, -1]]] = -1.0, 1.0
        return row

    def observe(self) -> Observation:
        """Quantities evaluated from the solution."""
        h, x = self.state()
        without_particles = self.developed_flow.gradient * self.problem.length
        return diagnostics.observe(self.scene, self.constraints, self.y, h, x, without_particles)

    @property
    def developed_flow(self) -> PipeState:
        """Developed flow of the liquid without particles."""
        return self.flows.at(self.parameters.liquid)
