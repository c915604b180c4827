"""A stored quasi-steady solution."""

from __future__ import annotations

from dataclasses import dataclass

from pairsim.fem.meshes.geometry import Reference
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.runtime.arrays import Array
from pairsim.solvers.parameters import Parameters


@dataclass(frozen=True)
class Snapshot:
    """A stored solution and its mesh.

    Attributes:
        parameters: Parameters of the solution.
        y: Free unknowns, shape (n_y,).
        reference: Reference domain of the liquid.
        mesh: Mesh of the reference domain.
    """

    parameters: Parameters
    y: Array
    reference: Reference
    mesh: SixNodeMesh
