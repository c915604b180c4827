"""The solution from which the columns that only one question has take their values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pairsim.solvers.curves.point import Point
    from pairsim.solvers.steady.scene import SteadySolver


@dataclass(frozen=True)
class Found:
    """A quasi-steady solution.

    Attributes:
        point: The values read from it: velocities, shapes, and the estimates of their errors.
        solver: Its solver, whose current state is this solution.
    """

    point: Point
    solver: SteadySolver
