"""A scene: which phases a case needs, where their boundaries are, and the full vector of all unknown fields.

The full vector x stacks the canonical vectors of the phases (liquid, then the soft particles from upstream) and the
scalars m (uniform source of the pressure gauge) and, with periodic ends, dp. The positions of the particles' material
form a second vector h: the displacements of every soft particle from its undeformed sphere about the origin
(node by node, z and r), and one axial centre position for every rigid particle. Constraints
(`pairsim.fem.constraints`) say how x follows from the free unknowns and h.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from pairsim.fem.geometry import Outline, Reference
from pairsim.fem.moving_mesh import mesh_moves
from pairsim.fem.phases import Phase, neo_hookean_solid, newtonian_liquid, viscoelastic_liquid
from pairsim.fem.quadrature import CellQuadrature, end_load
from pairsim.fem.six_node_mesh import SixNodeMesh
from pairsim.physics.conformation import exponential
from pairsim.physics.materials.polymer import Polymer
from pairsim.physics.pipe import PipeState
from pairsim.physics.scales import FLOW_RATE, TUBE_RADIUS
from pairsim.runtime.arrays import Array, Indices
from pairsim.runtime.errors import MeshFailure
from pairsim.runtime.fenicsx import MPI

BoundaryVelocity = Callable[[Array], Array]


def poiseuille(points: Array) -> Array:
    """Fully developed Newtonian flow of unit mean velocity, (n, 2) -> (n, 2)."""
    return np.column_stack([2 * (1 - (points[:, 1] / TUBE_RADIUS) ** 2), np.zeros(len(points))])


@dataclass(frozen=True)
class LiquidNodes:
    """Nodes of the liquid's mesh on its boundaries.

    Attributes:
        axis, wall: Nodes with r = 0 and r = 1/2.
        inlet, outlet: Nodes of the ends, in ascending r, matching one another.
        interfaces: For each particle its outline from the downstream pole to the upstream one.
    """

    axis: Indices
    wall: Indices
    inlet: Indices
    outlet: Indices
    interfaces: tuple[Indices, ...]

    @staticmethod
    def find(mesh: SixNodeMesh, reference: Reference) -> LiquidNodes:
        z, r = mesh.points.T
        half = reference.geometry.length / 2

        def end(position: float) -> Indices:
            nodes = np.flatnonzero(np.abs(z - position) < 1e-9)
            return nodes[np.argsort(r[nodes])]

        inlet, outlet = end(-half), end(half)
        if len(inlet) != len(outlet) or not np.allclose(r[inlet], r[outlet], rtol=0.0, atol=1e-9):
            raise MeshFailure("the nodes of the two ends do not match")
        return LiquidNodes(
            np.flatnonzero(r < 1e-12),
            np.flatnonzero(r > TUBE_RADIUS - 1e-9),
            inlet,
            outlet,
            tuple(match(mesh.points, nodes) for nodes in reference.positions),
        )


def match(points: Array, wanted: Array) -> Indices:
    """Numbers of the points that coincide with the wanted positions.

    Raises:
        MeshFailure: A wanted position has no point.
    """
    distance, index = cKDTree(points).query(wanted)
    if distance.max() > 1e-9:
        raise MeshFailure(f"an outline node is {distance.max():.1e} away from the mesh")
    return np.asarray(index, dtype=np.int64)


@dataclass(frozen=True)
class Body:
    """One particle: rigid (phase is None) or soft, with the meaning of its part of h.

    Attributes:
        outline: Its cut half-circle.
        phase: Its inside, None when rigid.
        nodes: Nodes of its own mesh on the outline (empty when rigid).
        start: First index of its part of h.
    """

    outline: Outline
    phase: Phase | None
    nodes: Indices
    start: int

    @property
    def Ca_e(self) -> float:
        """Elastic capillary number that its form has now; 0 is rigid."""
        return 0.0 if self.phase is None else float(self.phase.constants["Ca_e"].value)

    @property
    def size(self) -> int:
        """Number of entries in h."""
        return 1 if self.phase is None else 2 * len(self.phase.six_node_mesh.points)

    @cached_property
    def quadrature(self) -> CellQuadrature:
        assert self.phase is not None
        return CellQuadrature(self.phase.six_node_mesh)

    def displacement(self, h: Array) -> Array:
        """Displacement of all nodes of a soft particle from the sphere about the origin, (n, 2)."""
        return h[self.start : self.start + self.size].reshape(-1, 2)

    def outline_points(self, h: Array) -> Array:
        """Current positions of the outline's nodes, downstream pole first, (n, 2)."""
        if self.phase is None:
            return self.outline.nodes + [h[self.start], 0.0]
        return self.outline.nodes + self.displacement(h)[self.nodes]


