"""Compute the fields of one frame of fields.xdmf from a solution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse.linalg import splu

from pairsim.fem.body import Body
from pairsim.fem.meshes.quadrature import assembled
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.fem.scene import Scene
from pairsim.fem.unyielded import law_fields
from pairsim.physics.conformation import polymer_stress, trace
from pairsim.physics.pipe import PipeState, across
from pairsim.record.xdmf import FieldFrame
from pairsim.runtime.arrays import Array
from pairsim.solvers.stepping.step import Step

if TYPE_CHECKING:
    from pairsim.solvers.steady.scene import SteadySolver


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
    mass, load = assembled(local, mesh.cells, len(mesh.points)), np.zeros((len(mesh.points), 4))
    np.add.at(load, mesh.cells, np.einsum("mq,qa,mqs->mas", w, shapes, stress))
    return np.asarray(splu(mass.tocsc()).solve(load))


@dataclass(frozen=True)
class SteadyMoment:
    """A quasi-steady solution with the attributes of a time step that `frame` needs.

    `t` is the number by which the frame is found, such as the distance [D_c].
    """

    t: float
    scene: Scene
    x: Array
    h: Array
    velocity: Array


def frame(step: Step | SteadyMoment, origin: Array, flow: PipeState) -> FieldFrame:
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

    eta = vector("eta") if scene.moving else np.zeros_like(mesh.points)
    here = mesh.points + eta
    p = _at_nodes(step.x[liquid.index("p", mesh.vertices)], mesh)
    parts = [(here, vector("u"), eta, np.zeros((len(nodes), 4)), p)]
    cells, region = [mesh.cells], [np.zeros(len(mesh.cells), dtype=np.int64)]
    for number, body in enumerate(scene.bodies, 1):
        if body.phase is None:
            continue
        inside = body.phase.six_node_mesh
        cells.append(inside.cells + sum(len(part[0]) for part in parts))
        region.append(np.full(len(inside.cells), number))
        p_inside = _at_nodes(step.x[scene.offset(body.phase) + body.phase.index("p", inside.vertices)], inside)
        moved, u = body.displacement(step.h), body.displacement(step.velocity)
        parts.append(
            (inside.points + moved, u, moved - body.displacement(origin), elastic_stress(body, step.h), p_inside)
        )
    points, *stacked = map(np.concatenate, zip(*parts, strict=True))
    data = dict(zip(("velocity", "displacement", "tau_s", "pressure"), stacked, strict=True))
    if not scene.moving:
        del data["displacement"]
    if len(parts) == 1:
        del data["tau_s"]
    fields = {"pressure_extra": p - across(flow.r, flow.p, here[:, 1]) + flow.gradient * here[:, 0]}
    if scene.material.modes:
        c = scene.conformations(step.x)
        tau = polymer_stress(scene.material, c)
        alone = polymer_stress(scene.material, across(flow.r, flow.c, here[:, 1]))
        fields |= {"tr_c": trace(c).max(axis=1), "tau_p": tau, "tau_p_zz_extra": (tau - alone)[:, 0]}
    fields |= {name: mesh.at_nodes(values) for name, values in law_fields(scene, step.x).items()}
    for name, values in fields.items():  # of the liquid; 0 in particles
        data[name] = np.zeros((len(points), *values.shape[1:]))
        data[name][: len(nodes)] = values
    return FieldFrame(step.t, points, np.vstack(cells), np.concatenate(region), data)


def steady_frame(t: float, solver: SteadySolver) -> FieldFrame:
    """All fields of the present quasi-steady solution.

    Args:
        t: The number by which the frame is found, such as the distance d [D_c].
        solver: The scene, at its solution.
    """
    (h, x), flow = solver.state(), solver.developed_flow
    moment = SteadyMoment(t, solver.scene, x, h, solver.constraints.V @ solver.y)
    return frame(moment, solver.h_star(solver.parameters), flow)


def _at_nodes(values: Array, mesh: SixNodeMesh) -> Array:
    """Values at all nodes of a mesh from those at its vertices: a node amid a side has the mean of its two ends."""
    p = np.zeros(len(mesh.parents))
    p[mesh.vertices] = values
    return np.asarray(p[mesh.parents].mean(axis=1))
