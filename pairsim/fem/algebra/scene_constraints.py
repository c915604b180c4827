"""Constraints of each kind of problem: time-dependent, quasi-steady, extension of the mesh, and stress balance.

The notation is that of `pairsim.fem.algebra.constraints`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pairsim.fem.algebra import mesh_velocity
from pairsim.fem.algebra.constraints import Constraints, Triplets, Unknowns
from pairsim.fem.body import Body
from pairsim.fem.meshes.geometry import Outline
from pairsim.fem.scene import Scene
from pairsim.physics.fields import DISPLACEMENT, MESH_VELOCITY, PRESSURE, PRESSURE_OF_SOLID, VELOCITY, Field
from pairsim.runtime.arrays import Array, Indices


def _interface(body: Body) -> tuple[Indices, Indices | None]:
    """Indices in h of the axial and radial positions of the outline's nodes; None for the radii of a rigid particle."""
    if body.phase is None:
        return np.full(len(body.outline.nodes), body.start), None
    return body.start + 2 * body.nodes, body.start + 2 * body.nodes + 1


def _boundary(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Masks of the liquid's nodes on wall and ends, and of those on interfaces."""
    count = len(scene.liquid.six_node_mesh.points)
    outer, interface = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    for nodes in (scene.nodes.wall, scene.nodes.inlet, scene.nodes.outlet):
        outer[nodes] = True
    for nodes in scene.nodes.interfaces:
        interface[nodes] = True
    return outer, interface


class _Builder:
    """Builder of `Constraints`, field by field.

    Args:
        scene: The scene.

    Attributes:
        y: Numbering of the free unknowns so far.
        N, C, M, V, rows, base, a: Entries so far of the parts of `Constraints`; `rows` has those of T.
        integrated: Equations that are divided by g.
        lower: Indices in x of the pressures at the outlet of a closed row, which are dp below those at the inlet.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene, self.y = scene, Unknowns()
        self.N, self.C, self.M, self.V, self.rows = (Triplets() for _ in range(5))
        self.base, self.a = np.zeros(scene.size), np.zeros(scene.h_size)
        self.integrated: list[Indices] = []
        self.lower: Indices = np.empty(0, dtype=np.int64)

    def velocity(self, balance: Triplets | None = None) -> None:
        """Constrain the velocity of the liquid on axis, wall, ends and interfaces.

        Args:
            balance: Equation to which the liquid's momentum at each material position is added; by default the equation
                of the velocity of that position.
        """
        scene = self.scene
        size = scene.h_size, self.y.size
        V = self.V.matrix(size)
        tests = V if balance is None else balance.matrix(size)
        liquid, nodes = scene.liquid, scene.nodes
        outer, interface = _boundary(scene)
        count = len(outer)
        fixed = np.zeros((count, 2), dtype=bool)
        fixed[np.ix_(nodes.axis, VELOCITY.odd)] = True
        fixed[interface] = True
        if scene.periodic:
            fixed[nodes.wall] = True
            fixed[nodes.outlet] = True
        else:
            fixed[outer] = True
            prescribed = liquid.nodal("u", self.base)
            prescribed[outer] = scene.boundary_velocity(liquid.six_node_mesh.points[outer])
            prescribed[nodes.axis, 1] = 0.0
        number = np.full((count, 2), -1)
        number[~fixed] = self.y.take("u", int(np.count_nonzero(~fixed)))
        for c in range(2):
            free = np.flatnonzero(~fixed[:, c])
            self.N.add(liquid.index("u", free, c), number[free, c])
            self.rows.add(number[free, c], liquid.index("u", free, c))
            if scene.periodic:
                inlet, outlet = nodes.inlet, nodes.outlet
                tied = number[inlet, c] >= 0
                self.N.add(liquid.index("u", outlet[tied], c), number[inlet[tied], c])
                self.rows.add(number[inlet[tied], c], liquid.index("u", outlet[tied], c))
        for body, at in zip(scene.bodies, nodes.interfaces, strict=True):
            for c, index in enumerate(_interface(body)):
                if index is None:
                    continue
                moved, tested = V[index].tocoo(), tests[index].tocoo()
                self.N.add(liquid.index("u", at[moved.row], c), moved.col, moved.data)
                self.rows.add(tested.col, liquid.index("u", at[tested.row], c), tested.data)

    def pressure(self) -> None:
        """Add the pressure of the liquid, unconstrained except in a closed row, between whose ends it drops by dp."""
        liquid, nodes = self.scene.liquid, self.scene.nodes
        vertices, closed = liquid.six_node_mesh.vertices, self.scene.reference.geometry.closed
        inlet, outlet = (nodes.inlet[::2], nodes.outlet[::2]) if closed else (nodes.inlet[:0],) * 2
        free = vertices[~np.isin(vertices, outlet)]
        number = np.full(len(liquid.six_node_mesh.points), -1)
        number[free] = self.y.take(PRESSURE.unknowns, len(free))
        number[outlet] = number[inlet]
        p = liquid.index("p", vertices)
        self.N.add(p, number[vertices])
        self.rows.add(number[vertices], p)
        self.lower = liquid.index("p", outlet)

    def transported(self) -> None:
        """Constrain the transported fields: equal at periodic ends, and otherwise those of developed flow there."""
        for field in self.scene.material.transported:
            self._transported(field)

    def _transported(self, field: Field) -> None:
        scene = self.scene
        liquid, nodes = scene.liquid, scene.nodes
        given = nodes.outlet if scene.periodic else np.concatenate([nodes.inlet, nodes.outlet])
        carriers = liquid.carriers(field.name)
        free = carriers[~np.isin(carriers, given)]
        carried = np.isin(nodes.inlet, carriers)
        inlet, outlet = nodes.inlet[carried], nodes.outlet[carried]
        for c in range(field.components):
            number = np.full(len(liquid.six_node_mesh.points), -1)
            number[free] = self.y.take(field.unknowns, len(free))
            index = liquid.index(field.name, free, c)
            self.N.add(index, number[free])
            self.rows.add(number[free], index)
            if scene.periodic:
                index = liquid.index(field.name, outlet, c)
                self.N.add(index, number[inlet])
                self.rows.add(number[inlet], index)

    def displacement(self) -> None:
        """Constrain the displacement of the liquid's mesh: P2 in the layer of cells at the interfaces, P1 elsewhere.

        It is zero on wall and ends, and on planes of the reference domain. P2 is needed at strongly curved interfaces,
        where cells with straight inner sides would be inverted. Elsewhere P1 suffices, with far fewer unknowns: only
        the displacement of the interfaces is physical, that inside the liquid is arbitrary.
        """
        scene = self.scene
        liquid, nodes, mesh = scene.liquid, scene.nodes, scene.liquid.six_node_mesh
        outer, interface = _boundary(scene)
        for plane in nodes.planes:
            outer[plane] = True
        count = len(outer)
        vertex = np.zeros(count, dtype=bool)
        vertex[mesh.vertices] = True
        number = np.full((count, 2), -1)
        own = vertex | interface
        own[mesh.cells[interface[mesh.cells[:, :3]].any(axis=1)]] = True
        free = np.repeat((own & ~outer & ~interface)[:, None], 2, axis=1)
        free[np.ix_(nodes.axis, DISPLACEMENT.odd)] = False
        number[free] = self.y.take("eta", int(np.count_nonzero(free)))
        on_h = np.full((count, 2), -1)
        offset = np.zeros((count, 2))
        for body, at in zip(scene.bodies, nodes.interfaces, strict=True):
            offset[at] = body.outline.nodes - mesh.points[at]
            for c, index in enumerate(_interface(body)):
                if index is not None:
                    on_h[at, c] = index
        for c in range(2):
            # A node has a displacement of its own, or the mean of those of the two vertices of the side it lies on.
            self_parent = np.arange(count)
            parents = np.where(own[:, None], np.column_stack([self_parent, self_parent]), mesh.parents)
            for parent in parents.T:
                full = liquid.index("eta", self_parent, c)
                k = number[parent, c] >= 0
                self.N.add(full[k], number[parent[k], c], 0.5)
                self.rows.add(number[parent[k], c], full[k], 0.5)
                k = on_h[parent, c] >= 0
                self.C.add(full[k], on_h[parent[k], c], 0.5)
                np.add.at(self.base, full, 0.5 * offset[parent, c])

    def scalars(self) -> None:
        """Add the multiplier m of the zero mean pressure, the pressure drop dp of periodic ends, and forces F."""
        scene = self.scene
        for name, index in (("m", [scene.m]), ("dp", [] if scene.dp is None else [scene.dp]), ("F", scene.F)):
            if len(index):
                unknown = self.y.take(name, len(index))
                self.N.add(np.asarray(index), unknown)
                self.rows.add(unknown, np.asarray(index))
                if name == "dp":
                    self.N.add(self.lower, unknown, -1.0)

    def solid_pressure(self, body: Body) -> None:
        """Add the pressure of a soft particle, which is not constrained."""
        assert body.phase is not None
        p = self.scene.offset(body.phase) + body.phase.index("p", body.phase.six_node_mesh.vertices)
        unknown = self.y.take(PRESSURE_OF_SOLID.unknowns, len(p))
        self.N.add(p, unknown)
        self.rows.add(unknown, p)
        self.integrated.append(unknown)

    def rest_of_liquid(self) -> None:
        """Add the other fields of the liquid, whose constraints time-dependent and quasi-steady problems share."""
        self.pressure()
        self.transported()
        if self.scene.moving:
            self.displacement()
        self.scalars()

    def finished(self) -> Constraints:
        """Assemble the matrices."""
        scene, count = self.scene, self.y.size
        divided = np.zeros(count, dtype=bool)
        for unknown in self.integrated:
            divided[unknown] = True
        return Constraints(
            self.base,
            self.N.matrix((scene.size, count)),
            self.C.matrix((scene.size, scene.h_size)),
            self.M.matrix((scene.h_size, count)),
            self.a,
            self.rows.matrix((count, scene.size)),
            divided,
            self.y.fields,
            self.V.matrix((scene.h_size, count)),
        )


def transient_constraints(scene: Scene) -> Constraints:
    """Constraints of a time-dependent problem.

    The unknowns of a soft particle are the velocities of its nodes, from which the time scheme gives the displacements.
    At the interface the momentum equations of liquid and solid are added (continuity of traction). A rigid particle has
    one unknown, its velocity U_p, whose equation is the sum of the momentum equations on its surface (force balance).
    """
    made = _Builder(scene)
    made.V = made.M  # the time scheme integrates the velocity of the material
    for body in scene.bodies:
        if body.phase is None:
            made.M.add(np.array([body.start]), made.y.take("U_p", 1))
            made.a[body.start] = 1.0
            continue
        offset, mesh = scene.offset(body.phase), body.phase.six_node_mesh
        points = np.arange(len(mesh.points))
        for c in range(2):
            h = body.start + 2 * points + c
            eta = offset + body.phase.index("eta", points, c)
            made.C.add(eta, h)
            free = points if c == 0 else points[mesh.points[:, 1] > 1e-12]
            velocity = made.y.take("v", len(free))
            made.M.add(h[free], velocity)
            made.rows.add(velocity, eta[free])
            if c == 0:
                made.a[h] = 1.0
        made.solid_pressure(body)
    made.velocity()
    made.rest_of_liquid()
    return made.finished()


def balance_constraints(scene: Scene, x: Array) -> Constraints:
    """Constraints with velocity, pressure and stress of the liquid as unknowns, in the fixed configuration of x.

    The positions of particles and mesh do not change. The unknowns of soft particles are the velocities of their
    surfaces, in whose momentum equations the elastic traction is constant.

    Args:
        scene: A time-dependent scene with a viscoelastic liquid.
        x: Full vector, shape (n,).
    """
    made = _Builder(scene)
    for body in scene.bodies:
        if body.phase is None:
            made.V.add(np.array([body.start]), made.y.take("U_p", 1))
            continue
        offset, points = scene.offset(body.phase), body.phase.six_node_mesh.points
        for c in range(2):
            free = body.nodes if c == 0 else body.nodes[points[body.nodes, 1] > 1e-12]
            velocity = made.y.take("v", len(free))
            made.V.add(body.start + 2 * free + c, velocity)
            made.rows.add(velocity, offset + body.phase.index("eta", free, c))
    made.velocity()
    made.pressure()
    made.transported()
    made.scalars()
    found = made.finished()
    return replace(found, base=np.where(np.diff(found.N.indptr) > 0, 0.0, x))


def steady_constraints(scene: Scene) -> Constraints:
    """Constraints of a quasi-steady scene: each particle translates without deforming, with an unknown velocity U_i.

    The unknowns of a soft particle are the displacements of its nodes (h = h* + M y, that is g = 1 and U_m = 0). Its
    axial position is prescribed: the upstream pole of particle i+1 is displaced by as much as the downstream pole of
    particle i, and the downstream pole of particle 1 is fixed. This removes one unknown, which U_i replaces, as the
    momentum equations of all nodes are kept.

    Args:
        scene: A quasi-steady scene.
    """
    made, balance = _Builder(scene), Triplets()
    pole = -1  # unknown of the downstream pole of the previous particle; -1 if it is fixed
    U = made.y.take("U_p", len(scene.bodies))
    for i, body in enumerate(scene.bodies):
        if body.phase is None:
            at = np.array([body.start])
            made.V.add(at, U[i])
            balance.add(at, U[i])
            made.a[body.start] = 1.0
            if pole >= 0:
                made.M.add(at, np.array([pole]))
            continue
        offset, mesh = scene.offset(body.phase), body.phase.six_node_mesh
        points = np.arange(len(mesh.points))
        fixed = int(body.nodes[-1] if i else body.nodes[0])
        for c in range(2):
            h = body.start + 2 * points + c
            eta = offset + body.phase.index("eta", points, c)
            made.C.add(eta, h)
            free = points if c == 0 else points[mesh.points[:, 1] > 1e-12]
            row = np.empty(len(free), dtype=np.int64)
            own = free != fixed if c == 0 else np.ones(len(free), dtype=bool)
            unknown = made.y.take("h", int(np.count_nonzero(own)))
            row[own] = unknown
            made.M.add(h[free[own]], unknown)
            if c == 0:
                row[~own] = U[i]
                made.a[h] = 1.0
                made.V.add(h, U[i])
                if pole >= 0:
                    made.M.add(h[[fixed]], np.array([pole]))
                pole = int(row[np.flatnonzero(free == body.nodes[0])[0]]) if i else -1
            made.rows.add(row, eta[free])
            balance.add(h[free], row)
        made.solid_pressure(body)
    made.velocity(balance)
    if MESH_VELOCITY in scene.liquid.fields:
        liquid = scene.liquid
        vertices = liquid.six_node_mesh.vertices
        z = liquid.six_node_mesh.points[vertices, 0]
        for velocity, share in zip(U, mesh_velocity.shares(scene.reference, z, scene.periodic), strict=True):
            at = np.flatnonzero(share)
            made.N.add(liquid.index(MESH_VELOCITY.name, vertices[at], 0), velocity, share[at])
    made.rest_of_liquid()
    return made.finished()


def steady_base(scene: Scene, sizes: Sequence[float]) -> Array:
    """Constant part of the constraints of a quasi-steady scene with diameters multiplied by `sizes`, shape (n,)."""
    bodies = scene.bodies
    scene.bodies = [
        replace(body, outline=Outline(body.outline.radius * size, body.outline.angles))
        for body, size in zip(bodies, sizes, strict=True)
    ]
    try:
        return steady_constraints(scene).base
    finally:
        scene.bodies = bodies


def extension_constraints(scene: Scene) -> Constraints:
    """Constraints with the displacement of the liquid's mesh as only unknown, for given positions of the material."""
    made = _Builder(scene)
    made.displacement()
    return made.finished()
