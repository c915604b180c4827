"""Unyielded regions of a liquid with a yield stress: the stress in cells, and bridges between particles."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pairsim.fem.meshes.six_node_mesh import SixNodeMesh, shape_gradients, shape_values
from pairsim.fem.recovery.viscosity_scatter import StrainRates
from pairsim.fem.scene import Scene
from pairsim.physics.conformation import exponential, magnitude
from pairsim.physics.liquids.viscous import LEAST_RATE, ViscousLaw
from pairsim.quantities.scales import TUBE_RADIUS
from pairsim.runtime.arrays import Array

DEGREE = 4  # of the quadrature of the square of the shear rate; chosen


def law_fields(scene: Scene, x: Array) -> dict[str, Array]:
    """The fields that the law with a yield stress adds, by name, one value for each cell, shape (m,) each.

    The stress of a cell is that at the root mean square of its shear rate for a viscosity law, and that at the mean of
    log c at its nodes for a polymer.

    Args:
        scene: The scene.
        x: Full vector, shape (n,).
    """
    cells, law = scene.liquid.six_node_mesh.cells, scene.material.plastic
    if not law.fields:
        return {}
    rates = StrainRates(
        SixNodeMesh(scene.positions(x), cells), DEGREE, lambda at: (shape_values(at), shape_gradients(at))
    )
    gamma2 = 2 * (rates.of(scene.liquid.nodal("u", x)[cells]) ** 2).sum(axis=-1)
    gamma2 = np.average(gamma2, axis=1, weights=rates.volumes) + LEAST_RATE**2
    rate = np.sqrt(gamma2)
    if isinstance(law, ViscousLaw):
        tau = rate * law.viscosity(gamma2)
    else:
        tau = magnitude(scene.material, exponential(scene.log_conformations(x)[cells].mean(axis=1)))
    # A field with a contour level has it at the yield surface; a yield stress of 0 has none.
    wanted = {name: field for name, field in law.fields.items() if law.yield_stress or field.level is None}
    return {name: field.value(law, tau, rate) for name, field in wanted.items()}


def bridges(scene: Scene, x: Array, h: Array) -> Array:
    """Radius of the cylinder around the axis in which no liquid yields between neighbouring particles [D_c], (N-1,).

    It is 0 if liquid on the axis between them yields, and in liquids without a yield stress.

    Args:
        scene: The scene.
        x: Full vector, shape (n,).
        h: Positions of the material, shape (n_h,).
    """
    if not scene.material.plastic.yield_stress:
        return np.zeros(max(len(scene.bodies) - 1, 0))
    cells = scene.positions(x)[scene.liquid.six_node_mesh.cells[:, :3]]
    z, inner = cells[..., 0].mean(axis=1), cells[..., 1].min(axis=1)
    yields = law_fields(scene, x)["yielding"] >= 1
    middles = [float(body.outline_points(h)[[0, -1], 0].mean()) for body in scene.bodies]
    return np.array([inner[yields & (a < z) & (z < b)].min(initial=TUBE_RADIUS) for a, b in pairwise(middles)])
