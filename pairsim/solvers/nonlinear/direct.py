"""Direct solution of a sparse linear system with a given matrix, by the factorisation that Newton's matrix has."""

from __future__ import annotations

from itertools import count

import numpy as np
from scipy import sparse

from pairsim.runtime.arrays import Array
from pairsim.runtime.fenicsx import PETSc
from pairsim.solvers.nonlinear.factors import EXACT, Factors, MumpsOptions, ReducedSystem

_PREFIXES = count()


class GivenSystem(ReducedSystem):
    """A linear system with a given matrix.

    Args:
        matrix: The matrix, shape (n_y, n_y).
    """

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        matrix.sort_indices()
        csr = (*(v.astype(PETSc.IntType) for v in (matrix.indptr, matrix.indices)), matrix.data)
        self.A = PETSc.Mat().createAIJWithArrays(matrix.shape, csr, comm=PETSc.COMM_SELF)
        self.A.assemble()
        self.options, self._order, self._held = {}, np.arange(matrix.shape[0]), csr


class DirectSolver:
    """A given matrix with its factors.

    Args:
        matrix: The matrix, shape (n_y, n_y).
    """

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        self._system = GivenSystem(matrix)
        prefix = f"pairsim_direct_{next(_PREFIXES)}_"
        self._ksp = PETSc.KSP().create(PETSc.COMM_SELF)
        self._ksp.setOptionsPrefix(prefix)
        self._factors = Factors(self._system, self._ksp, prefix, MumpsOptions(), single=True)
        database = PETSc.Options()
        self._names = [f"{prefix}{name}" for name in self._factors.options]
        for name, value in zip(self._names, self._factors.options.values(), strict=True):
            database[name] = value
        self._ksp.setFromOptions()
        self._factors.make()

    def solve(self, rhs: Array) -> Array:
        """Solve for k right-hand sides, shape (n_y, k) -> (n_y, k).

        Raises:
            NoSteadyState: The matrix is singular in double precision, after refinement in single precision has failed.
        """
        return self._factors.solve(np.ascontiguousarray(rhs.T), transposed=False, tolerance=EXACT).T

    def close(self) -> None:
        """Free the memory of the factors."""
        for name in self._names:
            PETSc.Options().delValue(name)
        self._ksp.destroy()
        self._system.A.destroy()
