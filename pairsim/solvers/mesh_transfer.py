"""Interpolation of solutions between meshes. Except for the stress, the results are first guesses only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pairsim.fem.constraints import Constraints
from pairsim.fem.interpolation import interpolate
from pairsim.fem.scene import Body, Scene
from pairsim.runtime.arrays import Array


def carry_liquid(old: Scene, x: Array, scene: Scene, new: Array, shift: float = 0.0) -> Array:
    """Interpolate velocity, pressure and log-conformation of the liquid to another mesh.

    Args:
        old: Scene to interpolate from.
        x: Full vector of `old`, shape (n,).
        scene: The same scene on another mesh.
        new: Full vector of `scene` with the displacement of its mesh; the fields are written into it.
        shift: Axial translation of the particles relative to the old scene [D_c].

    Returns:
        The vector `new`.
    """
    places = scene.positions(new) - [shift, 0.0]
    reach = old.reference.geometry.length / 2
    places[:, 0] = np.clip(places[:, 0], -reach, reach)
    fields = ("u", "p") if scene.polymer is None else ("u", "p", "s")
    return _interpolated(old, x, old.positions(x), fields, scene, places, new)


def carry_reference(old: Scene, x: Array, scene: Scene) -> Array:
    """Interpolate all fields of the liquid to another mesh of the same reference domain.

    Args:
        old: Scene to interpolate from.
        x: Full vector of `old`, shape (n,).
        scene: The same scene on the other mesh.

    Returns:
        Full vector of `scene`.
    """
    fields = ("u", "p", "eta") if scene.polymer is None else ("u", "p", "eta", "s")
    places, new = scene.liquid.six_node_mesh.points, np.zeros(scene.size)
    return _interpolated(old, x, old.liquid.six_node_mesh.points, fields, scene, places, new)


def _interpolated(
    old: Scene, x: Array, positions: Array, fields: Sequence[str], scene: Scene, places: Array, new: Array
) -> Array:
    """Write into `new` fields of the liquid, interpolated from an old mesh at positions (n, 2) to places (m, 2)."""
    mesh, liquid = old.liquid.six_node_mesh, scene.liquid
    values = []
    for name in fields:
        if name == "p":
            p = np.zeros(len(mesh.points))
            p[mesh.vertices] = x[old.liquid.index(name, mesh.vertices)]
            values.append(p[mesh.parents].mean(axis=1)[:, None])
        else:
            values.append(old.liquid.nodal(name, x))
    found = interpolate(mesh, positions, np.hstack(values), places)
    starts = np.cumsum([0, *(part.shape[1] for part in values)])
    for name, start, end in zip(fields, starts[:-1], starts[1:], strict=True):
        nodes = liquid.carriers(name)
        for c in range(end - start):
            new[liquid.index(name, nodes, c)] = found[nodes, start + c]
    return new


def carry_particles(old: Scene, x: Array, displaced: Array, bodies: Sequence[Body]) -> tuple[Array, Array]:
    """Interpolate displacements and pressures inside the particles to other meshes of the particles.

    Args:
        old: Scene to interpolate from.
        x: Full vector of `old`, shape (n,).
        displaced: Displacements of all material in the old scene, in the numbering of h.
        bodies: The particles on the other meshes.

    Returns:
        Displacements in the numbering of h of the other meshes, with one axial displacement for a rigid particle, and
        the pressures at the vertices of all soft particles.
    """
    displacements, pressures = [np.empty(0)], [np.empty(0)]
    for before, body in zip(old.bodies, bodies, strict=True):
        if body.phase is None or before.phase is None:
            displacements.append(displaced[before.start : before.start + before.size])
            continue
        mesh, wanted = before.phase.six_node_mesh, body.phase.six_node_mesh
        p = np.zeros(len(mesh.points))
        p[mesh.vertices] = x[old.offset(before.phase) + before.phase.index("p", mesh.vertices)]
        values = np.column_stack([before.displacement(displaced), p[mesh.parents].mean(axis=1)])
        found = interpolate(mesh, mesh.points, values, wanted.points)
        displacements.append(found[:, :2].ravel())
        pressures.append(found[wanted.vertices, 2])
    return np.concatenate(displacements), np.concatenate(pressures)


def free_unknowns(constraints: Constraints, x: Array) -> Array:
    """Extract the free unknowns of the liquid from a full vector; the other unknowns are set to zero.

    Args:
        constraints: Constraints of the scene.
        x: Full vector, shape (n,).

    Returns:
        Free unknowns, shape (n_y,).
    """
    y = np.zeros(constraints.size)
    columns = constraints.N.tocsc()
    for name in ("u", "p_f", "s", "eta"):
        unknowns = constraints.fields.get(name, np.empty(0, int))
        entry = columns[:, unknowns].tocoo()
        own = entry.data == 1.0  # mid-side nodes with a P1 displacement depend on an unknown by the factor 1/2
        y[unknowns[entry.col[own]]] = x[entry.row[own]]
    return y
