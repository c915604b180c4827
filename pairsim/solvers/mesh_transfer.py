"""Interpolation of solutions between meshes. Except for the transported fields of a liquid, these are first guesses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pairsim.fem.algebra.constraints import Constraints
from pairsim.fem.body import Body
from pairsim.fem.meshes.interpolation import interpolate
from pairsim.fem.scene import Scene
from pairsim.physics.fields import PRESSURE_OF_SOLID
from pairsim.runtime.arrays import Array


def carry_liquid(old: Scene, x: Array, scene: Scene, new: Array, shift: float = 0.0) -> Array:
    """Interpolate those fields of the liquid to another mesh that do not follow from others there (`Field.carried`).

    Args:
        old: Scene to interpolate from.
        x: Full vector of `old`, shape (n,).
        scene: The same scene on another mesh.
        new: Full vector of `scene` that holds the displacement of its mesh, shape (n,); it is changed in place.
        shift: Axial translation of the particles relative to the old scene [D_c].

    Returns:
        The vector `new`.
    """
    fields = [field for field in scene.liquid.fields if field.carried]
    values = [old.liquid.at_nodes(field.name, x) for field in fields]
    places = scene.positions(new) - [shift, 0.0]
    reach = old.reference.geometry.length / 2
    places[:, 0] = np.clip(places[:, 0], -reach, reach)
    found, liquid = interpolate(old.liquid.six_node_mesh, old.positions(x), np.hstack(values), places), scene.liquid
    ends = np.cumsum([field.components for field in fields])
    for field, part in zip(fields, np.split(found, ends[:-1], axis=1), strict=True):
        liquid.nodal(field.name, new)[:] = part[liquid.carriers(field.name)]
    return new


def carry_particles(old: Scene, x: Array, displaced: Array, bodies: Sequence[Body]) -> tuple[Array, Array]:
    """Interpolate displacements and pressures inside the particles to other meshes of the particles.

    Args:
        old: Scene to interpolate from.
        x: Full vector of `old`, shape (n,).
        displaced: Displacements of all material in the old scene, in the numbering of h.
        bodies: The particles on the meshes to interpolate to.

    Returns:
        Displacements in the numbering of h on these meshes, with one axial displacement for each rigid particle, and
        the pressures at the vertices of all soft particles.
    """
    displacements, pressures = [np.empty(0)], [np.empty(0)]
    for before, body in zip(old.bodies, bodies, strict=True):
        if body.phase is None or before.phase is None:
            displacements.append(displaced[before.start : before.start + before.size])
            continue
        mesh, wanted = before.phase.six_node_mesh, body.phase.six_node_mesh
        p = before.phase.at_nodes(PRESSURE_OF_SOLID.name, x[old.offset(before.phase) :])
        values = np.hstack([before.displacement(displaced), p])
        found = interpolate(mesh, mesh.points, values, wanted.points)
        displacements.append(found[:, :2].ravel())
        pressures.append(found[wanted.vertices, 2])
    return np.concatenate(displacements), np.concatenate(pressures)


def free_unknowns(scene: Scene, constraints: Constraints, x: Array) -> Array:
    """Extract the free unknowns of the liquid's fields from a full vector; all other unknowns are zero.

    Args:
        scene: The scene.
        constraints: Its constraints.
        x: Full vector, shape (n,).

    Returns:
        Free unknowns, shape (n_y,).
    """
    y = np.zeros(constraints.size)
    columns = constraints.N.tocsc()
    for field in scene.liquid.fields:
        unknowns = constraints.fields.get(field.unknowns, np.empty(0, int))
        entry = columns[:, unknowns].tocoo()
        own = entry.data == 1.0  # mid-side nodes with a P1 displacement depend on an unknown by the factor 1/2
        y[unknowns[entry.col[own]]] = x[entry.row[own]]
    return y
