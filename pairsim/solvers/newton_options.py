"""How Newton's method is run: its tolerance, when it makes a new matrix, and how MUMPS factors it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class MatrixPolicy:
    """When Newton's method makes a new matrix; a matrix and its factors cost some 13 iterations with those in hand.

    Attributes:
        slow: Rate of contraction above which a kept matrix no longer serves.
        other_step: Largest relative change of g = gamma dt over which a matrix serves another step.
        far: Step above which even a matrix made in the same iteration is replaced by one at the new iterate.
        unproven_rate: Least rate that is assumed of a matrix before the solve under way has seen one.
    """

    slow: float = 0.15
    other_step: float = 0.5
    far: float = 1e-3
    unproven_rate: float = 0.1

    def serves_step(self, ratio: float) -> bool:
        """Whether a matrix may begin a solve whose g is `ratio` times its own (infinite: there is none)."""
        return abs(ratio - 1) <= self.other_step

    def is_worn(self, rate: float, step: float, fresh: bool) -> bool:
        """Whether the next iteration needs a new matrix.

        Args:
            rate: Contraction of the last step.
            step: Size of the last step, relative to the fields.
            fresh: Whether the matrix was made for that very step.
        """
        return step > self.far if fresh else rate > self.slow


@dataclass(frozen=True)
class MumpsOptions:
    """MUMPS's control parameters.

    Nested dissection of the structure as it is, and pivoting for the zeros on the diagonal. With a maximum transversal
    first (5) factors have 4 to 14 % more entries in every kind of scene; MUMPS's own choice has twice as many.

    Attributes:
        transversal: ICNTL(6), permutation to a diagonal without zeros; 0 is none.
        ordering: ICNTL(7); 5 is METIS.
        workspace: ICNTL(14), work space above the estimate [%].
    """

    transversal: int = 0
    ordering: int = 5
    workspace: int = 40

    @property
    def controls(self) -> dict[str, int]:
        """Names of PETSc's options without their prefix, and values."""
        return {"icntl_6": self.transversal, "icntl_7": self.ordering, "icntl_14": self.workspace}


@dataclass(frozen=True)
class NewtonOptions:
    """Options of Newton's method.

    Attributes:
        tolerance: Estimated error left in any field, relative to the field's size.
        max_iterations: Linear solves allowed.
        matrix: When a new matrix is made.
        mumps: How it is factored.
    """

    tolerance: float = 1e-8
    max_iterations: int = 12
    matrix: MatrixPolicy = MatrixPolicy()
    mumps: MumpsOptions = MumpsOptions()


STEADY = NewtonOptions(tolerance=1e-9)
# In time a kept matrix serves longer: more iterations are allowed than with a matrix each.
TRANSIENT = NewtonOptions(tolerance=1e-9, max_iterations=25, matrix=MatrixPolicy(slow=0.3))
