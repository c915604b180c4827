"""A disturbed scene: its phases and constraints, and the linear system of a disturbance."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from pairsim.fem.azimuthal.constraints import disturbed_constraints
from pairsim.fem.azimuthal.phase import DisturbedPhase
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Array


class DisturbedScene:
    """The first azimuthal mode of a scene about an axisymmetric solution.

    Args:
        scene: The scene.
        h: Positions of the particles' material in the solution, shape (n_h,).
        x: Its full vector, shape (n,).
        volume_modulus: Whether soft particles resist changes of volume within cells.
    """

    def __init__(self, scene: Scene, h: Array, x: Array, *, volume_modulus: bool = False) -> None:
        self.scene = scene
        self.phases = [DisturbedPhase.liquid(scene.liquid, scene.positions(x), x[: scene.liquid.size])]
        for body in scene.bodies:
            if body.phase is not None:
                pressure = body.phase.nodal("p", x[scene.offset(body.phase) :]).ravel()
                solid = DisturbedPhase.solid(
                    body.phase, body.positions(h), pressure, volume_modulus=volume_modulus
                )
                self.phases.append(solid)
        self.constraints = disturbed_constraints(scene, self.phases, h)

    def matrix(self, rate: float = 0.0, mesh_rate: float = 0.0) -> sparse.csr_matrix:
        """The matrix of the full vector, shape (n, n)."""
        liquid, *solids = self.phases
        parts = [liquid.matrix(rate, mesh_rate), *(phase.matrix() for phase in solids)]
        return sparse.csr_matrix(sparse.block_diag(parts, format="csr"))

    def solve(self, A: sparse.csr_matrix) -> Array:
        """Disturbances y for unit displacements of the particles, shape (n_y, N_p)."""
        c = self.constraints
        equations = c.T @ A + c.pins
        rhs = (c.pinned - equations @ c.D).toarray()
        return np.asarray(splu(sparse.csc_matrix(equations @ c.N)).solve(rhs))
