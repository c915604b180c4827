"""What the own columns of a question take their values of."""

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
        point: What was read off it: velocities, shapes, and the estimates of their errors.
        solver: Its solver, which is at this solution.
    """

    point: Point
    solver: SteadySolver
