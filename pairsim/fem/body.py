"""The particles of a scene, and their parts of the vector h.

The positions of the particles' material form the vector h, shape (n_h,): for a soft particle the displacements (z, r)
of all nodes from its undeformed sphere centred at the origin, for a rigid particle the axial position of its centre.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pairsim.fem.meshes.geometry import Outline
from pairsim.fem.meshes.quadrature import CellQuadrature
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh, match
from pairsim.fem.phases.compiled_phase import solid_phase
from pairsim.fem.phases.phase import Phase
from pairsim.physics.solids import Solid
from pairsim.runtime.arrays import Array, Indices


@dataclass(frozen=True)
class Body:
    """A rigid or soft particle, and its part of the vector h.

    Attributes:
        outline: Its half-circle, divided into arcs.
        phase: The solid inside, None for a rigid particle.
        nodes: Nodes of the mesh of the solid on the outline, empty for a rigid particle.
        start: First index of its part of h.
    """

    outline: Outline
    phase: Phase[Solid] | None
    nodes: Indices
    start: int

    @property
    def size(self) -> int:
        """Number of entries in h."""
        return 1 if self.phase is None else 2 * len(self.phase.six_node_mesh.points)

    @cached_property
    def quadrature(self) -> CellQuadrature:
        assert self.phase is not None
        return CellQuadrature(self.phase.six_node_mesh)

    def positions(self, h: Array) -> Array:
        """Current positions of all nodes of a soft particle, shape (nodes, 2)."""
        assert self.phase is not None
        return self.phase.six_node_mesh.points + self.displacement(h)

    def mean(self, displacements: Array, h: Array) -> float:
        """Axial component of a vector in the numbering of h, averaged over the volume of the particle."""
        if self.phase is None:
            return float(displacements[self.start])
        return self.quadrature.mean(self.displacement(displacements)[:, 0], self.positions(h))

    def mean_weights(self, h: Array) -> Array:
        """The weights with which `mean` sums the entries of a vector in the numbering of h, shape (n_h,)."""
        weights = np.zeros(len(h))
        if self.phase is None:
            weights[self.start] = 1.0
        else:
            weights[self.start : self.start + self.size : 2] = self.quadrature.mean_weights(self.positions(h))
        return weights

    def displacement(self, h: Array) -> Array:
        """Displacement of all nodes of a soft particle from its sphere centred at the origin, shape (nodes, 2)."""
        return h[self.start : self.start + self.size].reshape(-1, 2)

    def outline_points(self, h: Array) -> Array:
        """Current positions of the nodes of the outline, downstream pole first, shape (2 k + 1, 2)."""
        if self.phase is None:
            return self.outline.nodes + [h[self.start], 0.0]
        return self.outline.nodes + self.displacement(h)[self.nodes]


def make_bodies(
    solids: Sequence[Solid | None],
    outlines: Sequence[Outline],
    meshes: Sequence[SixNodeMesh | None],
    volume_modulus: bool = False,
) -> list[Body]:
    """Create the particles of a scene.

    Args:
        solids: What they are made of, None for rigid particles.
        outlines: Outlines of the particles.
        meshes: Meshes of the soft particles; ignored for rigid ones.
        volume_modulus: Whether soft particles resist changes of volume within cells; see `solid_phase`.
    """
    bodies: list[Body] = []
    start = 0
    for solid, outline, mesh in zip(solids, outlines, meshes, strict=True):
        if solid is not None:
            assert mesh is not None
            phase: Phase[Solid] | None = Phase(solid_phase(solid, volume_modulus), mesh, solid)
            nodes = match(mesh.points, outline.nodes)
        else:
            phase, nodes = None, np.empty(0, dtype=np.int64)
        bodies.append(Body(outline, phase, nodes, start))
        start += bodies[-1].size
    return bodies
