"""Nodes on the boundaries of the liquid's mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pairsim.fem.meshes.geometry import Reference
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh, match
from pairsim.quantities.scales import TUBE_RADIUS
from pairsim.runtime.arrays import Indices
from pairsim.runtime.errors import MeshFailure


@dataclass(frozen=True)
class LiquidNodes:
    """Nodes of the liquid's mesh on its boundaries.

    Attributes:
        axis: Nodes with r = 0.
        wall: Nodes with r = 1/2.
        inlet: Nodes of the upstream end, in ascending r.
        outlet: Nodes of the downstream end, in ascending r, at the same radii as those of the inlet.
        interfaces: For each particle the nodes of its outline, from the downstream to the upstream pole.
        planes: Nodes of each of the reference domain's planes, in ascending r.
    """

    axis: Indices
    wall: Indices
    inlet: Indices
    outlet: Indices
    interfaces: tuple[Indices, ...]
    planes: tuple[Indices, ...]

    @staticmethod
    def find(mesh: SixNodeMesh, reference: Reference) -> LiquidNodes:
        r, half = mesh.points[:, 1], reference.geometry.length / 2
        inlet, outlet = mesh.nodes_of_plane(-half), mesh.nodes_of_plane(half)
        if len(inlet) != len(outlet) or not np.allclose(r[inlet], r[outlet], rtol=0.0, atol=1e-9):
            raise MeshFailure("the nodes of the two ends differ in number or radius")
        return LiquidNodes(
            np.flatnonzero(r < 1e-12),
            np.flatnonzero(r > TUBE_RADIUS - 1e-9),
            inlet,
            outlet,
            tuple(match(mesh.points, nodes) for nodes in reference.positions),
            tuple(mesh.nodes_of_plane(z) for z in reference.planes),
        )
