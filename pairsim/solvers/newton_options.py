"""Options of Newton's method: tolerance, reuse of the matrix, and control parameters of MUMPS.

The origin of the default values is listed in docs/explanation/constants.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class MatrixPolicy:
    """Criteria for a new matrix. Assembling and factorising one costs as much as about 13 iterations without.

    Attributes:
        slow: Rate of contraction above which the matrix is not reused.
        other_step: Largest relative change of g = gamma dt for which the matrix is reused in another step.
        far: Norm of a step, relative to the fields, above which even a matrix from the same iteration is replaced;
            infinite for linear equations.
        near: Rate of contraction up to which the factors serve to solve linear systems with the matrix at the solution:
            six refinements then reach 1e-10 of the right-hand side.
        unproven_rate: Smallest rate of contraction that is assumed before one was observed in the present solve.
    """

    slow: float = 0.15
    other_step: float = 0.5
    far: float = 1e-3
    near: float = 0.035
    unproven_rate: float = 0.1

    def serves_step(self, ratio: float) -> bool:
        """Whether a matrix is reused in a solve whose g is `ratio` times that of the matrix; infinite: no matrix."""
        return abs(ratio - 1) <= self.other_step

    def is_worn(self, rate: float, step: float, fresh: bool) -> bool:
        """Whether the next iteration needs a new matrix.

        Args:
            rate: Rate of contraction of the last step.
            step: Norm of the last step, relative to the fields.
            fresh: Whether the matrix was assembled for that step.
        """
        return step > self.far if fresh else rate > self.slow


@dataclass(frozen=True)
class MumpsOptions:
    """Control parameters of MUMPS.

    By default the matrix is ordered by nested dissection without a preceding maximum transversal; zeros on the diagonal
    are treated by pivoting. Measured: with the transversal `transversal=5` the factors have 4 to 14 % more entries in
    every kind of scene, with MUMPS's automatic choice twice as many.

    Attributes:
        transversal: ICNTL(6), permutation to a zero-free diagonal; 0 for none.
        ordering: ICNTL(7), fill-reducing ordering; 5 is METIS.
        workspace: ICNTL(14), workspace above the estimate [%].
    """

    transversal: int = 0
    ordering: int = 5
    workspace: int = 40

    @property
    def controls(self) -> dict[str, int]:
        """PETSc options without their prefix, and their values."""
        return {"icntl_6": self.transversal, "icntl_7": self.ordering, "icntl_14": self.workspace}


@dataclass(frozen=True)
class NewtonOptions:
    """Options of Newton's method.

    Attributes:
        tolerance: Largest estimated error of a field after the last iteration, relative to the norm of the field.
        max_iterations: Largest number of iterations in one solve.
        single: Whether the factors are in single precision until the refinement of a solution fails.
        matrix: Criteria for a new matrix.
        mumps: Control parameters of the factorisation.
    """

    tolerance: float = 1e-8
    max_iterations: int = 12
    single: bool = True
    matrix: MatrixPolicy = MatrixPolicy()
    mumps: MumpsOptions = MumpsOptions()


# With the matrix of the last iterations the derivatives at the solution are computed, too.
STEADY = NewtonOptions(tolerance=1e-9, matrix=MatrixPolicy(slow=0.05, far=0.3))
# In double precision the displacement does not depend on whether the matrix was used before, as in a resumed run.
EXTENSION = NewtonOptions(single=False, matrix=MatrixPolicy(far=math.inf))
# In time-dependent problems the matrix is reused for longer, which takes more iterations.
TRANSIENT = NewtonOptions(tolerance=1e-9, max_iterations=25, matrix=MatrixPolicy(slow=0.3))
