"""The matrix of the free unknowns and its factorisation by MUMPS: ordering, precision, workspace and linear solves.

The factors are in single precision, and solutions are refined iteratively with the matrix itself. Where the refinement
does not converge, as near folds, the factors are in double precision. See "Nonlinear and linear solvers" in
docs/explanation/numerics.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pairsim.fem.algebra.condensed_matrix import CondensedMatrix
from pairsim.fem.algebra.constraints import Constraints
from pairsim.fem.algebra.fill_reducing_ordering import fill_reducing_ordering
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import NoSteadyState
from pairsim.runtime.fenicsx import PETSc
from pairsim.runtime.signals import sigterm_waits

MOST_ANALYSES = 4  # attempts with the workspace of MUMPS doubled each time; chosen
# Residuals of linear systems relative to the right-hand side, all chosen. With factors of the same matrix in single
# precision the first solution leaves 1e-6 to 1e-3, and every refinement gains a factor of 1e4; with those of an earlier
# iterate, a factor of 30. Solving adjoints to 1e-6 only changed no dU by more than 1e-8 of the peak.
EXACT = 1e-10  # of derivatives
ACCURATE = 1e-8  # of Newton steps
ADJOINT = 1e-6  # of adjoints
LAST = 1e-4  # of a last Newton step
ROUGH = 1e-2  # of Newton steps that leave a larger error for other reasons: nonlinearity or a lagged matrix
MOST_REFINEMENTS = 6  # chosen; a matrix that needs more is too close to singular for single precision
DIRECTION = 9  # ICNTL(9): MUMPS solves with the matrix if it is 1, otherwise with its transpose
PETSC_ORDER = 7  # value of ICNTL(7) with which the ordering is passed on from PETSc in place of one of MUMPS


@dataclass(frozen=True)
class MumpsOptions:
    """Control parameters of MUMPS.

    By default the matrix is ordered by nested dissection without a preceding maximum transversal; zeros on the diagonal
    are treated by pivoting. Measured: with `transversal=5` the factors have 4 to 14 % more entries in every kind of
    scene, with MUMPS's automatic choice twice as many.

    Attributes:
        transversal: ICNTL(6), permutation to a zero-free diagonal; 0 for none.
        ordering: ICNTL(7), fill-reducing ordering; 5 is METIS.
        workspace: ICNTL(14), workspace in excess of the estimate [%].
    """

    transversal: int = 0
    ordering: int = 5
    workspace: int = 40

    @property
    def controls(self) -> dict[str, int]:
        """PETSc options without their prefix, and their values."""
        return {"icntl_6": self.transversal, "icntl_7": self.ordering, "icntl_14": self.workspace}


class ReducedSystem:
    """The matrix T A P and its vectors in PETSc, whose rows are in the order of elimination.

    Arrays that are passed to the methods or returned by them are in the numbering of the free unknowns.

    Args:
        scene: The scene.
        constraints: Its constraints.

    Attributes:
        A: The matrix.
        options: PETSc options, without their prefix, with which MUMPS eliminates in the order of the rows.
    """

    def __init__(self, scene: Scene, constraints: Constraints) -> None:
        order = fill_reducing_ordering(scene, constraints)
        ours: dict[str, int | str] = {"mat_mumps_icntl_7": PETSC_ORDER, "pc_factor_mat_ordering_type": "natural"}
        self.options = {} if order is None else ours
        self._order = np.arange(constraints.size) if order is None else order
        self._reduced = CondensedMatrix(scene, constraints, self._order)
        csr = (*(v.astype(PETSc.IntType) for v in (self._reduced.indptr, self._reduced.indices)), self._reduced.data)
        self.A = PETSc.Mat().createAIJWithArrays([constraints.size] * 2, csr, comm=PETSc.COMM_SELF)

    def assemble(self, g: float) -> None:
        """Assemble at the present state of the phases, for g = gamma dt."""
        self._reduced.assemble(g)
        self.A.assemble()

    def times(self, values: Array) -> Array:
        """The product of the matrix and values, shape (n_y,)."""
        block = self.block(values[None])
        product = self.A.matMult(block)
        found = self.columns(product.getDenseArray().copy())[0]
        block.destroy()
        product.destroy()
        return found

    def gather(self, vector: Any) -> Array:
        """The values of a PETSc vector, shape (n_y,)."""
        values = np.empty(len(self._order))
        values[self._order] = vector.getArray(readonly=True)
        return values

    def scatter(self, values: Array, vector: Any) -> None:
        """Set a PETSc vector to values, shape (n_y,)."""
        vector.setArray(values[self._order])

    def block(self, values: Array) -> Any:
        """A dense PETSc matrix with the k rows of `values`, shape (k, n_y), as its columns."""
        columns = np.asfortranarray(values[:, self._order].T)
        return PETSc.Mat().createDense(columns.shape, array=columns, comm=PETSc.COMM_SELF)

    def columns(self, block: Array) -> Array:
        """The k vectors, shape (k, n_y), that are the columns of a block, shape (n_y, k)."""
        values = np.empty(block.T.shape)
        values[:, self._order] = block.T
        return values


class Factors:
    """The factors of a matrix by MUMPS, as the preconditioner of a linear solver of PETSc (KSP).

    Args:
        system: The matrix.
        ksp: The KSP, of its own or of a nonlinear solver (SNES).
        prefix: Prefix of its options in PETSc's database.
        mumps: Control parameters.
        single: Whether to begin in single precision.

    Attributes:
        single: Whether the factors are in single precision.
        count: Number of matrices factorised so far.
        regular: Whether the last factorisation succeeded; if not, there may be no factors to solve with.
        options: PETSc options of the factorisation, without their prefix.
    """

    def __init__(self, system: ReducedSystem, ksp: Any, prefix: str, mumps: MumpsOptions, single: bool) -> None:
        self._system, self._ksp, self._prefix = system, ksp, prefix
        self.single, self._workspace, self.count = single, mumps.workspace, 0
        self.regular = False
        self._kept = False  # whether the factors are those of an earlier matrix, not of the one assembled now
        ksp.getPC().setType("lu")
        ksp.getPC().setFactorSolverType("mumps")
        self.options: dict[str, int | str] = {f"mat_mumps_{k}": v for k, v in mumps.controls.items()}
        self.options |= system.options | {"pc_precision": "single" if self.single else "double"}
        self._refine()

    def _refine(self) -> None:
        """Set the KSP to refine solutions if the factors are in single precision.

        With factors in double precision there is no refinement, not even near folds.
        """
        norm = PETSc.KSP.NormType
        self._ksp.setType("richardson" if self.single else "preonly")
        self._ksp.setNormType(norm.UNPRECONDITIONED if self.single else norm.NONE)

    def tolerate(self, rough: bool) -> None:
        """Set the tolerance of the linear systems of the next Newton steps, ROUGH or ACCURATE."""
        self._ksp.setTolerances(rtol=ROUGH if rough else ACCURATE, max_it=MOST_REFINEMENTS)

    @property
    def megabytes(self) -> int:
        """Memory of the factors [1e6 bytes]."""
        return int(self._ksp.getPC().getFactorMatrix().getMumpsInfog(22))

    def make(self) -> None:
        """Factorise the assembled matrix; `regular` tells whether this succeeded.

        If delayed pivots exceed the workspace, it is doubled and the analysis repeated. If the factorisation in single
        precision fails otherwise, as for a singular matrix, it is repeated in double precision.
        """
        self._kept = False
        self._ksp.getPC().setReusePreconditioner(False)
        self.count += 1
        for _ in range(MOST_ANALYSES):
            self._ksp.setOperators(self._system.A)
            with sigterm_waits():
                self._ksp.setUp()
            status = self._ksp.getPC().getFactorMatrix().getMumpsInfog(1)
            self.regular = status >= 0
            if status in (-8, -9):
                self._workspace *= 2
                self.forget()
            elif status < 0 and self.single:
                self.use_double()
            else:
                break

    def keep(self) -> None:
        """Keep the factors to refine solutions with a matrix that was assembled after them and differs little."""
        self._ksp.getPC().setReusePreconditioner(True)
        self._kept = True

    def forget(self) -> None:
        """Discard the factors and the symbolic analysis."""
        PETSc.Options()[f"{self._prefix}mat_mumps_icntl_14"] = self._workspace
        self._ksp.reset()

    def use_double(self) -> None:
        """Discard the factors, and compute all later ones in double precision."""
        self.single = False
        PETSc.Options()[f"{self._prefix}pc_precision"] = "double"
        self.forget()
        self._refine()
        self._ksp.getPC().setFromOptions()

    def solve(self, rhs: Array, *, transposed: bool, tolerance: float) -> Array:
        """Solve with the assembled matrix, or its transpose.

        The time of a solve is that of reading the factors, which is done once for all right-hand sides. Factors with
        which the tolerance is not met are replaced: those of an earlier matrix by those of the assembled one, and these
        by factors in double precision.

        Args:
            rhs: Right-hand sides, shape (k, n_y).
            transposed: Whether to solve with the transposed matrix.
            tolerance: Residual of every system, relative to its right-hand side.

        Returns:
            Solutions, shape (k, n_y).

        Raises:
            NoSteadyState: The factors had to be replaced, and the matrix is singular in double precision, too.
        """
        while True:
            x, met = self._refined(rhs, transposed, tolerance)
            if met or not (self._kept or self.single):
                return x
            if not self._kept:
                self.use_double()
            self.make()
            if not self.regular:
                raise NoSteadyState("Newton's matrix is singular at the solution", advice="a larger mesh.Np")

    def _refined(self, rhs: Array, transposed: bool, tolerance: float) -> tuple[Array, bool]:
        """Solutions with the present factors, and whether they meet the tolerance.

        Factors in double precision are used without refinement, and the tolerance is taken to be met.
        """
        system, factors = self._system, self._ksp.getPC().getFactorMatrix()

        def squares(values: Array) -> Array:
            return np.asarray((values**2).sum(axis=0))

        left = system.block(rhs)
        correction, product = left.duplicate(), None
        b = left.getDenseArray().copy()
        x, wanted, met = np.zeros_like(b), tolerance**2 * squares(b), not self.single
        for count in range(MOST_REFINEMENTS + 1):
            factors.setMumpsIcntl(DIRECTION, 0 if transposed else 1)
            factors.matSolve(left, correction)
            factors.setMumpsIcntl(DIRECTION, 1)
            x += correction.getDenseArray()
            if not self.single:
                break
            correction.getDenseArray()[:] = x
            product = (system.A.transposeMatMult if transposed else system.A.matMult)(correction, product)
            residual = b - product.getDenseArray(readonly=True)
            met = bool((squares(residual) <= wanted).all())
            if met or count == MOST_REFINEMENTS:
                break
            left.getDenseArray()[:] = residual
        for matrix in (left, correction, product):
            if matrix is not None:
                matrix.destroy()
        return system.columns(x), met
