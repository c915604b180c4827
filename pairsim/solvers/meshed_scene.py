"""A case on a reference mesh of its liquid, which is replaced when it has served its time; in time and quasi-steady.

Particles keep their meshes always. A new mesh lies around undeformed spheres while the shapes allow it, otherwise
around the shapes as they are; the mesh follows the particles by extension of their displacement into the liquid.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from pairsim.fem import diagnostics
from pairsim.fem.constraints import Constraints
from pairsim.fem.geometry import Geometry, MeshSettings, Outline, Reference
from pairsim.fem.meshing import liquid_mesh, make_outlines, particle_meshes
from pairsim.fem.remeshing import on_root
from pairsim.fem.scene import Body, Scene, make_bodies
from pairsim.fem.scene_constraints import extension_constraints
from pairsim.fem.six_node_mesh import SixNodeMesh
from pairsim.physics.materials.polymer import Polymer
from pairsim.runtime.arrays import Array
from pairsim.runtime.clock import Clock
from pairsim.runtime.errors import MeshFailure
from pairsim.runtime.fenicsx import MPI
from pairsim.solvers.mesh_transfer import carry_liquid
from pairsim.solvers.newton import Newton
from pairsim.solvers.problems import SceneProblem


def cut_particles(
    comm: MPI.Comm, settings: MeshSettings, geometry: Geometry, narrowest: tuple[float, ...], Ca_es: Sequence[float]
) -> tuple[list[Outline], list[SixNodeMesh | None]]:
    """Outlines of the particles, and meshes of the soft ones among them, the same on every process.

    Args:
        comm: Communicator of the case.
        settings: Cell sizes.
        geometry: Where the particles are.
        narrowest: Distances that the outlines are cut for.
        Ca_es: Elastic capillary numbers.

    Raises:
        MeshFailure: They could not be made.
    """

    def cut() -> tuple[list[Outline], list[SixNodeMesh | None]]:
        outlines = make_outlines(replace(geometry, gaps=narrowest), settings)
        return outlines, particle_meshes(geometry, settings, outlines, Ca_es)

    return on_root(comm, cut)


class MeshedScene:
    """The particles, and the scene and its solver on the present mesh, which `put` makes.

    Args:
        comm: Communicator of the case.
        problem: What does not change.
        outlines: Cut half-circles of the particles.
        insides: Meshes of the soft ones.
        Ca_es: Elastic capillary numbers that the forms begin with; 0 is rigid, for good.
        polymer: Viscoelastic part of the liquid, with the De that the forms begin with.
        steady: Quasi-steady, or in time.
        constrain: Makes the constraints on every new mesh, when `scene` is there.
        clock: Where the seconds go.

    Attributes:
        scene, constraints: On the present mesh.
        material: Free unknowns of the particles' material, the same on every mesh of the liquid.
        made: Meshes made so far.
    """

    scene: Scene
    constraints: Constraints
    material: Array

    def __init__(
        self,
        comm: MPI.Comm,
        problem: SceneProblem,
        outlines: Sequence[Outline],
        insides: Sequence[SixNodeMesh | None],
        Ca_es: Sequence[float],
        *,
        polymer: Polymer | None,
        steady: bool,
        constrain: Callable[[MeshedScene], Constraints],
        clock: Clock,
    ) -> None:
        self.comm, self.problem, self.outlines, self.clock = comm, problem, tuple(outlines), clock
        self._polymer, self._steady, self._constrain = polymer, steady, constrain
        self._newton: Newton | None = None
        self._extension: Newton | None = None
        self.made = 0
        with clock("jit"):
            self.bodies = make_bodies(comm, Ca_es, outlines, insides)

    @property
    def newton(self) -> Newton:
        """The solver on the present mesh."""
        assert self._newton is not None, "the scene was closed"
        return self._newton

    def put(self, reference: Reference, mesh: SixNodeMesh | None = None) -> None:
        """Put a mesh of the reference domain around the particles, a new one unless it is given.

        Raises:
            MeshFailure: It could not be made; the old one stays.
        """
        if mesh is None:
            with self.clock("mesh"):
                mesh = on_root(self.comm, lambda: liquid_mesh(reference, self.problem.mesh))
            self.made += 1
        self.close()
        with self.clock("jit"):
            self.scene = Scene(
                self.comm,
                reference,
                mesh,
                self.bodies,
                periodic=self.problem.periodic,
                boundary_velocity=self.problem.boundary_velocity,
                polymer=self._polymer,
                steady=self._steady,
            )
        self.constraints = self._constrain(self)
        self._newton = Newton(self.scene, self.constraints, self.problem.newton, clock=self.clock)
        fields = self.constraints.fields
        self.material = np.concatenate([fields.get(name, np.empty(0, int)) for name in ("v", "h", "U_p", "p_s")])

    def geometry_at(self, h: Array) -> Geometry:
        """Diameters and present distances.

        Raises:
            MeshFailure: The particles touch.
        """
        distances = self.comm.bcast(diagnostics.gaps(self.bodies, h))
        if distances.size and distances.min() <= 0:
            raise MeshFailure("the particles touch")
        return Geometry(self.problem.betas, tuple(map(float, distances)), self.problem.length)

    def remesh(
        self, h: Array, geometry: Geometry, spheres: Geometry | None, good_enough: Callable[[float], bool]
    ) -> None:
        """Put a new mesh around the particles, around undeformed spheres where that one is good enough.

        Args:
            h: Positions of the material.
            geometry: The geometry there.
            spheres: That of undeformed spheres to try first, None: none will do.
            good_enough: Whether the distortion that their mesh has at h may be borne.

        Raises:
            MeshFailure: A mesh could not be made.
        """
        if spheres is not None:
            self.put(Reference.spheres(spheres, self.outlines))
            if not self.scene.moving:
                return
            if good_enough(self.comm.bcast(diagnostics.liquid_distortion(self.scene, self.displaced(h)))):
                return
        shapes = tuple(body.outline_points(h) for body in self.bodies)
        self.put(Reference(geometry, self.outlines, shapes, True))

    def extend(self, h: Array) -> tuple[Array, Array]:
        """Displacement of a mesh that moves for given material positions: its free unknowns, and the full vector."""
        if self._extension is None:
            self._extension = Newton(self.scene, extension_constraints(self.scene), clock=self.clock)
        eta, _ = self._extension.solve(np.zeros(self._extension.constraints.size), h, 1.0, 0.0)
        return eta, self._extension.state(eta)[1]

    def displaced(self, h: Array) -> Array:
        """Full vector with the mesh's displacement for given material positions, if it moves, and zeros."""
        return self.extend(h)[1] if self.scene.moving else np.zeros(self.scene.size)

    def unit_extensions(self) -> Array:
        """The mesh's velocity for unit velocity of each particle, at the vertices, (N, n_vertices, 2)."""
        scene, vertices = self.scene, self.scene.liquid.six_node_mesh.vertices
        if scene.polymer is None or not scene.moving:
            return np.ones((len(self.bodies), len(vertices), 2)) * [1.0, 0.0]
        h = np.zeros(scene.h_size)
        still = scene.liquid.nodal("eta", self.displaced(h))[vertices]
        fields = []
        for body in self.bodies:
            moved = h.copy()
            moved[body.start : body.start + body.size : 2] = 1.0
            fields.append(scene.liquid.nodal("eta", self.displaced(moved))[vertices] - still)
        return np.array(fields)

    def carried(self, old: Scene, x: Array, h: Array, shift: float = 0.0) -> Array:
        """The liquid of an old scene on the present mesh, the particles' material at h, as a full vector.

        Args:
            old, x: The scene and its full vector.
            h: Positions of the material, in the numbering of both.
            shift: How far along the axis everything is from where it was.
        """
        return carry_liquid(old, x, self.scene, self.displaced(h), shift)

    def close(self) -> None:
        """Give the solvers' memory back."""
        for solver in (self._newton, self._extension):
            if solver is not None:
                solver.destroy()
        self._newton = self._extension = None


class OnMeshedScene:
    """What solves on a meshed scene, whose parts it shows as its own.

    Attributes:
        meshed: The scene with its mesh.
    """

    meshed: MeshedScene

    @property
    def scene(self) -> Scene:
        """The scene on the present mesh."""
        return self.meshed.scene

    @property
    def bodies(self) -> list[Body]:
        """The particles."""
        return self.meshed.bodies

    @property
    def constraints(self) -> Constraints:
        """Constraints on the present mesh."""
        return self.meshed.constraints

    @property
    def newton(self) -> Newton:
        """The solver on the present mesh."""
        return self.meshed.newton
