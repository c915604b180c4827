"""What a solver carries over from one solve to the next, in numbers that a checkpoint can hold."""

from __future__ import annotations

from dataclasses import dataclass

from pairsim.runtime.arrays import Array


@dataclass(frozen=True)
class Place:
    """What the values of a matrix depend on.

    Attributes:
        x: Full vector at which it was assembled.
        star: What the time scheme had fixed of it, None where no liquid remembers.
        g, U_m: gamma dt and the velocity of the frame.
    """

    x: Array
    star: Array | None
    g: float
    U_m: float


@dataclass(frozen=True)
class MatrixState:
    """What a solver carries over to its next solve.

    Attributes:
        places: Where the matrix was by whose values MUMPS ordered and scaled, and where the one in hand was.
        rate: Last rate of convergence with it.
        relaxation: Work space of MUMPS, in percent above its estimate.
    """

    places: tuple[Place, Place]
    rate: float
    relaxation: int
