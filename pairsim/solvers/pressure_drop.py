"""The pressure drop evaluated inside the tube, whose adjoint is smooth, and what the tube beyond its ends would add."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pairsim.fem.meshes.quadrature import CellQuadrature
from pairsim.runtime.arrays import Array, Indices
from pairsim.solvers.solution import Solution

# Length of tube over which the pressure is averaged at each end [D_c]: averages over less vary more with the cells.
AVERAGED = 1.0
# Largest such length relative to the free length between end and particles. With 0.5 the average reaches too near to
# the particles in tubes of the usual length, which costs 1.8e-4 in a power law (docs/explanation/error-estimate.md).
MOST_AVERAGED = 0.25
# Distance between successive averages, relative to the length over which they are taken; chosen.
APART = 0.5
# Upper bound on the factor by which a perturbation decays from one average to the next, as no decay at all would give
# an infinite sum; chosen.
MOST_LEFT = 0.9


@dataclass(frozen=True)
class InnerDrop:
    """Pressure drop from averages over a length of tube near both ends, where the flow is developed.

    On the ends themselves the pressure follows from the prescribed fields: values there converge only with the first
    power of the cell size, and their adjoint is not smooth. The averages are weighted with a polynomial that vanishes,
    together with its slope, at both sides of their length.

    Attributes:
        value: The pressure drop over the length of the tube [eta_0 U_av/D_c].
        apart: Distance between the centres of the two averages [D_c].
        row: Its derivative with respect to the full vector, at a fixed displacement of the mesh, (n,).
    """

    value: float
    apart: float
    row: Array

    @staticmethod
    def of(solution: Solution) -> InnerDrop:
        """Evaluate a solution: the drop between the averages, plus that of developed flow in the rest of the tube."""
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

    Polymer that has been strained at a particle relaxes along the tube, and changes the pressure until it has. Three
    averages near each end give two successive changes, whose ratio is taken as that of a geometric series of all
    further ones. Where the changes do not decay, or have different signs, a tube may be so short that the ends disturb
    the relaxation: the sum of their magnitudes is then taken. It is 0 in a liquid without a memory, and in a periodic
    tube, which has no outside.
    """
    if solution.scene.periodic:
        return 0.0
    ends = _Ends(solution)
    return sum(_beyond(ends, solution.gradient, downstream) for downstream in (-1.0, 1.0))


def _beyond(ends: _Ends, gradient: float, downstream: float) -> float:
    """The same beyond one end, the outlet for `downstream` = 1 and the inlet for -1 [eta_0 U_av/D_c]."""
    found = [ends.average(downstream, inwards) for inwards in (0.0, APART, 2 * APART)]
    readings = [average.value + gradient * average.z for average in found]
    last, before = (nearer - farther for nearer, farther in pairwise(readings))
    left = last / before if before else 0.0
    if 0 < left < 1:
        return abs(last) * min(left, MOST_LEFT) / (1 - min(left, MOST_LEFT))
    return abs(last) + abs(before) if ends.remember else 0.0


@dataclass(frozen=True)
class _Average:
    """A weighted average of the pressure over a length of tube.

    Attributes:
        value: The average [eta_0 U_av/D_c].
        z: The average of the axial position with the same weights [D_c].
        index: Indices of the averaged pressures in the full vector, (k,).
        weights: Their weights, (k,).
    """

    value: float
    z: float
    index: Indices
    weights: Array


class _Ends:
    """Averages of the pressure of a solution over lengths of tube near both ends."""

    def __init__(self, solution: Solution) -> None:
        scene = solution.scene
        mesh, positions = scene.liquid.six_node_mesh, scene.positions(solution.x)
        self._quadrature, self._half = CellQuadrature(mesh), scene.reference.geometry.length / 2
        self._over = min(AVERAGED, MOST_AVERAGED * solution.free)
        self.remember = scene.material.has_memory
        self._z = np.einsum("qa,ma->mq", self._quadrature.shapes, positions[mesh.cells, 0], optimize=True)
        self._weights = self._quadrature.weights(positions)
        self._index = scene.liquid.index("p", mesh.vertices)
        self._p = solution.x[self._index]

    def average(self, downstream: float, inwards: float = 0.0) -> _Average:
        """The average at one end.

        Args:
            downstream: 1 for the downstream end, -1 for the upstream one.
            inwards: How far the average is shifted into the tube, relative to the length over which it is taken.
        """
        t = np.clip((self._half - downstream * self._z) / self._over - inwards, 0.0, 1.0)
        averaged = self._weights * t**2 * (1 - t) ** 2
        averaged /= averaged.sum() or np.nan  # the displaced mesh of a diverged estimate may have no cells there
        of_vertices = self._quadrature.integrals(averaged)
        return _Average(float(of_vertices @ self._p), float((averaged * self._z).sum()), self._index, of_vertices)
