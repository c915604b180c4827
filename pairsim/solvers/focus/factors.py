"""Factorisation of the matrix of the disturbances, with a nested-dissection ordering."""

from __future__ import annotations

from itertools import count

import numpy as np
from scipy import sparse

from pairsim.fem.azimuthal.elimination import elimination_order
from pairsim.fem.azimuthal.scene import DisturbedScene
from pairsim.runtime.arrays import Array
from pairsim.runtime.fenicsx import PETSc
from pairsim.solvers.nonlinear.direct import GivenSystem
from pairsim.solvers.nonlinear.factors import EXACT, PETSC_ORDER, Factors, MumpsOptions

# Relative residual to which a correction in an iteration is solved for; chosen. It is about what single-precision
# factors leave without refinement, and the next correction removes it.
CORRECTION = 1e-3
_PREFIXES = count()


class OrderedSystem(GivenSystem):
    """The linear system of a disturbed scene, with rows and columns in the order of elimination.

    Args:
        scene: The disturbed scene.
    """

    def __init__(self, scene: DisturbedScene) -> None:
        order = elimination_order(scene)
        if order is None:
            super().__init__(scene.matrix)
            return
        super().__init__(sparse.csr_matrix(scene.matrix[order][:, order]))
        self._order = order
        self.options = {"mat_mumps_icntl_7": PETSC_ORDER, "pc_factor_mat_ordering_type": "natural"}


class DisturbedFactors:
    """The factorised matrix of a disturbed scene.

    Args:
        scene: The disturbed scene.
    """

    def __init__(self, scene: DisturbedScene) -> None:
        self._matrix, self._system = scene.matrix, OrderedSystem(scene)
        prefix = f"pairsim_disturbed_{next(_PREFIXES)}_"
        self._ksp = PETSc.KSP().create(PETSc.COMM_SELF)
        self._ksp.setOptionsPrefix(prefix)
        self._factors = Factors(self._system, self._ksp, prefix, MumpsOptions(), single=True)
        database = PETSc.Options()
        self._names = [f"{prefix}{name}" for name in self._factors.options]
        for name, value in zip(self._names, self._factors.options.values(), strict=True):
            database[name] = value
        self._ksp.setFromOptions()
        self._factors.make()

    def solve(self, rhs: Array, tolerance: float = EXACT) -> Array:
        """Solve for k right-hand sides, shape (n_y, k) -> (n_y, k).

        Args:
            rhs: Right-hand sides.
            tolerance: Residual of every system, relative to its right-hand side.

        Raises:
            NoSteadyState: The matrix is singular in double precision, after refinement in single precision has failed.
        """
        return self._factors.solve(np.ascontiguousarray(rhs.T), transposed=False, tolerance=tolerance).T

    def corrected(self, y: Array, rhs: Array) -> Array:
        """Improved solutions y, shape (n_y, k), of systems with right-hand sides of this shape.

        Their residuals are those of y times `CORRECTION`.
        """
        return y + self.solve(rhs - self._matrix @ y, CORRECTION)

    def close(self) -> None:
        """Free the memory of the factors."""
        for name in self._names:
            PETSc.Options().delValue(name)
        self._ksp.destroy()
        self._system.A.destroy()
