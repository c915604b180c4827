"""PETSc's matrix T A P and vectors of the free unknowns, in the order of elimination."""

from __future__ import annotations

from typing import Any

import numpy as np

from pairsim.fem.constraints import Constraints
from pairsim.fem.reduced_matrix import ReducedMatrix
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Array, Indices
from pairsim.runtime.fenicsx import PETSc
from pairsim.solvers.elimination_order import elimination_order

PETSC_ORDER = 7  # ICNTL(7) with which PETSc hands its own order to MUMPS


class ReducedSystem:
    """Matrix and vectors; methods are collective, and arrays are in the numbering of the unknowns.

    Args:
        scene: The scene.
        constraints: Its constraints.

    Attributes:
        A: The matrix.
        options: PETSc options, without their prefix, with which MUMPS eliminates in the order of the rows.
    """

    def __init__(self, scene: Scene, constraints: Constraints) -> None:
        self.comm, self.size = scene.comm, constraints.size
        # On several processes the storage is distributed, for which PETSc hands no order to MUMPS.
        order = elimination_order(scene, constraints) if self.comm.size == 1 else None
        ours: dict[str, int | str] = {"mat_mumps_icntl_7": PETSC_ORDER, "pc_factor_mat_ordering_type": "natural"}
        self.options = {} if order is None else ours
        self._order = np.arange(self.size) if order is None else order
        self._reduced = ReducedMatrix(scene, constraints, self._order)
        indptr, indices = (v.astype(PETSc.IntType) for v in (self._reduced.indptr, self._reduced.indices))
        if self.comm.size == 1:
            csr = (indptr, indices, self._reduced.data)
            self.A = PETSc.Mat().createAIJWithArrays([self.size, self.size], csr, comm=self.comm)
        else:
            self.A = PETSc.Mat().create(self.comm)
            self.A.setSizes([self.size, self.size])
            self.A.setType("aij")
            self.A.setPreallocationCOO(np.repeat(np.arange(self.size, dtype=PETSc.IntType), np.diff(indptr)), indices)
        vector = self.A.createVecRight()
        self._counts, self._range = self.comm.allgather(vector.getLocalSize()), vector.getOwnershipRange()
        vector.destroy()

    def assemble(self, g: float) -> None:
        """Assemble at the present state of the phases, for g = gamma dt."""
        self._reduced.assemble(g)
        if self.comm.size > 1:
            self.A.setValuesCOO(self._reduced.data, PETSc.InsertMode.INSERT_VALUES)
        self.A.assemble()

    def gather(self, vector: Any) -> Array:
        """Gather a vector on every process, shape (n_y,)."""
        return self._whole(np.array(vector.getArray(readonly=True)))

    def scatter(self, values: Array, vector: Any) -> None:
        """Set a vector from values that are identical on every process, shape (n_y,)."""
        vector.setArray(values[self._own])

    def block(self, values: Array) -> Any:
        """PETSc's dense matrix whose columns are vectors, shape (k, n_y), that are identical on every process."""
        local = np.asfortranarray(values[:, self._own].T)
        sizes = (self._counts[self.comm.rank], self.size), (None, len(values))
        return PETSc.Mat().createDense(sizes, array=local, comm=self.comm)

    def gather_block(self, local: Array) -> Array:
        """Gather the columns of a block, of which this process has the rows `local`, shape (k, n_y)."""
        return np.array([self._whole(np.ascontiguousarray(column)) for column in local.T])

    @property
    def _own(self) -> Indices:
        """Unknowns of the rows of this process."""
        return self._order[self._range[0] : self._range[1]]

    def _whole(self, local: Array) -> Array:
        """Gather the values of all rows on every process, shape (n_y,)."""
        whole = np.empty(self.size)
        if self.comm.size == 1:
            whole[self._order] = local
        else:
            self.comm.Allgatherv(local, (whole, self._counts))
        return whole
