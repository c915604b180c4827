"""Effects of the error of a solution on a viscosity that depends on the shear rate, beyond first order.

An error estimate linearises the stress in the error of the strain rate e. Where e nearly vanishes, the viscosity of a
thinning liquid varies strongly within a cell, and the stress is far from linear: at points on the axis and between two
particles, and on rings of a particle's surface where the shear changes sign. With the recovered strain rate e+ a cell
contributes

    int [sigma(e+) - sigma(e) - sigma'(e)(e+ - e)] : e(z)

to a functional with the weight z. The signs of these contributions are random, and the root of the sum of their squares
is the size to expect of their sum.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import basix
import numpy as np

from pairsim.fem.meshes.six_node_mesh import SixNodeMesh, shape_gradients, shape_values
from pairsim.fem.recovery.enriched_nodes import own_shapes, tabulated
from pairsim.fem.recovery.enriched_residual import EnrichedResidual
from pairsim.fem.recovery.enriched_scene import EnrichedScene
from pairsim.physics.liquids.viscous import LEAST_RATE, ViscousLaw
from pairsim.runtime.arrays import Array

DEGREE = 6  # of the quadrature; chosen
# Slopes are evaluated at the square of the shear rate plus this fraction of the square of its change; chosen.
SMOOTHED = 0.25
# Relative change of the shear rate above which terms beyond first order count. Where it changes by less they are those
# of a smooth field, which cancel from cell to cell as contributions of first order do.
LEAST_CHANGE = 0.1
SMALLEST = 1e-300  # in place of a stress of 0
IMAGINARY = 1e-30j  # complex step; it causes no cancellation


def viscosity_scatter[R: EnrichedResidual](enriched: EnrichedScene[R], x: Array, weights: Array) -> Array:
    """Contributions beyond first order of the cells of a liquid without modes, in the order of its mesh, (k, m).

    Args:
        enriched: The scene.
        x: The solution as a full vector, (n,).
        weights: Weights of k functionals as full vectors, (k, n).
    """
    liquid, scene = enriched.liquid, enriched.scene
    solution, (of_liquid, *of_solids) = enriched.parts(x)[0], enriched.parts(weights)
    recovered, added = (liquid.added(each, ["u"])["u"] for each in (solution[None], of_liquid))
    # On the surface of a particle the exact velocity is that of the particle, as the discrete one is.
    enriched.join(recovered, (np.zeros((each.nodes[3].count, 1, 2)) for each in enriched.solids))
    enriched.join(added, (s.added(w, ["eta"])["eta"] for s, w in zip(enriched.solids, of_solids, strict=True)))
    for at in (enriched.wall, enriched.inlet, enriched.outlet):
        recovered[at] = added[at] = 0.0
    cells, nodes, own = liquid.phase.six_node_mesh.cells, liquid.nodes[3].numbers, own_shapes(3)

    def in_cells(vector: Array) -> Array:
        return np.einsum("qa,mac->mqc", own, liquid.phase.nodal("u", vector)[cells])

    rates = StrainRates(SixNodeMesh(scene.positions(x), cells), DEGREE, partial(tabulated, 3))
    e, more = rates.of(in_cells(solution)), rates.of(recovered[nodes, 0])
    left = rates.volumes[..., None] * _beyond_first_order(scene.material.solvent, e, more)
    found = np.empty((len(weights), len(cells)))
    for k, weight in enumerate(of_liquid):
        found[k] = np.einsum("mqc,mqc->m", left, rates.of(in_cells(weight) + added[nodes, k]))
    if scene.reference.mirrored:
        # The contributions of a cell and of its mirror image are added, as they mostly cancel in a relative velocity,
        # and each is given half the square of the sum. The second half of the cells are the images of the first.
        halves = found.reshape(len(found), 2, -1)
        found = ((halves + halves[:, ::-1]) / 2**0.5).reshape(found.shape)
    return found


def _beyond_first_order(law: ViscousLaw, e: Array, more: Array) -> Array:
    """The stress at e + more, less the stress at e and its change to first order in `more`, (..., 4).

    It is 0 where the shear rate changes by less than `LEAST_CHANGE`, and in a liquid with a yield stress no larger than
    the whole change.
    """

    def viscosity(gamma2: Any) -> Any:
        return law.viscosity(gamma2 + LEAST_RATE**2)

    gamma2, changed = 2 * (e**2).sum(axis=-1), 2 * ((e + more) ** 2).sum(axis=-1)
    # The slope at a shear rate that is nearly zero says nothing about a change to larger ones.
    smooth = gamma2 + SMOOTHED * 2 * (more**2).sum(axis=-1)
    slope = 4 * (e * more).sum(axis=-1) * viscosity(smooth + IMAGINARY).imag / IMAGINARY.imag
    linear = viscosity(smooth)[..., None] * more + slope[..., None] * e
    change = 2 * (viscosity(changed)[..., None] * (e + more) - viscosity(gamma2)[..., None] * e)
    left = change - 2 * linear
    counts = 2 * (more**2).sum(axis=-1) > LEAST_CHANGE**2 * gamma2
    if law.yield_stress:
        # Below the yield stress a linearised change is several times the whole change, which is bounded.
        sizes = [np.sqrt((each**2).sum(axis=-1)) for each in (change, left)]
        counts = counts * np.minimum(1.0, sizes[0] / np.maximum(sizes[1], SMALLEST))
    return np.asarray(left * counts[..., None])


class StrainRates:
    """Strain rates of velocities at the quadrature points of the m cells of a mesh.

    Args:
        mesh: The mesh, at the present positions of its nodes.
        degree: Degree of the quadrature.
        shapes: The a shape functions of velocities at points of the reference triangle, and their gradients.

    Attributes:
        volumes: Weights of volume integrals, (m, q).
    """

    def __init__(self, mesh: SixNodeMesh, degree: int, shapes: Callable[[Array], tuple[Array, Array]]) -> None:
        points, weights = basix.make_quadrature(basix.CellType.triangle, degree)
        x = mesh.points[mesh.cells]
        dx = np.einsum("qak,mai->mqik", shape_gradients(points), x, optimize=True)
        self._values, self._gradients = shapes(points)
        self._inverse = np.linalg.inv(dx)
        self._radius = np.einsum("qa,ma->mq", shape_values(points), x[..., 1], optimize=True)
        self.volumes: Array = 2 * np.pi * self._radius * np.linalg.det(dx) * weights

    def of(self, u: Array) -> Array:
        """Strain rates as four components, scaled so that e : e' is the sum of products of components, (m, q, 4).

        Args:
            u: Values at the nodes of the cells, (m, a, 2).
        """
        gradient = np.einsum("qak,mai->mqik", self._gradients, u, optimize=True) @ self._inverse
        hoop = np.einsum("qa,ma->mq", self._values, u[..., 1], optimize=True) / self._radius
        shear = (gradient[..., 0, 1] + gradient[..., 1, 0]) / 2**0.5
        return np.stack([gradient[..., 0, 0], gradient[..., 1, 1], hoop, shear], axis=-1)
