"""A scene whose liquid can be remeshed, as used by time-dependent and quasi-steady problems alike.

The particles keep their meshes. A new mesh of the liquid is made around undeformed spheres while the distortion allows
it, otherwise around the deformed shapes. Between remeshings the mesh follows the particles by an extension of their
displacement into the liquid; see "Remeshing" in docs/explanation/numerics.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pairsim.fem import diagnostics
from pairsim.fem.algebra.constraints import Constraints
from pairsim.fem.algebra.mesh_extension import MeshExtension
from pairsim.fem.body import Body, make_bodies
from pairsim.fem.meshes.cell_sizes import make_outlines
from pairsim.fem.meshes.geometry import Geometry, MeshSettings, Outline, Reference
from pairsim.fem.meshes.meshing import liquid_mesh, particle_meshes
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.fem.scene import Scene
from pairsim.physics.liquids import Liquid
from pairsim.physics.solids import Solid
from pairsim.quantities.kinds import LENGTH
from pairsim.runtime.arrays import Array
from pairsim.runtime.clock import Clock
from pairsim.runtime.errors import MeshFailure
from pairsim.runtime.message import Message
from pairsim.solvers.mesh_transfer import carry_liquid
from pairsim.solvers.nonlinear.newton import Newton
from pairsim.solvers.problems import Setup

# All three were chosen. A new mesh is made when the Jacobian of a cell falls below LEAST_DISTORTION times its reference
# value, or when a gap has changed by the factor GAP_RATIO. A new mesh around undeformed spheres is used only if its
# smallest ratio is at least FRESH_DISTORTION.
LEAST_DISTORTION = 0.25
FRESH_DISTORTION = 0.45
GAP_RATIO = 1.6


def needs_mesh(
    distortion: float, gaps: Array, reference_gaps: Sequence[float], least: float = LEAST_DISTORTION
) -> bool:
    """Whether a new mesh is needed.

    Args:
        distortion: Smallest ratio of a liquid cell's current to its reference Jacobian.
        gaps: Current distances, shape (N-1,).
        reference_gaps: Distances for which the mesh was made, N-1 values.
        least: Smallest ratio that is accepted.
    """
    if distortion < least:
        return True
    ratio = gaps / np.asarray(reference_gaps) if gaps.size else np.ones(1)
    return bool(ratio.max() > GAP_RATIO or ratio.min() < 1 / GAP_RATIO)


def cut_particles(
    settings: MeshSettings,
    geometry: Geometry,
    narrowest: tuple[float, ...],
    solids: Sequence[Solid | None],
) -> tuple[list[Outline], list[SixNodeMesh | None]]:
    """Divide the outlines of the particles into arcs and mesh the soft particles.

    Args:
        settings: Cell sizes.
        geometry: The particles.
        narrowest: Distances that determine the lengths of the arcs [D_c], N-1 values.
        solids: The particles' materials, None for rigid particles.

    Returns:
        Outlines, and meshes with None for rigid particles.

    Raises:
        MeshFailure: A mesh could not be generated.
    """
    outlines = make_outlines(replace(geometry, gaps=narrowest), settings)
    return outlines, particle_meshes(geometry, settings, outlines, [solid is not None for solid in solids])


@dataclass(frozen=True)
class Cells:
    """The meshes that a scene begins with.

    Attributes:
        insides: Meshes of the soft particles, None for rigid ones.
        reference: Reference domain of the liquid.
        mesh: Mesh of this domain; None if it is still to be generated.
    """

    insides: Sequence[SixNodeMesh | None]
    reference: Reference
    mesh: SixNodeMesh | None = None


class MeshedScene:
    """The particles of a case, and the scene and the solver on the present mesh of the liquid, created by `put`.

    Args:
        problem: What the scene and its meshes are made of.
        outlines: Outlines of the particles.
        insides: Meshes of the soft particles, None for rigid ones.
        solids: The particles' initial materials, None for rigid particles, which stay rigid.
        liquid: The liquid with its initial parameters.
        steady: Whether solutions are quasi-steady.
        constrain: Returns the constraints; called whenever `scene` has been created on a new mesh.
        clock: Stopwatch for the phases of the computation.

    Attributes:
        scene: Scene on the present mesh.
        constraints: Constraints on the present mesh.
        material: Indices of the free unknowns of the particles, whose meaning does not depend on the liquid's mesh.
        made: Number of meshes of the liquid generated so far.
    """

    scene: Scene
    constraints: Constraints
    material: Array

    def __init__(
        self,
        problem: Setup,
        outlines: Sequence[Outline],
        insides: Sequence[SixNodeMesh | None],
        solids: Sequence[Solid | None],
        *,
        liquid: Liquid,
        steady: bool,
        constrain: Callable[[MeshedScene], Constraints],
        clock: Clock,
    ) -> None:
        self.problem, self.outlines, self.clock = problem, tuple(outlines), clock
        self._liquid, self._steady, self._constrain = liquid, steady, constrain
        self._newton: Newton | None = None
        self._extension: MeshExtension | None = None
        self.made = 0
        with clock("jit"):
            self.bodies = make_bodies(solids, outlines, insides, problem.volume_modulus)

    @property
    def newton(self) -> Newton:
        """The solver on the present mesh."""
        assert self._newton is not None, "the scene has been closed"
        return self._newton

    def put(self, reference: Reference, mesh: SixNodeMesh | None = None) -> None:
        """Create the scene on a mesh of a reference domain.

        Args:
            reference: Reference domain of the liquid.
            mesh: Mesh of this domain; generated if None.

        Raises:
            MeshFailure: The mesh could not be generated; the previous scene is kept.
        """
        if mesh is None:
            with self.clock("mesh"):
                mesh = liquid_mesh(reference, self.problem.mesh)
            self.made += 1
        self.close()
        with self.clock("jit"):
            self.scene = Scene(
                reference,
                mesh,
                self.bodies,
                periodic=self.problem.periodic,
                liquid=self._liquid,
                drive=self.problem.drive,
                steady=self._steady,
            )
        self.constraints = self._constrain(self)
        self._newton = Newton(
            self.scene, self.constraints, self.problem.newton, clock=self.clock, monitor=self.problem.monitor
        )
        fields = self.constraints.fields
        self.material = np.concatenate([fields.get(name, np.empty(0, int)) for name in ("v", "h", "U_p", "p_s")])

    def geometry_at(self, h: Array) -> Geometry:
        """Geometry with the distances at the material positions h, shape (n_h,).

        Raises:
            MeshFailure: Two particles are in contact.
        """
        distances = diagnostics.gaps(self.bodies, h)
        if distances.size and distances.min() <= 0:
            least = LENGTH(distances.min(), ".2g")
            raise MeshFailure(Message("two particles are in contact: their distance is {}", least))
        problem = self.problem
        return Geometry(problem.betas, tuple(map(float, distances)), problem.length, problem.closed)

    def remesh(
        self, h: Array, geometry: Geometry, spheres: Geometry | None, good_enough: Callable[[float], bool]
    ) -> None:
        """Create the scene on a new mesh, around undeformed spheres if possible, otherwise around the deformed shapes.

        Args:
            h: Positions of the material, shape (n_h,).
            geometry: Geometry at these positions.
            spheres: Geometry of undeformed spheres to try first; None to use the deformed shapes at once.
            good_enough: Whether a mesh around spheres is accepted whose smallest ratio of current to reference
                Jacobian at h is the given number.

        Raises:
            MeshFailure: A mesh could not be generated.
        """
        if spheres is not None:
            self.put(Reference.spheres(spheres, self.outlines))
            if not self.scene.moving:
                return
            if good_enough(diagnostics.liquid_distortion(self.scene, self.displaced(h))):
                return
        shapes = tuple(body.outline_points(h) for body in self.bodies)
        self.put(Reference(geometry, self.outlines, shapes, True))

    def extend(self, h: Array) -> tuple[Array, Array]:
        """Extend the displacement of the particles into the liquid, on a moving mesh.

        Args:
            h: Positions of the material, shape (n_h,).

        Returns:
            Free unknowns of the mesh displacement, and a full vector with this displacement and zeros elsewhere,
            shape (n,).
        """
        if self._extension is None:
            self._extension = MeshExtension(self.scene)
        return self._extension(h)

    def displaced(self, h: Array) -> Array:
        """Full vector with the displacement of the mesh for material positions h, and zeros elsewhere, shape (n,)."""
        return self.extend(h)[1] if self.scene.moving else np.zeros(self.scene.size)

    def carried(self, old: Scene, x: Array, h: Array, shift: float = 0.0) -> Array:
        """Interpolate the fields of the liquid in an old scene to the present mesh.

        Args:
            old: The old scene.
            x: Its full vector, shape (n,).
            h: Positions of the material, in the numbering of both scenes, shape (n_h,).
            shift: Axial translation of the particles relative to the old scene [D_c].

        Returns:
            Full vector on the present mesh.
        """
        return carry_liquid(old, x, self.scene, self.displaced(h), shift)

    def close(self) -> None:
        """Free the memory of the solvers."""
        if self._newton is not None:
            self._newton.destroy()
        self._newton = self._extension = None


class MeshedSolver:
    """Base class of the solvers on a `MeshedScene`, with shortcuts to its attributes.

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

    def close(self) -> None:
        """Free the memory of the solver."""
        self.meshed.close()
