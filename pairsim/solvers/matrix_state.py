"""State of Newton's matrix between two solves, in a form that can be stored in a checkpoint."""

from __future__ import annotations

from dataclasses import dataclass

from pairsim.runtime.arrays import Array


@dataclass(frozen=True)
class Place:
    """State at which a matrix was assembled; it determines the entries.

    Attributes:
        x: Full vector, shape (n,).
        star: Part of the full vector fixed by the time scheme, shape (n,); None for a Newtonian liquid.
        g: gamma dt.
        U_m: Velocity of the frame.
    """

    x: Array
    star: Array | None
    g: float
    U_m: float


@dataclass(frozen=True)
class MatrixState:
    """State that a solver keeps for its next solve.

    Attributes:
        places: State of the matrix that MUMPS analysed (ordering and scaling), and of the matrix factorised last.
        rate: Last rate of contraction with the factorised matrix.
        relaxation: Workspace of MUMPS above its estimate [%].
        single: Whether the factors are in single precision.
    """

    places: tuple[Place, Place]
    rate: float
    relaxation: int
    single: bool
