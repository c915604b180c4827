"""The pressure drop read inside the tube, whose adjoint is smooth, and what the tube beyond the ends would add."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pairsim.fem.meshes.quadrature import CellQuadrature
from pairsim.runtime.arrays import Array, Indices
from pairsim.solvers.solution import Solution

# Length of tube over which the pressure is averaged at each end [D_c]: averages over less vary more with the cells.
AVERAGED = 1.0
# The same as a part of the free length there, at most. With half of it the particles are too near in tubes of the usual
# length, by 1.8e-4 in a power law (docs/explanation/error-estimate.md).
MOST_AVERAGED = 0.25
# Distances of three readings from each other, over the length of their averages; chosen.
APART = 0.5
# Largest part of a perturbation that is left from one reading to the next, as far as it is told from no decay; chosen.
MOST_LEFT = 0.9


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
        scene, ends, total, apart = solution.scene, _Ends(solution), 0.0, 0.0
        row = np.zeros(scene.size)
        for downstream in (-1.0, 1.0):
            average = ends.average(downstream)
            row[average.index] -= downstream * average.weights
            total -= downstream * average.value
            apart += downstream * average.z
        rest = solution.gradient * (scene.reference.geometry.length - apart)
        return InnerDrop(total + rest, apart, row)


def beyond_the_ends(solution: Solution) -> float:
    """Magnitude of what an infinite tube would add to the pressure drop outside the ends [eta_0 U_av/D_c].

    Polymer that has been strained at a particle relaxes along the tube, and changes the pressure as long as it does. At
    each end three readings tell by which part that falls over a length, and so the sum of what follows. Where it does
    not fall there is no perturbation to be seen. A periodic tube has no outside.
    """
    if solution.scene.periodic:
        return 0.0
    ends = _Ends(solution)
    return sum(_beyond(ends, solution.gradient, downstream) for downstream in (-1.0, 1.0))


def _beyond(ends: _Ends, gradient: float, downstream: float) -> float:
    """The same beyond one end: downstream 1, upstream -1 [eta_0 U_av/D_c]."""
    found = [ends.average(downstream, inwards) for inwards in (0.0, APART, 2 * APART)]
    readings = [average.value + gradient * average.z for average in found]
    last, before = (nearer - farther for nearer, farther in pairwise(readings))
    left = last / before if before else 0.0
    return abs(last) * min(left, MOST_LEFT) / (1 - min(left, MOST_LEFT)) if 0 < left < 1 else 0.0


@dataclass(frozen=True)
class _Average:
    """A weighted average of the pressure over a length of tube.

    Attributes:
        value: The average [eta_0 U_av/D_c].
        z: Where it is, the same average of the position [D_c].
        index: The unknowns that it is an average of, (k,).
        weights: Their weights, (k,).
    """

    value: float
    z: float
    index: Indices
    weights: Array


class _Ends:
    """The lengths of tube near both ends of a solution over which its pressure is averaged.

    The weight of an average vanishes at both ends of its length.
    """

    def __init__(self, solution: Solution) -> None:
        scene = solution.scene
        mesh, positions = scene.liquid.six_node_mesh, scene.positions(solution.x)
        self._quadrature, self._half = CellQuadrature(mesh), scene.reference.geometry.length / 2
        self._over = min(AVERAGED, MOST_AVERAGED * solution.free)
        self._z = np.einsum("qa,ma->mq", self._quadrature.shapes, positions[mesh.cells, 0], optimize=True)
        self._weights = self._quadrature.weights(positions)
        self._index = scene.liquid.index("p", mesh.vertices)
        self._p = solution.x[self._index]

    def average(self, downstream: float, inwards: float = 0.0) -> _Average:
        """The average at one end.

        Args:
            downstream: 1 for the downstream end, -1 for the upstream one.
            inwards: How far it is moved inwards, as a part of the length over which it is taken.
        """
        t = np.clip((self._half - downstream * self._z) / self._over - inwards, 0.0, 1.0)
        averaged = self._weights * t**2 * (1 - t) ** 2
        averaged /= averaged.sum() or np.nan  # of a diverged estimate, which may have no cells there
        of_vertices = self._quadrature.integrals(averaged)
        return _Average(float(of_vertices @ self._p), float((averaged * self._z).sum()), self._index, of_vertices)
