"""Extension of the particles' displacement into the liquid's mesh, solved apart from the other equations."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from pairsim.fem.algebra.scene_constraints import extension_constraints
from pairsim.fem.meshes.quadrature import CellQuadrature, assembled
from pairsim.fem.phases.compiled_phase import QUADRATURE_DEGREE
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Array

NEGLIGIBLE_DISPLACEMENT = 1e-13  # as large as rounding errors of positions [D_c]


class MeshExtension:
    """Solves the equations of `pairsim.physics.forms.mesh_motion` for given positions of the material.

    Args:
        scene: A scene whose mesh moves.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene, self._constraints = scene, extension_constraints(scene)
        self._stiffness: sparse.csr_matrix | None = None

    def __call__(self, h: Array) -> tuple[Array, Array]:
        """Displacement of the mesh for material positions h, shape (n_h,).

        Returns:
            Its free unknowns, and the full vector with zeros in all other fields, shape (n,).
        """
        constraints = self._constraints
        zero = np.zeros(constraints.size)
        at_interfaces = constraints.expand(zero, h)
        if np.abs(at_interfaces).max() < NEGLIGIBLE_DISPLACEMENT:  # the distances are those for which the mesh was made
            return zero, at_interfaces
        if self._stiffness is None:
            self._stiffness = sparse.csr_matrix(constraints.T @ _stiffness(self._scene))
            self._factors = splu(sparse.csc_matrix(self._stiffness @ constraints.N))
        eta = self._factors.solve(-self._stiffness @ at_interfaces)
        return eta, constraints.expand(eta, h)


def _stiffness(scene: Scene) -> sparse.csr_matrix:
    """The matrix of the extension in the numbering of the full vector, shape (n, n)."""
    mesh, liquid = scene.liquid.six_node_mesh, scene.liquid
    both = CellQuadrature(mesh, QUADRATURE_DEGREE).gradient_products
    # 2 e : e' + div div' of displacement component i at node a with test component j at node b.
    cells = both + both.transpose(0, 1, 4, 3, 2)
    cells += both.trace(axis1=2, axis2=4)[:, :, None, :, None] * np.eye(2)[:, None, :]
    index = np.stack([liquid.index("eta", mesh.cells, c) for c in range(2)], axis=2)
    return assembled(cells, index.reshape(-1, 12), scene.size)
