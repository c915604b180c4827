"""Constraints of a disturbed scene: its free unknowns, and the motions and displacements of its particles.

The full vector of the disturbances, shape (n,), consists of the canonical vectors of the liquid and of the soft
particles. It is x = N y + D d with the free unknowns y, shape (n_y,), and the displacements d of the particles'
centres, shape (N_p,); T restricts the residual to the test functions. Particles are displaced towards theta = 0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from pairsim.fem.algebra.constraints import Triplets, Unknowns
from pairsim.fem.azimuthal import motion
from pairsim.fem.azimuthal.fields import (
    COMPONENTS,
    SCALAR_ON_AXIS,
    TENSOR_ON_AXIS,
    VECTOR_ON_AXIS,
    AxisCondition,
)
from pairsim.fem.azimuthal.motion import ON_AXIS
from pairsim.fem.azimuthal.phase import DisturbedPhase
from pairsim.fem.body import Body
from pairsim.fem.meshes.quadrature import CellQuadrature
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Array, Flags, Indices


@dataclass(frozen=True)
class DisturbedConstraints:
    """Constraints of a disturbed scene.

    Attributes:
        N: Dependence of the full vector on the free unknowns, shape (n, n_y).
        D: Dependence on the displacements of the particles, shape (n, N_p).
        T: Restriction of the residual, shape (n_y, n); rows for which `pins` has a condition are empty.
        pins: Conditions on the full vector that replace equations, shape (n_y, n).
        pinned: Values of these conditions for unit displacements of the particles, shape (n_y, N_p).
        lateral: Free unknowns that are the lateral velocities of the particles, shape (N_p,).
        rotation: Free unknowns that are their rotations, shape (N_p,).
        fields: Free unknowns of each field; its equations have the same numbers.
        follows: Maps rates of change of displacements at soft particles to the velocities that follow from them: of the
            liquid at their surfaces, and of the material of viscous ones; shape (n, n).
        moves: The part of these velocities that is a unit lateral velocity of a particle, which N y contains already,
            shape (n, N_p).
        masses: Inertia of the particles in the equations at Re = 1, with the density of the liquid, for unit
            accelerations of their lateral velocities and then of their rotations, shape (n_y, 2 N_p).
    """

    N: sparse.csr_matrix
    D: sparse.csr_matrix
    T: sparse.csr_matrix
    pins: sparse.csr_matrix
    pinned: sparse.csr_matrix
    lateral: Indices
    rotation: Indices
    fields: dict[str, Indices]
    follows: sparse.csr_matrix
    moves: sparse.csr_matrix
    masses: sparse.csr_matrix

    def with_known(self, known: Indices, values: Array) -> DisturbedConstraints:
        """These constraints without some free unknowns and their equations, which have been solved.

        Args:
            known: Their numbers, shape (k,).
            values: Their values for unit displacements of the particles, shape (k, N_p).
        """
        kept = np.setdiff1d(np.arange(self.N.shape[1]), known)
        place = np.full(self.N.shape[1], -1)
        place[kept] = np.arange(len(kept))
        return replace(
            self,
            N=self.N[:, kept],
            D=sparse.csr_matrix(self.D + self.N[:, known] @ sparse.csr_matrix(values)),
            T=self.T[kept],
            pins=self.pins[kept],
            pinned=self.pinned[kept],
            masses=self.masses[kept],
            lateral=place[self.lateral],
            rotation=place[self.rotation],
            fields={name: place[at] for name, at in self.fields.items() if place[at].min() >= 0},
        )


def displaced_nodes(mesh: SixNodeMesh, interface: Flags) -> Flags:
    """Mask of the liquid's nodes that have a displacement of their own, shape (n,).

    As in `pairsim.fem.algebra.scene_constraints` these are the vertices, and all nodes in the layer of cells at the
    interfaces. The displacement of any other node is the mean of those at the two ends of its side.

    Args:
        mesh: Mesh of the liquid.
        interface: Nodes on interfaces, shape (n,).
    """
    own = interface.copy()
    own[mesh.vertices] = True
    own[mesh.cells[interface[mesh.cells[:, :3]].any(axis=1)]] = True
    return own


class _Builder:
    """Builder of `DisturbedConstraints`.

    Args:
        scene: The axisymmetric scene.
        phases: The disturbed phases, in its order.
        h: Positions of the particles' material, shape (n_h,).
    """

    def __init__(self, scene: Scene, phases: list[DisturbedPhase], h: Array) -> None:
        self.scene, self.phases, self.h = scene, phases, h
        self.offsets = np.concatenate([[0], np.cumsum([phase.numbering.size for phase in phases])])
        self.y = Unknowns()
        self.N, self.D, self.rows, self.pins, self.pinned = (Triplets() for _ in range(5))
        self.follows, self.moves, self.masses = (Triplets() for _ in range(3))
        count = self.count = len(scene.bodies)
        self.lateral, self.rotation = self.y.take("lateral", count), self.y.take("rotation", count)

    def free(
        self, part: int, name: str, fixed: Flags, axis: Flags, condition: AxisCondition, first: int = 0
    ) -> Indices:
        """Add the free unknowns of a field, subject to its condition on the axis.

        Args:
            part: Number of the phase.
            name: Name of the field.
            fixed: Mask of the carriers (nodes with degrees of freedom of the field) at which it is not free.
            axis: Mask of the carriers on the axis.
            condition: The condition on the axis.
            first: First component of the field to which the condition applies.

        Returns:
            Free unknown of each carrier and component, -1 where there is none.
        """
        numbering = self.phases[part].numbering
        nodes = numbering.carriers(name)
        components = len(condition.zero) + 2 * len(condition.opposite)
        number = np.full((len(nodes), components), -1)
        opposite = [pair[1] for pair in condition.opposite]
        for c in range(components):
            kept = ~fixed & ~(axis if c in condition.zero or c in opposite else np.zeros_like(axis))
            number[kept, c] = self.y.take(name, int(np.count_nonzero(kept)))
            self.tie(part, numbering.index(name, nodes[kept], first + c), number[kept, c])
        on_axis = axis & ~fixed
        for c, other in condition.opposite:
            number[on_axis, other] = number[on_axis, c]
            self.tie(part, numbering.index(name, nodes[on_axis], first + other), number[on_axis, c], -1.0)
        return number

    def tie(self, part: int, at: Indices, unknown: Indices, factor: Array | float = 1.0) -> None:
        """Set entries of a phase to free unknowns times a factor, in trial and test functions alike."""
        self.N.add(self.offsets[part] + at, unknown, factor)
        self.rows.add(unknown, self.offsets[part] + at, factor)

    def liquid(self) -> None:
        """Constrain velocity, pressure, conformation and displacement of the liquid."""
        scene, (phase, *_) = self.scene, self.phases
        mesh, nodes, numbering = phase.mesh, scene.nodes, phase.numbering
        axis = mesh.points[:, 1] < ON_AXIS
        ends = np.zeros_like(axis)
        ends[nodes.inlet] = ends[nodes.outlet] = True
        outer = ends.copy()
        outer[nodes.wall] = True
        interface = np.zeros_like(axis)
        for at in nodes.interfaces:
            interface[at] = True
        self.free(0, "u", outer | interface, axis, VECTOR_ON_AXIS)
        vertices = numbering.carriers("p")
        self.free(0, "p", np.zeros(len(vertices), dtype=bool), axis[vertices], SCALAR_ON_AXIS)
        for field in scene.material.solvent.transported:
            carriers = numbering.carriers(field.name)
            self.free(0, field.name, ends[carriers], axis[carriers], SCALAR_ON_AXIS)
        for mode in range(len(scene.material.modes)):
            self.free(0, "chi", ends, axis, TENSOR_ON_AXIS, first=COMPONENTS * mode)
        own = displaced_nodes(mesh, interface)
        self.free(0, "eta", outer | interface | ~own, axis, VECTOR_ON_AXIS)
        self.between = np.flatnonzero(~own)

    def particles(self) -> None:
        """Let the liquid at each particle move with it, and add the unknowns of the particle."""
        part = 0
        for i, (body, at) in enumerate(zip(self.scene.bodies, self.scene.nodes.interfaces, strict=True)):
            moved = motion.translation(len(at)), motion.turning(body, self.h)
            self.surface(i, at, moved)
            if body.phase is None:
                self.rigid(i, at, moved)
            else:
                part += 1
                self.soft(i, part, body, at)

    def surface(self, i: int, at: Indices, moved: tuple[Array, Array]) -> None:
        """Let the liquid at the nodes of particle i have the velocities of unit translation and rotation."""
        for unknown, values in zip((self.lateral[i], self.rotation[i]), moved, strict=True):
            for c in range(3):
                self.N.add(self.phases[0].numbering.index("u", at, c), np.full(len(at), unknown), values[:, c])

    def rigid(self, i: int, at: Indices, moved: tuple[Array, Array]) -> None:
        """Displace a rigid particle, and add its equations: no force and no torque act on it."""
        numbering = self.phases[0].numbering
        for c in range(3):
            self.D.add(numbering.index("eta", at, c), np.full(len(at), i), moved[0][:, c])
            for unknown, values in zip((self.lateral[i], self.rotation[i]), moved, strict=True):
                self.rows.add(np.full(len(at), unknown), numbering.index("u", at, c), values[:, c])
        radius = self.scene.bodies[i].outline.radius
        volume = 4 / 3 * np.pi * radius**3
        equations, columns = np.array([self.lateral[i], self.rotation[i]]), np.array([i, self.count + i])
        self.masses.add(equations, columns, np.array([volume, 2 / 5 * volume * radius**2]))

    def soft(self, i: int, part: int, body: Body, at: Indices) -> None:
        """Add the fields of a soft particle, whose momentum equation is joined to that of the liquid at its surface.

        The momentum equation determines the displacement of its material up to a rigid translation and rotation. The
        rows of the particle's lateral velocity and rotation, which have no other equations, therefore prescribe the
        mean displacement, which is that of the particle, and a mean rotation of zero.
        """
        phase, numbering = self.phases[part], self.phases[part].numbering
        points = phase.mesh.points
        axis = points[:, 1] < ON_AXIS
        nowhere = np.zeros_like(axis)
        number = self.free(part, "eta", nowhere, axis, VECTOR_ON_AXIS)
        vertices = numbering.carriers("p")
        self.free(part, "p", nowhere[vertices], axis[vertices], SCALAR_ON_AXIS)
        for c in range(3):
            unknown = number[body.nodes, c]
            sign = np.where((c == 2) & axis[body.nodes], -1.0, 1.0)
            k = unknown >= 0
            self.rows.add(unknown[k], self.phases[0].numbering.index("u", at[k], c), sign[k])
            u, eta = (self.phases[0].numbering.index(name, at, c) for name in ("u", "eta"))
            self.N.add(eta[k], unknown[k], sign[k])
            self.follows.add(u, eta)
            self.moves.add(u, np.full(len(at), i), motion.translation(len(at))[:, c])
        if "v" in numbering:
            self.material(i, part, body)
        quadrature = CellQuadrature(phase.mesh)
        load = _load(quadrature)
        relative = points - [load @ points[:, 0] / load.sum(), 0.0]
        fields = motion.translation(len(points)), motion.rotation(relative)
        for row, column, field in zip((self.lateral[i], self.rotation[i]), (i, self.count + i), fields, strict=True):
            size = load @ (field**2).sum(axis=1)
            for c in range(3):
                at_nodes = self.offsets[part] + numbering.index("eta", np.arange(len(points)), c)
                self.pins.add(np.full(len(points), row), at_nodes, load * field[:, c] / size)
                k = number[:, c] >= 0
                sign = np.where((c == 2) & axis, -1.0, 1.0)
                self.masses.add(number[k, c], np.full(np.count_nonzero(k), column), (sign * load * field[:, c])[k] / 2)
        self.pinned.add(self.lateral[[i]], np.array([i]))

    def material(self, i: int, part: int, body: Body) -> None:
        """Make the velocity of a viscous particle's material that of rolling inside its shape plus d eta/dt."""
        numbering = self.phases[part].numbering
        rolling = motion.rolling_inside(body, self.h)
        nodes = np.arange(len(rolling))
        for c in range(3):
            v = self.offsets[part] + numbering.index("v", nodes, c)
            self.N.add(v, np.full(len(nodes), self.rotation[i]), rolling[:, c])
            self.follows.add(v, self.offsets[part] + numbering.index("eta", nodes, c))

    def interpolation(self) -> sparse.csr_matrix:
        """Matrix, shape (n, n), that sets the displacement of nodes `between` to the mean at the ends of their side."""
        numbering, parents = self.phases[0].numbering, self.phases[0].mesh.parents[self.between]
        made, n = Triplets(), int(self.offsets[-1])
        set_ones = np.ones(n, dtype=bool)
        for c in range(3):
            at = numbering.index("eta", self.between, c)
            set_ones[at] = False
            for parent in parents.T:
                made.add(at, numbering.index("eta", parent, c), 0.5)
        made.add(np.flatnonzero(set_ones), np.flatnonzero(set_ones))
        return made.matrix((n, n))

    def finished(self) -> DisturbedConstraints:
        """Assemble the matrices."""
        n, count, particles = int(self.offsets[-1]), self.y.size, self.count
        P = self.interpolation()
        return DisturbedConstraints(
            sparse.csr_matrix(P @ self.N.matrix((n, count))),
            sparse.csr_matrix(P @ self.D.matrix((n, particles))),
            sparse.csr_matrix(self.rows.matrix((count, n)) @ P.T),
            self.pins.matrix((count, n)),
            self.pinned.matrix((count, particles)),
            self.lateral,
            self.rotation,
            self.y.fields,
            self.follows.matrix((n, n)),
            self.moves.matrix((n, particles)),
            self.masses.matrix((count, 2 * particles)),
        )


def _load(quadrature: CellQuadrature) -> Array:
    """Volume integrals of the P2 shape functions, shape (n,)."""
    load = np.zeros(len(quadrature.mesh.points))
    weights = quadrature.weights(quadrature.mesh.points)
    np.add.at(load, quadrature.mesh.cells, np.einsum("mq,qa->ma", weights, quadrature.shapes))
    return load


def disturbed_constraints(scene: Scene, phases: list[DisturbedPhase], h: Array) -> DisturbedConstraints:
    """Constraints of a disturbed scene.

    Args:
        scene: The axisymmetric scene.
        phases: The disturbed phases, in its order.
        h: Positions of the particles' material, shape (n_h,).
    """
    made = _Builder(scene, phases, h)
    made.liquid()
    made.particles()
    return made.finished()
