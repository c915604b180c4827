"""Interpolation of solutions between meshes. Except for the stress, the results are first guesses only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pairsim.fem.algebra.constraints import Constraints
from pairsim.fem.meshes.interpolation import interpolate
from pairsim.fem.phases.phase import Phase
from pairsim.fem.scene import Body, Scene
from pairsim.runtime.arrays import Array


def carry_liquid(old: Scene, x: Array, scene: Scene, new: Array, shift: float = 0.0) -> Array:
    """Interpolate velocity, pressure and log-conformations of the liquid to another mesh.

    Args:
        old: Scene to interpolate from.
        x: Full vector of `old`, shape (n,).
        scene: The same scene on another mesh.
        new: Full vector of `scene` with the displacement of its mesh; the fields are written into it.
        shift: Axial translation of the particles relative to the old scene [D_c].

    Returns:
        The vector `new`.
    """
    values = [old.liquid.nodal("u", x), _pressure(old.liquid, x)]
    if scene.material.modes:
        values.append(old.liquid.nodal("s", x))
    places = scene.positions(new) - [shift, 0.0]
    reach = old.reference.geometry.length / 2
    places[:, 0] = np.clip(places[:, 0], -reach, reach)
    found, liquid = interpolate(old.liquid.six_node_mesh, old.positions(x), np.hstack(values), places), scene.liquid
    liquid.nodal("u", new)[:] = found[:, :2]
    liquid.nodal("p", new)[:] = found[liquid.six_node_mesh.vertices, 2:3]
    if scene.material.modes:
        liquid.nodal("s", new)[:] = found[:, 3:]
    return new


def _pressure(phase: Phase, x: Array) -> Array:
    """Pressure of a phase at all nodes, shape (nodes, 1), in a vector that begins with its canonical one."""
    mesh = phase.six_node_mesh
    p = np.zeros((len(mesh.points), 1))
    p[mesh.vertices] = phase.nodal("p", x)
    return np.asarray(p[mesh.parents].mean(axis=1))


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
        p = _pressure(before.phase, x[old.offset(before.phase) :])
        values = np.hstack([before.displacement(displaced), p])
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
