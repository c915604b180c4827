"""PETSc's matrix T A P and vectors of the free unknowns, in the order of elimination."""

from __future__ import annotations

from typing import Any

import numpy as np

from pairsim.fem.constraints import Constraints
from pairsim.fem.reduced_matrix import ReducedMatrix
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Array
from pairsim.runtime.fenicsx import PETSc
from pairsim.solvers.elimination_order import elimination_order

PETSC_ORDER = 7  # ICNTL(7) with which PETSc hands its own order to MUMPS


class ReducedSystem:
    """Matrix and vectors; arrays are in the numbering of the unknowns.

    Args:
        scene: The scene.
        constraints: Its constraints.

    Attributes:
        A: The matrix.
        options: PETSc options, without their prefix, with which MUMPS eliminates in the order of the rows.
    """

    def __init__(self, scene: Scene, constraints: Constraints) -> None:
        order = elimination_order(scene, constraints)
        ours: dict[str, int | str] = {"mat_mumps_icntl_7": PETSC_ORDER, "pc_factor_mat_ordering_type": "natural"}
        self.options = {} if order is None else ours
        self._order = np.arange(constraints.size) if order is None else order
        self._reduced = ReducedMatrix(scene, constraints, self._order)
        csr = (*(v.astype(PETSc.IntType) for v in (self._reduced.indptr, self._reduced.indices)), self._reduced.data)
        self.A = PETSc.Mat().createAIJWithArrays([constraints.size] * 2, csr, comm=PETSc.COMM_SELF)

    def assemble(self, g: float) -> None:
        """Assemble at the present state of the phases, for g = gamma dt."""
        self._reduced.assemble(g)
        self.A.assemble()

    def gather(self, vector: Any) -> Array:
        """The values of a vector, shape (n_y,)."""
        values = np.empty(len(self._order))
        values[self._order] = vector.getArray(readonly=True)
        return values

    def scatter(self, values: Array, vector: Any) -> None:
        """Set a vector from values, shape (n_y,)."""
        vector.setArray(values[self._order])

    def block(self, values: Array) -> Any:
        """PETSc's dense matrix whose columns are vectors, shape (k, n_y)."""
        columns = np.asfortranarray(values[:, self._order].T)
        return PETSc.Mat().createDense(columns.shape, array=columns, comm=PETSc.COMM_SELF)

    def columns(self, block: Array) -> Array:
        """The vectors that are the columns of a block, shape (k, n_y)."""
        values = np.empty(block.T.shape)
        values[:, self._order] = block.T
        return values
