"""The pressure drop read off inside the tube, as a functional whose adjoint is smooth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pairsim.fem.meshes.quadrature import CellQuadrature
from pairsim.runtime.arrays import Array
from pairsim.solvers.solution import Solution

# Length of tube over which the pressure is averaged at each end [D_c]: averages over less vary more with the cells.
AVERAGED = 1.0
# The same as a part of the free length there, at most. With half of it the particles are too near in tubes of the usual
# length, by 1.8e-4 in a power law (docs/explanation/error-estimate.md).
MOST_AVERAGED = 0.25


@dataclass(frozen=True)
class InnerDrop:
    """Pressure drop from averages over a length of tube at both ends, where the flow is the developed one.

    On the ends themselves pressure follows the prescribed stress: what is read there converges with the size of the
    cells only, and the adjoint of such a reading is not smooth. The average is weighted with a polynomial that vanishes
    with its slope at both sides of that length.

    Attributes:
        value: The pressure drop over the length of the tube [eta_0 U_av/D_c].
        apart: Distance between the places of the averages [D_c].
        row: Its derivative by the full vector, without that by the displacement of the mesh, (n,).
    """

    value: float
    apart: float
    row: Array

    @staticmethod
    def of(solution: Solution) -> InnerDrop:
        """Read off a solution; in an infinite tube it is that between the same two cross-sections."""
        scene, x = solution.scene, solution.x
        mesh, positions = scene.liquid.six_node_mesh, scene.positions(x)
        quadrature, length = CellQuadrature(mesh), scene.reference.geometry.length
        over = min(AVERAGED, MOST_AVERAGED * solution.free)
        z = np.einsum("qa,ma->mq", quadrature.shapes, positions[mesh.cells, 0], optimize=True)
        weights, total, apart = quadrature.weights(positions), np.zeros(len(mesh.vertices)), 0.0
        for downstream in (-1.0, 1.0):
            t = np.clip((length / 2 - downstream * z) / over, 0.0, 1.0)
            averaged = weights * t**2 * (1 - t) ** 2
            averaged /= averaged.sum() or np.nan  # of a diverged estimate, which may have no cells there
            total -= downstream * quadrature.integrals(averaged)
            apart += downstream * float((averaged * z).sum())
        index = scene.liquid.index("p", mesh.vertices)
        rest = solution.gradient * (length - apart)
        row = np.zeros(scene.size)
        row[index] = total
        return InnerDrop(float(total @ x[index]) + rest, apart, row)
