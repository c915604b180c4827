"""A scene: the phases of a case on one mesh, their boundaries, and the full vector of all fields.

The full vector x, shape (n,), consists of the canonical vectors of the phases (the liquid, then the soft particles from
upstream), the Lagrange multiplier m of the zero mean pressure, with periodic ends the pressure drop dp, and the forces
F on particles whose velocity is prescribed, which are the Lagrange multipliers of that condition. The positions of the
particles' material form a second vector h, shape (n_h,): for a soft particle the displacements (z, r) of all nodes from
its undeformed sphere centred at the origin, for a rigid particle the axial position of its centre. Constraints
(`pairsim.fem.algebra.constraints`) define x as a function of the free unknowns and of h.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from pairsim.fem.meshes.geometry import Outline, Reference
from pairsim.fem.meshes.quadrature import CellQuadrature, end_load
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh, nodes_at
from pairsim.fem.phases.compiled_phase import liquid_phase, solid_phase
from pairsim.fem.phases.phase import Phase
from pairsim.physics.conformation import exponential
from pairsim.physics.drive import DEVELOPED, Drive
from pairsim.physics.liquids import NEWTONIAN, Liquid
from pairsim.physics.liquids.conformation import LOG_CONFORMATION
from pairsim.physics.pipe import PipeState
from pairsim.physics.solids import Solid
from pairsim.quantities.scales import FLOW_RATE, TUBE_RADIUS
from pairsim.runtime.arrays import Array, Indices
from pairsim.runtime.errors import MeshFailure


def poiseuille(points: Array) -> Array:
    """Fully developed Newtonian flow of unit mean velocity at points (z, r), shape (n, 2); returns shape (n, 2)."""
    return np.column_stack([2 * (1 - (points[:, 1] / TUBE_RADIUS) ** 2), np.zeros(len(points))])


@dataclass(frozen=True)
class LiquidNodes:
    """Nodes of the liquid's mesh on its boundaries.

    Attributes:
        axis: Nodes with r = 0.
        wall: Nodes with r = 1/2.
        inlet: Nodes of the upstream end, in ascending r.
        outlet: Nodes of the downstream end, in ascending r, at the same radii as those of the inlet.
        interfaces: For each particle the nodes of its outline, from the downstream to the upstream pole.
        planes: Nodes of each of the reference domain's planes, in ascending r.
    """

    axis: Indices
    wall: Indices
    inlet: Indices
    outlet: Indices
    interfaces: tuple[Indices, ...]
    planes: tuple[Indices, ...]

    @staticmethod
    def find(mesh: SixNodeMesh, reference: Reference) -> LiquidNodes:
        r, half = mesh.points[:, 1], reference.geometry.length / 2
        inlet, outlet = mesh.nodes_of_plane(-half), mesh.nodes_of_plane(half)
        if len(inlet) != len(outlet) or not np.allclose(r[inlet], r[outlet], rtol=0.0, atol=1e-9):
            raise MeshFailure("the nodes of the two ends differ in number or radius")
        return LiquidNodes(
            np.flatnonzero(r < 1e-12),
            np.flatnonzero(r > TUBE_RADIUS - 1e-9),
            inlet,
            outlet,
            tuple(match(mesh.points, nodes) for nodes in reference.positions),
            tuple(mesh.nodes_of_plane(z) for z in reference.planes),
        )


def match(points: Array, wanted: Array) -> Indices:
    """Indices of the points at given positions.

    Args:
        points: Points, shape (n, 2).
        wanted: Positions, shape (k, 2).

    Returns:
        Indices, shape (k,).

    Raises:
        MeshFailure: There is no point at a position.
    """
    index = nodes_at(points, wanted)
    if index.min() < 0:
        raise MeshFailure("a node of an outline is not one of the mesh")
    return index


@dataclass(frozen=True)
class Body:
    """A rigid or soft particle, and its part of the vector h.

    Attributes:
        outline: Its half-circle, divided into arcs.
        phase: The solid inside, None for a rigid particle.
        nodes: Nodes of the mesh of the solid on the outline, empty for a rigid particle.
        start: First index of its part of h.
    """

    outline: Outline
    phase: Phase[Solid] | None
    nodes: Indices
    start: int

    @property
    def size(self) -> int:
        """Number of entries in h."""
        return 1 if self.phase is None else 2 * len(self.phase.six_node_mesh.points)

    @cached_property
    def quadrature(self) -> CellQuadrature:
        assert self.phase is not None
        return CellQuadrature(self.phase.six_node_mesh)

    def positions(self, h: Array) -> Array:
        """Current positions of all nodes of a soft particle, shape (nodes, 2)."""
        assert self.phase is not None
        return self.phase.six_node_mesh.points + self.displacement(h)

    def mean(self, displacements: Array, h: Array) -> float:
        """Axial component of a vector in the numbering of h, averaged over the volume of the particle."""
        if self.phase is None:
            return float(displacements[self.start])
        return self.quadrature.mean(self.displacement(displacements)[:, 0], self.positions(h))

    def mean_weights(self, h: Array) -> Array:
        """The weights of the entries of a vector in the numbering of h in `mean`, shape (n_h,)."""
        weights = np.zeros(len(h))
        if self.phase is None:
            weights[self.start] = 1.0
        else:
            weights[self.start : self.start + self.size : 2] = self.quadrature.mean_weights(self.positions(h))
        return weights

    def displacement(self, h: Array) -> Array:
        """Displacement of all nodes of a soft particle from its sphere centred at the origin, shape (nodes, 2)."""
        return h[self.start : self.start + self.size].reshape(-1, 2)

    def outline_points(self, h: Array) -> Array:
        """Current positions of the nodes of the outline, downstream pole first, shape (2 k + 1, 2)."""
        if self.phase is None:
            return self.outline.nodes + [h[self.start], 0.0]
        return self.outline.nodes + self.displacement(h)[self.nodes]


def make_bodies(
    solids: Sequence[Solid | None],
    outlines: Sequence[Outline],
    meshes: Sequence[SixNodeMesh | None],
    volume_modulus: bool = False,
) -> list[Body]:
    """Create the particles of a scene.

    Args:
        solids: What they are made of, None for rigid particles.
        outlines: Outlines of the particles.
        meshes: Meshes of the soft particles; ignored for rigid ones.
        volume_modulus: Whether soft particles resist changes of volume within cells; see `solid_phase`.
    """
    bodies: list[Body] = []
    start = 0
    for solid, outline, mesh in zip(solids, outlines, meshes, strict=True):
        if solid is not None:
            assert mesh is not None
            phase: Phase[Solid] | None = Phase(solid_phase(solid, volume_modulus), mesh, solid)
            nodes = match(mesh.points, outline.nodes)
        else:
            phase, nodes = None, np.empty(0, dtype=np.int64)
        bodies.append(Body(outline, phase, nodes, start))
        start += bodies[-1].size
    return bodies


def mesh_moves(particles: int, *, soft: bool, viscoelastic: bool, steady: bool) -> bool:
    """Whether the mesh of the liquid moves; forms for fixed meshes are cheaper.

    In the frame of a single rigid particle the mesh is at rest. In time-dependent problems of viscoelastic liquids it
    moves nevertheless, since the velocity of the frame is that of the particle at the previous step, and s is
    convected relative to the mesh.

    Args:
        particles: Number of particles.
        soft: Whether any particle is deformable.
        viscoelastic: Whether the liquid is viscoelastic.
        steady: Whether the problem is quasi-steady.
    """
    return soft or particles > (0 if viscoelastic and not steady else 1)


class Scene:
    """Phases, boundaries and scalar unknowns of a case on one reference mesh of the liquid.

    Args:
        reference: Reference domain of the liquid.
        mesh: Mesh of the reference domain.
        bodies: The particles, which the scenes before and after a remeshing have in common.
        periodic: Whether the ends are periodic, with an imposed flow rate; otherwise their velocity is prescribed.
        liquid: The liquid with its initial parameters.
        drive: What drives the liquid and the particles.
        steady: Whether the scene is quasi-steady; the velocity of the mesh is then the extension of the velocities of
            the particles into the liquid.

    Attributes:
        moving: Whether the mesh of the liquid moves.
        flow: Mean velocity of the liquid in the tube [U_av].
        size: Number n of entries of the full vector.
        h_size: Number n_h of entries of h.
        m: Index of the Lagrange multiplier of the zero mean pressure.
        dp: Index of the pressure drop, None unless the ends are periodic.
        F: Indices of the forces that move the particles at the prescribed velocity, shape (N,) or (0,).

    Raises:
        MeshFailure: The nodes of mesh and reference domain do not coincide.
    """

    def __init__(
        self,
        reference: Reference,
        mesh: SixNodeMesh,
        bodies: Sequence[Body],
        *,
        periodic: bool,
        liquid: Liquid = NEWTONIAN,
        drive: Drive = DEVELOPED,
        steady: bool = False,
    ) -> None:
        self.reference, self.bodies, self.periodic = reference, list(bodies), periodic
        self.drive, self.steady, self.flow = drive, steady, drive.flow
        soft = any(body.phase is not None for body in self.bodies)
        self.moving = mesh_moves(len(self.bodies), soft=soft, viscoelastic=liquid.has_memory, steady=steady)
        self.liquid = Phase(liquid_phase(liquid, self.moving, steady), mesh, liquid)
        self.nodes = LiquidNodes.find(mesh, reference)
        self.phases: list[Phase] = [self.liquid] + [b.phase for b in self.bodies if b.phase is not None]
        self.offsets = np.concatenate([[0], np.cumsum([phase.size for phase in self.phases])]).astype(np.int64)
        self.m = int(self.offsets[-1])
        self.dp = self.m + 1 if periodic else None
        first = self.m + (2 if periodic else 1)
        self.F = np.arange(first, first + (0 if drive.free else len(self.bodies)))
        self.size = first + len(self.F)
        self.h_size = sum(body.size for body in self.bodies)
        # The last flow at the ends, and its profiles there.
        self._at_ends: tuple[PipeState, list[dict[str, Array]]] | None = None

    @property
    def material(self) -> Liquid:
        """The liquid, with its current parameters."""
        return self.liquid.material

    @property
    def has_rates(self) -> bool:
        """Whether stresses depend on rates of change: of what the liquid carries along, or of viscous solids."""
        viscous = (b.phase is not None and b.phase.material.viscosity is not None for b in self.bodies)
        return self.material.has_memory or any(viscous)

    def boundary_velocity(self, points: Array) -> Array:
        """Velocity on the wall and on prescribed ends, in a Newtonian liquid, at points (z, r), shape (k, 2) both."""
        if self.drive.boundary is not None:
            return np.asarray(self.drive.boundary(points))
        return self.flow * poiseuille(points)

    def set_flow(self, x: Array, flow: float) -> None:
        """Let the liquid flow at another mean velocity [U_av]: with prescribed ends as in a Newtonian one, in x."""
        self.flow = flow
        if not self.periodic:
            for nodes in (self.nodes.inlet, self.nodes.outlet):
                points = self.liquid.six_node_mesh.points[nodes]
                self.liquid.nodal("u", x)[nodes] = self.boundary_velocity(points)

    def offset(self, phase: Phase) -> int:
        """First index of a phase in the full vector."""
        return int(self.offsets[next(i for i, p in enumerate(self.phases) if p is phase)])

    def set(self, x: Array) -> None:
        """Set the unknowns of all phases from the full vector."""
        for phase, a, b in zip(self.phases, self.offsets[:-1], self.offsets[1:], strict=True):
            phase.set(x[a:b])

    @property
    def at_rest(self) -> Array:
        """Full vector of a liquid at rest in the reference domain, shape (n,)."""
        x = np.zeros(self.size)
        for field in self.material.transported:
            self.liquid.nodal(field.name, x)[:] = field.rest
        return x

    def conformations(self, x: Array) -> Array:
        """Conformations c of all modes at the nodes, from a full vector, shape (nodes, 4 M)."""
        return exponential(self.log_conformations(x))

    def log_conformations(self, x: Array) -> Array:
        """Logarithms of the conformations of all modes at the nodes, from a full vector, shape (nodes, 4 M)."""
        return self.liquid.nodal(LOG_CONFORMATION.name, x)

    def prescribe(self, x: Array, nodes: Indices, flow: PipeState) -> None:
        """Set the fields of the liquid at some nodes to those of a developed flow, in the full vector x."""
        self._set_profiles(x, nodes, flow.profiles(self.liquid.six_node_mesh.points[nodes, 1]))

    def _set_profiles(self, x: Array, nodes: Indices, profiles: Mapping[str, Array]) -> None:
        for name, values in profiles.items():
            self.liquid.nodal(name, x)[nodes, : values.shape[1]] = values

    def prescribe_ends(self, x: Array, flow: PipeState) -> None:
        """Set the fields at the ends of the liquid to those of a developed flow, in the full vector x."""
        ends = self.nodes.inlet, self.nodes.outlet
        if self._at_ends is None or self._at_ends[0] is not flow:
            points = self.liquid.six_node_mesh.points
            self._at_ends = flow, [flow.profiles(points[nodes, 1]) for nodes in ends]
        for nodes, profiles in zip(ends, self._at_ends[1], strict=True):
            self._set_profiles(x, nodes, profiles)

    def at_rest_between(self, flow: PipeState) -> Array:
        """Full vector of a developed flow at the ends, which decreases linearly to rest at the undeformed particles."""
        x = self.at_rest
        self.prescribe(x, np.arange(len(self.liquid.six_node_mesh.points)), flow)
        return self._resting(x)

    def starting(self, flow: float) -> Array:
        """Full vector of Newtonian flow of a mean velocity [U_av] at the ends, decreasing to rest at the particles."""
        x = self.at_rest
        self.liquid.nodal("u", x)[:] = flow * poiseuille(self.liquid.six_node_mesh.points)
        return self._resting(x)

    def _resting(self, x: Array) -> Array:
        """A full vector whose velocities decrease from the ends to rest at the undeformed particles, in place."""
        geometry, points = self.reference.geometry, self.liquid.six_node_mesh.points
        poles = np.sort(np.ravel(geometry.centres + np.outer([-0.5, 0.5], geometry.betas)))
        end = geometry.length / 2
        share = np.interp(points[:, 0], [-end, *poles, end], [1, *np.zeros(len(poles)), 1])
        self.liquid.nodal("u", x)[:, 0] *= share
        return x

    def set_step(self, star: Array, g: float, U_m: float, *, solids: bool = True) -> None:
        """Set the constants of a time step in the phases that have time derivatives.

        Args:
            star: Part of the full vector fixed by the time scheme, shape (n,).
            g: gamma dt.
            U_m: Velocity of the frame.
            solids: Whether to set those of viscous solids, too.
        """
        if self.material.has_memory:
            self.liquid.set_star(star[: self.liquid.size])
            self.liquid.constants["g"].value = g
            self.liquid.constants["U_m"].value = U_m
        if solids:
            self.set_solid_rates(star, 1 / g)

    def set_solid_rates(self, star: Array, rate: float) -> None:
        """Let the material of viscous solids have the velocity `rate` (eta - star), for a full vector star."""
        for body in self.bodies:
            if body.phase is not None and body.phase.material.viscosity is not None:
                start = self.offset(body.phase)
                body.phase.set_star(star[start : start + body.phase.size])
                body.phase.constants["rate"].value = rate

    def with_displacements(self, x: Array, h: Array) -> Array:
        """A full vector with the displacements of soft particles taken from the positions h, shape (n,)."""
        x = x.copy()
        for body in self.bodies:
            if body.phase is not None:
                body.phase.nodal("eta", x[self.offset(body.phase) :])[:] = body.displacement(h)
        return x

    def positions(self, x: Array) -> Array:
        """Current positions of the nodes of the liquid, shape (nodes, 2)."""
        mesh = self.liquid.six_node_mesh
        return mesh.points + self.liquid.nodal("eta", x) if self.moving else mesh.points

    @cached_property
    def gauge(self) -> tuple[Indices, Array]:
        """Indices and weights of the integral int p_f 2 pi r dX of the liquid's pressure."""
        vertices = self.liquid.six_node_mesh.vertices
        return self.liquid.index("p", vertices), CellQuadrature(self.liquid.six_node_mesh).p1_load

    def _end(self, name: str, nodes: Indices) -> tuple[Indices, Array]:
        degree = 2 if name == "u" else 1
        chosen = nodes if degree == 2 else nodes[::2]
        load = end_load(self.liquid.six_node_mesh, nodes, degree)
        return self.liquid.index(name, chosen), load if degree == 2 else load[::2]

    @cached_property
    def flow_rate(self) -> tuple[Indices, Array]:
        """Indices and weights of the flow rate int u_z 2 pi r dr through the inlet."""
        return self._end("u", self.nodes.inlet)

    @cached_property
    def drop(self) -> tuple[Indices, Array]:
        """Indices and weights of the difference of the area means of p at the ends."""
        (i, w), (j, v) = self._end("p", self.nodes.inlet), self._end("p", self.nodes.outlet)
        return np.concatenate([i, j]), np.concatenate([w, -v]) / FLOW_RATE

    @cached_property
    def linear_terms(self) -> sparse.csr_matrix:
        """The terms with scalar unknowns, which are not part of the forms, as a matrix of shape (n, n).

        m int q is added to continuity, and the equation of m is int p_f = 0. With periodic ends dp int_inlet v_z is
        subtracted from momentum (Eq. (9) of the paper), and the equation of dp is the flow rate (Eq. (14)); with planes
        it is the mean of theirs, since discrete flow rates change a little with the particles beside a section. The
        force F on a particle is subtracted from momentum at its downstream pole, which the constraints add to that of
        the whole surface, and the equation of F is the velocity of the pole.
        """
        index, weight = self.gauge
        m = np.full(len(index), self.m)
        rows, columns, values = [index, m], [m, index], [weight, weight]
        if self.dp is not None:
            index, weight = self.flow_rate
            dp = np.full(len(index), self.dp)
            rows.append(index)
            columns.append(dp)
            values.append(-weight)
            sections = [(index, weight), *(self._end("u", nodes) for nodes in self.nodes.planes)]
            for index, weight in sections:
                rows.append(dp)
                columns.append(index)
                values.append(-weight / len(sections))
        if len(self.F):
            index = self.liquid.index("u", np.array([at[0] for at in self.nodes.interfaces]), 0)
            rows += [index, self.F]
            columns += [self.F, index]
            values += [-np.ones(len(self.F))] * 2
        entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        return sparse.csr_matrix(sparse.coo_matrix(entries, shape=(self.size, self.size)))

    def load(self) -> Array:
        """Constant part of the residual, the imposed flow rate and velocities, shape (n,)."""
        f = np.zeros(self.size)
        if self.dp is not None:
            f[self.dp] = FLOW_RATE * self.flow
        if self.drive.velocity is not None:
            f[self.F] = self.drive.velocity
        return f

    def overstretched(self, x: Array) -> str:
        """Message if tr c exceeds the bound of a mode's law somewhere, where it is not defined; otherwise empty."""
        for i, law in enumerate(self.material.modes):
            if law.largest_trace is None:
                continue
            c = exponential(self.log_conformations(x)[:, 4 * i : 4 * i + 4])
            trace = c[:, 0] + c[:, 2] + c[:, 3]
            top = int(np.argmax(trace))
            largest = float(trace[top])
            if not largest < law.largest_trace:
                z, r = self.positions(x)[top].tolist()
                bound = f"{law.largest_trace:g}, the bound of the {law.label} law"
                return f"tr c = {largest:.4g} at z = {z:.3f}, r = {r:.3f} exceeds {bound}"
        return ""

    def pressure_drop(self, x: Array) -> float:
        """Pressure drop dp over the length of the tube [eta_0 U_av/D_c]."""
        index, weight = self.drop
        return float(weight @ x[index])
