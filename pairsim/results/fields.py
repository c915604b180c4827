"""Compute the fields of one frame of fields.xdmf from a solution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from pairsim.fem.scene import Body, Scene
from pairsim.physics.conformation import exponential, polymer_stress, trace
from pairsim.physics.pipe import PipeState, across
from pairsim.results.xdmf import FieldFrame
from pairsim.runtime.arrays import Array, Indices


def elastic_stress(body: Body, h: Array) -> Array:
    """Elastic stress of a soft particle at the nodes of its mesh.

    It is projected (L2) onto the continuous quadratic elements, so that the hoop stretch R/r is only evaluated at
    quadrature points and needs no limit on the axis.

    Args:
        body: The soft particle.
        h: Positions of the material [D_c], shape (n_h,).

    Returns:
        Components zz, zr, rr, tt [eta_0 U_av/D_c], shape (n, 4).
    """
    assert body.phase is not None
    mesh, quadrature = body.phase.six_node_mesh, body.quadrature
    gradients, shapes = quadrature.gradients, quadrature.shapes
    F = np.einsum("mqak,mai->mqik", gradients, (mesh.points + body.displacement(h))[mesh.cells])
    radius = [
        np.einsum("qa,ma->mq", shapes, p[mesh.cells, 1]) for p in (mesh.points, mesh.points + body.displacement(h))
    ]
    B = np.einsum("mqik,mqjk->mqij", F, F)
    hoop = (radius[1] / radius[0]) ** 2
    solid = body.phase.material
    stress = np.stack(solid.stress((B[..., 0, 0], B[..., 0, 1], B[..., 1, 1], hoop)), axis=-1)
    w = quadrature.weights(mesh.points)
    local = np.einsum("mq,qa,qb->mab", w, shapes, shapes)
    row, column = np.repeat(mesh.cells, 6, axis=1), np.tile(mesh.cells, (1, 6))
    n = len(mesh.points)
    mass = sparse.csc_matrix(sparse.coo_matrix((local.ravel(), (row.ravel(), column.ravel())), shape=(n, n)))
    load = np.zeros((n, 4))
    np.add.at(load, mesh.cells, np.einsum("mq,qa,mqs->mas", w, shapes, stress))
    return np.asarray(splu(mass).solve(load))


class Moment(Protocol):
    """A solution: an accepted time step, or a quasi-steady solution (whose `t` is the distance d)."""

    @property
    def t(self) -> float: ...
    @property
    def scene(self) -> Scene: ...
    @property
    def mesh_id(self) -> int: ...
    @property
    def x(self) -> Array: ...
    @property
    def h(self) -> Array: ...
    @property
    def velocity(self) -> Array: ...


@dataclass(frozen=True)
class SteadyMoment:
    """A quasi-steady solution as a `Moment`, with the attributes of a time step."""

    t: float
    scene: Scene
    mesh_id: int
    x: Array
    h: Array
    velocity: Array


def frame(step: Moment, origin: Array, flow: PipeState) -> FieldFrame:
    """All fields of a solution on the deformed mesh, in the frame that moves with the particles.

    Args:
        step: The solution.
        origin: Positions h of the undeformed material [D_c], from which displacements are measured, shape (n_h,).
        flow: The flow without particles at this time, for the perturbation fields (Figs. 14 and 15 of the paper).
    """
    scene = step.scene
    liquid, mesh = scene.liquid, scene.liquid.six_node_mesh
    nodes = np.arange(len(mesh.points))

    def vector(name: str) -> Array:
        return np.column_stack([step.x[liquid.index(name, nodes, c)] for c in range(2)])

    def pressure(values: Array, parents: Indices, vertices: Indices) -> Array:
        p = np.zeros(len(parents))
        p[vertices] = values
        return np.asarray(p[parents].mean(axis=1))

    eta = vector("eta") if scene.moving else np.zeros_like(mesh.points)
    points, cells = [mesh.points + eta], [mesh.cells]
    region = [np.zeros(len(mesh.cells), dtype=np.int64)]
    velocity, displacement, stress = [vector("u")], [eta], [np.zeros((len(nodes), 4))]
    p = [pressure(step.x[liquid.index("p", mesh.vertices)], mesh.parents, mesh.vertices)]
    soft = False
    start = len(nodes)
    for number, body in enumerate(scene.bodies, 1):
        if body.phase is None:
            continue
        soft = True
        inside = body.phase.six_node_mesh
        values = step.x[scene.offset(body.phase) + body.phase.index("p", inside.vertices)]
        points.append(inside.points + body.displacement(step.h))
        cells.append(inside.cells + start)
        region.append(np.full(len(inside.cells), number))
        velocity.append(body.displacement(step.velocity))
        displacement.append(body.displacement(step.h) - body.displacement(origin))
        stress.append(elastic_stress(body, step.h))
        p.append(pressure(values, inside.parents, inside.vertices))
        start += len(inside.points)
    data = {"velocity": np.vstack(velocity), "pressure": np.concatenate(p)}
    if scene.moving:
        data["displacement"] = np.vstack(displacement)
    if soft:
        data["tau_s"] = np.vstack(stress)
    here, rest = points[0], start - len(nodes)
    alone = across(flow.r, flow.p, here[:, 1]) - flow.gradient * here[:, 0]
    data["pressure_extra"] = np.concatenate([p[0] - alone, np.zeros(rest)])
    if scene.material.modes:
        c = exponential(liquid.nodal("s", step.x))
        tau = polymer_stress(scene.material, c)
        stress_alone = polymer_stress(scene.material, across(flow.r, flow.c, here[:, 1]))
        data["tr_c"] = np.concatenate([trace(c).max(axis=1), np.zeros(rest)])
        data["tau_p"] = np.vstack([tau, np.zeros((rest, 4))])
        data["tau_p_zz_extra"] = np.concatenate([(tau - stress_alone)[:, 0], np.zeros(rest)])
    return FieldFrame(step.t, step.mesh_id, np.vstack(points), np.vstack(cells), np.concatenate(region), data)
