"""Constraints of each kind of problem: time-dependent, quasi-steady, extension of the mesh, and stress balance.

The notation is that of `pairsim.fem.constraints`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse

from pairsim.fem import mesh_velocity
from pairsim.fem.constraints import Constraints, Triplets, Unknowns
from pairsim.fem.geometry import Outline
from pairsim.fem.scene import Body, Scene
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


def _constrain_velocity(
    scene: Scene,
    y: Unknowns,
    N: Triplets,
    rows: Triplets,
    V: sparse.csr_matrix,
    balance: sparse.csr_matrix,
    base: Array,
) -> None:
    """Constrain the velocity of the liquid on axis, wall, ends and interfaces.

    Args:
        scene: The scene.
        y: Numbering of the free unknowns; extended.
        N: Direct part of the map; extended.
        rows: Restriction of the residual; extended.
        V: Velocity of the particles' material as a function of y, shape (n_h, n_y).
        balance: Equation to which the momentum at each material position is added, shape (n_h, n_y).
        base: Constant part of the full vector; changed.
    """
    liquid, nodes = scene.liquid, scene.nodes
    outer, interface = _boundary(scene)
    count = len(outer)
    fixed = np.zeros((count, 2), dtype=bool)
    fixed[nodes.axis, 1] = True
    fixed[interface] = True
    if scene.periodic:
        fixed[nodes.wall] = True
        fixed[nodes.outlet] = True
    else:
        fixed[outer] = True
        at = np.flatnonzero(outer)
        velocity = scene.boundary_velocity(liquid.six_node_mesh.points[at])
        for c in range(2):
            base[liquid.index("u", at, c)] = velocity[:, c]
        base[liquid.index("u", nodes.axis, 1)] = 0.0
    number = np.full((count, 2), -1)
    number[~fixed] = y.take("u", int(np.count_nonzero(~fixed)))
    for c in range(2):
        free = np.flatnonzero(~fixed[:, c])
        N.add(liquid.index("u", free, c), number[free, c])
        rows.add(number[free, c], liquid.index("u", free, c))
        if scene.periodic:
            inlet, outlet = nodes.inlet, nodes.outlet
            tied = number[inlet, c] >= 0
            N.add(liquid.index("u", outlet[tied], c), number[inlet[tied], c])
            rows.add(number[inlet[tied], c], liquid.index("u", outlet[tied], c))
    for body, at in zip(scene.bodies, nodes.interfaces, strict=True):
        for c, index in enumerate(_interface(body)):
            if index is None:
                continue
            moved, tested = V[index].tocoo(), balance[index].tocoo()
            N.add(liquid.index("u", at[moved.row], c), moved.col, moved.data)
            rows.add(tested.col, liquid.index("u", at[tested.row], c), tested.data)


def _constrain_conformation(scene: Scene, y: Unknowns, N: Triplets, rows: Triplets) -> None:
    """Constrain the log-conformation: equal at both periodic ends, that of the developed flow at prescribed ends."""
    liquid, nodes = scene.liquid, scene.nodes
    given = nodes.outlet if scene.periodic else np.concatenate([nodes.inlet, nodes.outlet])
    carriers = liquid.carriers("s")
    free = carriers[~np.isin(carriers, given)]
    carried = np.isin(nodes.inlet, carriers)
    inlet, outlet = nodes.inlet[carried], nodes.outlet[carried]
    for c in range(4 * len(scene.material.modes)):
        number = np.full(len(liquid.six_node_mesh.points), -1)
        number[free] = y.take("s", len(free))
        index = liquid.index("s", free, c)
        N.add(index, number[free])
        rows.add(number[free], index)
        if scene.periodic:
            index = liquid.index("s", outlet, c)
            N.add(index, number[inlet])
            rows.add(number[inlet], index)


def _constrain_mesh(scene: Scene, y: Unknowns, N: Triplets, C: Triplets, rows: Triplets, base: Array) -> None:
    """Constrain the displacement of the liquid's mesh: P2 in the layer of cells at the interfaces, P1 elsewhere.

    It is zero on wall and ends. At a strongly curved interface, cells with straight inner sides would be inverted.
    Elsewhere P1 suffices, with far fewer unknowns: the displacement inside the liquid is arbitrary, and only that of
    the interfaces is physical.
    """
    liquid, nodes, mesh = scene.liquid, scene.nodes, scene.liquid.six_node_mesh
    outer, interface = _boundary(scene)
    count = len(outer)
    vertex = np.zeros(count, dtype=bool)
    vertex[mesh.vertices] = True
    number = np.full((count, 2), -1)
    own = vertex | interface
    own[mesh.cells[interface[mesh.cells[:, :3]].any(axis=1)]] = True
    free = np.repeat((own & ~outer & ~interface)[:, None], 2, axis=1)
    free[nodes.axis, 1] = False
    number[free] = y.take("eta", int(np.count_nonzero(free)))
    on_h = np.full((count, 2), -1)
    offset = np.zeros((count, 2))
    for body, at in zip(scene.bodies, nodes.interfaces, strict=True):
        offset[at] = body.outline.nodes - mesh.points[at]
        for c, index in enumerate(_interface(body)):
            if index is not None:
                on_h[at, c] = index
    for c in range(2):
        # A node has its own displacement or the mean of those of the two vertices of its side.
        self_parent = np.arange(count)
        parents = np.where(own[:, None], np.column_stack([self_parent, self_parent]), mesh.parents)
        for parent in parents.T:
            full = liquid.index("eta", self_parent, c)
            k = number[parent, c] >= 0
            N.add(full[k], number[parent[k], c], 0.5)
            rows.add(number[parent[k], c], full[k], 0.5)
            k = on_h[parent, c] >= 0
            C.add(full[k], on_h[parent[k], c], 0.5)
            np.add.at(base, full, 0.5 * offset[parent, c])


def transient_constraints(scene: Scene) -> Constraints:
    """Constraints of a time-dependent problem.

    The unknowns of a soft particle are the velocities of its nodes, from which the time scheme gives the displacements.
    At the interface the momentum equations of liquid and solid are added (continuity of traction). A rigid particle has
    one unknown, its velocity U_p, whose equation is the sum of the momentum equations on its surface (force balance).
    """
    y = Unknowns()
    N, C, M, rows = Triplets(), Triplets(), Triplets(), Triplets()
    base = np.zeros(scene.size)
    a = np.zeros(scene.h_size)
    integrated: list[Indices] = []
    for body in scene.bodies:
        if body.phase is None:
            M.add(np.array([body.start]), y.take("U_p", 1))
            a[body.start] = 1.0
            continue
        offset, mesh = scene.offset(body.phase), body.phase.six_node_mesh
        points = np.arange(len(mesh.points))
        for c in range(2):
            h = body.start + 2 * points + c
            eta = offset + body.phase.index("eta", points, c)
            C.add(eta, h)
            free = points if c == 0 else points[mesh.points[:, 1] > 1e-12]
            velocity = y.take("v", len(free))
            M.add(h[free], velocity)
            rows.add(velocity, eta[free])
            if c == 0:
                a[h] = 1.0
        p = offset + body.phase.index("p", mesh.vertices)
        unknown = y.take("p_s", len(p))
        N.add(p, unknown)
        rows.add(unknown, p)
        integrated.append(unknown)
    material = M.matrix((scene.h_size, y.size))
    _constrain_velocity(scene, y, N, rows, material, material, base)
    return _finished(scene, y, N, C, M, M, rows, base, a, integrated)


def balance_constraints(scene: Scene, x: Array) -> Constraints:
    """Constraints with velocity, pressure and stress of the liquid as unknowns, in the fixed configuration of x.

    The positions of particles and mesh do not change. The unknowns of soft particles are the velocities of their
    surfaces, in whose momentum equations the elastic traction is constant.

    Args:
        scene: A viscoelastic scene in time.
        x: Full vector, shape (n,).
    """
    y = Unknowns()
    N, V, rows = Triplets(), Triplets(), Triplets()
    for body in scene.bodies:
        if body.phase is None:
            V.add(np.array([body.start]), y.take("U_p", 1))
            continue
        offset, points = scene.offset(body.phase), body.phase.six_node_mesh.points
        for c in range(2):
            free = body.nodes if c == 0 else body.nodes[points[body.nodes, 1] > 1e-12]
            velocity = y.take("v", len(free))
            V.add(body.start + 2 * free + c, velocity)
            rows.add(velocity, offset + body.phase.index("eta", free, c))
    material = V.matrix((scene.h_size, y.size))
    _constrain_velocity(scene, y, N, rows, material, material, np.zeros(scene.size))
    _constrain_pressure(scene, y, N, rows)
    _constrain_conformation(scene, y, N, rows)
    _constrain_scalars(scene, y, N, rows)
    direct, still = N.matrix((scene.size, y.size)), sparse.csr_matrix((scene.h_size, y.size))
    return Constraints(
        np.where(np.diff(direct.indptr) > 0, 0.0, x),
        direct,
        sparse.csr_matrix((scene.size, scene.h_size)),
        still,
        np.zeros(scene.h_size),
        rows.matrix((y.size, scene.size)),
        np.zeros(y.size, dtype=bool),
        y.fields,
        V.matrix((scene.h_size, y.size)),
    )


def _constrain_pressure(scene: Scene, y: Unknowns, N: Triplets, rows: Triplets) -> None:
    """Add the pressure of the liquid, which is not constrained."""
    p = scene.liquid.index("p", scene.liquid.six_node_mesh.vertices)
    unknown = y.take("p_f", len(p))
    N.add(p, unknown)
    rows.add(unknown, p)


def _constrain_scalars(scene: Scene, y: Unknowns, N: Triplets, rows: Triplets) -> None:
    """Add the multiplier m of the zero mean pressure, the pressure drop dp of periodic ends and prescribed forces F."""
    for name, index in (("m", [scene.m]), ("dp", [] if scene.dp is None else [scene.dp]), ("F", scene.F)):
        if len(index):
            unknown = y.take(name, len(index))
            N.add(np.asarray(index), unknown)
            rows.add(unknown, np.asarray(index))


def _finished(
    scene: Scene,
    y: Unknowns,
    N: Triplets,
    C: Triplets,
    M: Triplets,
    V: Triplets,
    rows: Triplets,
    base: Array,
    a: Array,
    integrated: list[Indices],
) -> Constraints:
    """Add the constraints of the liquid that all problems have in common, and assemble the matrices."""
    _constrain_pressure(scene, y, N, rows)
    if scene.material.modes:
        _constrain_conformation(scene, y, N, rows)
    if scene.moving:
        _constrain_mesh(scene, y, N, C, rows, base)
    _constrain_scalars(scene, y, N, rows)
    divided = np.zeros(y.size, dtype=bool)
    for unknown in integrated:
        divided[unknown] = True
    return Constraints(
        base,
        N.matrix((scene.size, y.size)),
        C.matrix((scene.size, scene.h_size)),
        M.matrix((scene.h_size, y.size)),
        a,
        rows.matrix((y.size, scene.size)),
        divided,
        y.fields,
        V.matrix((scene.h_size, y.size)),
    )


def steady_constraints(scene: Scene) -> Constraints:
    """Constraints of a quasi-steady scene: each particle translates without deforming, with an unknown velocity U_i.

    The unknowns of a soft particle are the displacements of its nodes (h = h* + M y, that is g = 1 and U_m = 0). Its
    axial position is prescribed: the upstream pole of particle i+1 is displaced by as much as the downstream pole of
    particle i, and the downstream pole of particle 1 is fixed. The momentum equations of all nodes are kept; U_i
    replaces the unknown that this removes.

    Args:
        scene: A quasi-steady scene.
    """
    y = Unknowns()
    N, C, M, V, rows, balance = (Triplets() for _ in range(6))
    base = np.zeros(scene.size)
    a = np.zeros(scene.h_size)
    integrated: list[Indices] = []
    pole = -1  # unknown of the downstream pole of the previous particle; -1 if it is fixed
    U = y.take("U_p", len(scene.bodies))
    for i, body in enumerate(scene.bodies):
        if body.phase is None:
            at = np.array([body.start])
            V.add(at, U[i])
            balance.add(at, U[i])
            a[body.start] = 1.0
            if pole >= 0:
                M.add(at, np.array([pole]))
            continue
        offset, mesh = scene.offset(body.phase), body.phase.six_node_mesh
        points = np.arange(len(mesh.points))
        held = int(body.nodes[-1] if i else body.nodes[0])
        for c in range(2):
            h = body.start + 2 * points + c
            eta = offset + body.phase.index("eta", points, c)
            C.add(eta, h)
            free = points if c == 0 else points[mesh.points[:, 1] > 1e-12]
            row = np.empty(len(free), dtype=np.int64)
            own = free != held if c == 0 else np.ones(len(free), dtype=bool)
            unknown = y.take("h", int(np.count_nonzero(own)))
            row[own] = unknown
            M.add(h[free[own]], unknown)
            if c == 0:
                row[~own] = U[i]
                a[h] = 1.0
                V.add(h, U[i])
                if pole >= 0:
                    M.add(h[[held]], np.array([pole]))
                pole = int(row[np.flatnonzero(free == body.nodes[0])[0]]) if i else -1
            rows.add(row, eta[free])
            balance.add(h[free], row)
        p = offset + body.phase.index("p", mesh.vertices)
        unknown = y.take("p_s", len(p))
        N.add(p, unknown)
        rows.add(unknown, p)
        integrated.append(unknown)
    size = (scene.h_size, y.size)
    _constrain_velocity(scene, y, N, rows, V.matrix(size), balance.matrix(size), base)
    if scene.material.modes:
        liquid = scene.liquid
        vertices = liquid.six_node_mesh.vertices
        z = liquid.six_node_mesh.points[vertices, 0]
        for velocity, share in zip(U, mesh_velocity.shares(scene.reference, z, scene.periodic), strict=True):
            at = np.flatnonzero(share)
            N.add(liquid.index("w", vertices[at], 0), velocity, share[at])
    return _finished(scene, y, N, C, M, V, rows, base, a, integrated)


def steady_base(scene: Scene, size: float) -> Array:
    """Constant part of the constraints of a quasi-steady scene with all diameters multiplied by `size`, shape (n,)."""
    bodies = scene.bodies
    scene.bodies = [replace(body, outline=Outline(body.outline.radius * size, body.outline.angles)) for body in bodies]
    try:
        return steady_constraints(scene).base
    finally:
        scene.bodies = bodies


def extension_constraints(scene: Scene) -> Constraints:
    """Constraints with the displacement of the liquid's mesh as only unknown, for given positions of the material."""
    y = Unknowns()
    N, C, rows = Triplets(), Triplets(), Triplets()
    base = np.zeros(scene.size)
    _constrain_mesh(scene, y, N, C, rows, base)
    empty = sparse.csr_matrix((scene.h_size, y.size))
    return Constraints(
        base,
        N.matrix((scene.size, y.size)),
        C.matrix((scene.size, scene.h_size)),
        empty,
        np.zeros(scene.h_size),
        rows.matrix((y.size, scene.size)),
        np.zeros(y.size, dtype=bool),
        y.fields,
        empty,
    )