def make_bodies(
    comm: MPI.Comm,
    Ca_es: Sequence[float],
    outlines: Sequence[Outline],
    meshes: Sequence[SixNodeMesh | None],
) -> list[Body]:
    """The particles of a scene; meshes of rigid ones are not looked at."""
    bodies: list[Body] = []
    start = 0
    for Ca_e, outline, mesh in zip(Ca_es, outlines, meshes, strict=True):
        if Ca_e > 0:
            assert mesh is not None
            phase: Phase | None = Phase(comm, neo_hookean_solid(comm), mesh, {"Ca_e": Ca_e})
            nodes = match(mesh.points, outline.nodes)
        else:
            phase, nodes = None, np.empty(0, dtype=np.int64)
        bodies.append(Body(outline, phase, nodes, start))
        start += bodies[-1].size
    return bodies


class Scene:
    """Phases, boundaries and scalars of a case on one reference mesh of the liquid.

    Args:
        comm: Communicator of the case.
        reference: Reference domain of the liquid.
        mesh: Its mesh.
        bodies: The particles; they are shared by the scenes of successive remeshings.
        periodic: Periodic ends with an imposed flow rate, or a prescribed velocity on them.
        boundary_velocity: Velocity on wall and ends when they are prescribed.
        polymer: The viscoelastic part of the liquid, None for a Newtonian one; its De is where the scene begins.
        steady: Quasi-steady: the mesh's velocity is that of the particles, extended into the liquid.
    """

    def __init__(
        self,
        comm: MPI.Comm,
        reference: Reference,
        mesh: SixNodeMesh,
        bodies: Sequence[Body],
        *,
        periodic: bool,
        boundary_velocity: BoundaryVelocity = poiseuille,
        polymer: Polymer | None = None,
        steady: bool = False,
    ) -> None:
        self.comm, self.reference, self.bodies, self.periodic = comm, reference, list(bodies), periodic
        self.boundary_velocity = boundary_velocity
        self._polymer, self.steady = polymer, steady
        soft = any(body.phase is not None for body in self.bodies)
        self.moving = mesh_moves(len(self.bodies), soft=soft, viscoelastic=polymer is not None, steady=steady)
        if polymer is None:
            self.liquid = Phase(comm, newtonian_liquid(comm, self.moving), mesh)
        else:
            numbers = {k: getattr(polymer, k) for k in ("De", "xi", "alpha", "epsilon", "L2")}
            compiled = viscoelastic_liquid(comm, polymer.name, self.moving, steady)
            numbers |= {"rate": 0.0} if steady else {"g": 1.0, "U_m": 0.0}
            self.liquid = Phase(comm, compiled, mesh, numbers)
        self.nodes = LiquidNodes.find(mesh, reference)
        self.phases: list[Phase] = [self.liquid] + [b.phase for b in self.bodies if b.phase is not None]
        self.offsets = np.concatenate([[0], np.cumsum([phase.size for phase in self.phases])]).astype(np.int64)
        self.m = int(self.offsets[-1])
        self.dp = self.m + 1 if periodic else None
        self.size = self.m + (2 if periodic else 1)
        self.h_size = sum(body.size for body in self.bodies)

    @property
    def polymer(self) -> Polymer | None:
        """The viscoelastic part of the liquid with the De that its form has now, None for a Newtonian one."""
        return self._polymer and replace(self._polymer, De=float(self.liquid.constants["De"].value))

    def offset(self, phase: Phase) -> int:
        """Where a phase begins in the full vector."""
        return int(self.offsets[next(i for i, p in enumerate(self.phases) if p is phase)])

    def set(self, x: Array) -> None:
        """Hand the full vector to the phases."""
        for phase, a, b in zip(self.phases, self.offsets[:-1], self.offsets[1:], strict=True):
            phase.set(x[a:b])

    def prescribe(self, x: Array, nodes: Indices, flow: PipeState) -> None:
        """Give nodes of a viscoelastic liquid in a full vector u and s of a developed flow."""
        liquid = self.liquid
        u, *s = flow.profiles(liquid.six_node_mesh.points[nodes, 1])
        x[liquid.index("u", nodes, 0)] = u
        for c in range(4):
            x[liquid.index("s", nodes, c)] = s[c]

    def prescribe_ends(self, x: Array, flow: PipeState) -> None:
        """Give the ends of a viscoelastic liquid in a full vector u and s of a developed flow."""
        for nodes in (self.nodes.inlet, self.nodes.outlet):
            self.prescribe(x, nodes, flow)

    def set_step(self, star: Array, g: float, U_m: float) -> None:
        """Hand the liquid what the time scheme has fixed; only a viscoelastic one remembers anything."""
        if self.polymer is not None:
            self.liquid.set_star(star[: self.liquid.size])
            self.liquid.constants["g"].value = g
            self.liquid.constants["U_m"].value = U_m

    def positions(self, x: Array) -> Array:
        """Current positions of the liquid's nodes."""
        mesh = self.liquid.six_node_mesh
        return mesh.points + self.liquid.nodal("eta", x) if self.moving else mesh.points

    @cached_property
    def gauge(self) -> tuple[Indices, Array]:
        """Indices and weights of int p_f 2 pi r dX."""
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

    def linear_terms(self) -> tuple[Indices, Indices, Array]:
        """Rows, columns and values of the scalar couplings, which no form carries.

        Continuity gains m int q, its partner is mean(p_f) = 0; with periodic ends momentum loses dp int_inlet v_z
        (Eq. 9), and its partner is the flow rate (Eq. 14). Both pairs are symmetric.
        """
        index, weight = self.gauge
        m = np.full(len(index), self.m)
        rows, columns, values = [index, m], [m, index], [weight, weight]
        if self.dp is not None:
            index, weight = self.flow_rate
            dp = np.full(len(index), self.dp)
            rows += [index, dp]
            columns += [dp, index]
            values += [-weight, -weight]
        return np.concatenate(rows), np.concatenate(columns), np.concatenate(values)

    def load(self) -> Array:
        """Constant part of the residual: the imposed flow rate."""
        f = np.zeros(self.size)
        if self.dp is not None:
            f[self.dp] = FLOW_RATE
        return f

    def overstretched(self, x: Array) -> str:
        """In words, where a FENE-P liquid is past its pole."""
        polymer = self.polymer
        if polymer is None or polymer.name != "fene-p":
            return ""
        c = exponential(self.liquid.nodal("s", x))
        trace = c[:, 0] + c[:, 2] + c[:, 3]
        top = int(np.argmax(trace))
        largest: float = self.comm.bcast(float(trace[top]))
        if largest < polymer.L2:
            return ""
        z, r = self.comm.bcast(self.positions(x)[top].tolist())
        return f"tr c = {largest:.4g} at z = {z:.3f}, r = {r:.3f} is past L2 = {polymer.L2:g}"

    def pressure_drop(self, x: Array) -> float:
        """dp, the pressure drop over the tube's length."""
        index, weight = self.drop
        return float(weight @ x[index])
