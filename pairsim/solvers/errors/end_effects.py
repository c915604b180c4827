"""Effect of the finite length of the tube on the functionals of a quasi-steady solution.

At prescribed ends the flow is the developed one, and at periodic ends it is the same at both; in an infinite tube it
would contain the rest of the particles' perturbation. As an upper estimate of that rest, the perturbation found at some
distance inside the tube is added at the ends. This changes the residual, which the adjoints turn into changes of the
functionals. A period of an infinite row has no ends.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pairsim.fem.meshes.interpolation import interpolate
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.physics.fields import VELOCITY
from pairsim.physics.poiseuille import poiseuille
from pairsim.quantities.scales import FLOW_RATE
from pairsim.runtime.arrays import Array, Indices
from pairsim.solvers.steady.scene import SteadySolver

# Distances from the ends at which the perturbation is evaluated [D_c]. It oscillates along the tube, and there are two
# in case one of them meets a zero. How good the estimate is: docs/explanation/error-estimate.md.
INSIDE = (0.25, 0.5)


def end_effects(steady: SteadySolver, adjoints: Array, residual: Array) -> Array:
    """Changes of functionals when the perturbation that is found inside the tube is added at its ends.

    Args:
        steady: The solution.
        adjoints: Adjoint solutions of the functionals, (k, n_y).
        residual: The residual of the solution, (n_y,).

    Returns:
        The changes for each of the distances `INSIDE`, (2, k).
    """
    scene, x = steady.scene, steady.state()[1]
    if scene.reference.geometry.closed:
        return np.zeros((len(INSIDE), len(adjoints)))
    liquid, nodes = scene.liquid, scene.nodes
    mesh, fields = liquid.six_node_mesh, [VELOCITY, *scene.material.transported]
    values, positions = np.hstack([liquid.nodal(field.name, x) for field in fields]), scene.positions(x)
    parts = np.cumsum([field.components for field in fields])[:-1]
    # In a periodic tube inlet and outlet share their fields: the perturbation is a single jump between them.
    ends = [(nodes.outlet, -1.0)] if scene.periodic else [(nodes.inlet, 1.0), (nodes.outlet, -1.0)]
    places = [mesh.points[at] + [inwards * inside, 0.0] for inside in INSIDE for at, inwards in ends]
    inner = iter(_on_planes(mesh, positions, values, places))
    changes = []
    for _ in INSIDE:
        moved = x.copy()
        for at, _ in ends:
            found = next(inner) - _developed(steady, at)
            mean = (scene.scalar_terms.flow_rate[1] @ found[:, 0]) / FLOW_RATE
            found[:, 0] -= mean * poiseuille(mesh.points[at])[:, 0]
            for field, added in zip(fields, np.split(found, parts, axis=1), strict=True):
                liquid.nodal(field.name, moved)[at] += added  # a view
        changes.append(-adjoints @ (steady.newton.reduce(moved) - residual))
    return np.array(changes)


def _on_planes(mesh: SixNodeMesh, positions: Array, values: Array, places: Sequence[Array]) -> list[Array]:
    """Interpolate P2 fields to points on several cross-sections; only the cells there are searched.

    Args:
        mesh: Mesh of the liquid.
        positions: Current positions of its nodes, (nodes, 2).
        values: Nodal values, (nodes, components).
        places: Points of each cross-section, (k, 2).

    Returns:
        Values at the points of each cross-section, (k, components).
    """
    z, tolerance = positions[mesh.cells, 0], 1e-9
    low, high = z.min(axis=1) - tolerance, z.max(axis=1) + tolerance
    there = np.any([(low <= plane[0, 0]) & (plane[0, 0] <= high) for plane in places], axis=0)
    nodes, cells = np.unique(mesh.cells[there], return_inverse=True)
    part = SixNodeMesh(mesh.points[nodes], cells.reshape(-1, mesh.cells.shape[1]))
    found = interpolate(part, positions[nodes], values[nodes], np.concatenate(places))
    return np.split(found, np.cumsum([len(plane) for plane in places])[:-1])


def _developed(steady: SteadySolver, nodes: Indices) -> Array:
    """Velocity and transported fields of the flow without particles at given nodes, (n, components)."""
    points = steady.scene.liquid.six_node_mesh.points[nodes]
    if steady.scene.material.newtonian:
        return steady.scene.boundary_velocity(points)
    profiles = steady.developed_flow.profiles(points[:, 1])
    carried = [profiles[field.name] for field in steady.scene.material.transported]
    return np.column_stack([profiles[VELOCITY.name], np.zeros(len(points)), *carried])
