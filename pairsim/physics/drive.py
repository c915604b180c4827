"""What drives the liquid and the particles. This module does not import numpy, since checks of case files use it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Drive:
    """What drives the liquid and the particles.

    Attributes:
        flow: Mean velocity of the liquid in the tube [U_av], which it defines; 0 for a liquid at rest.
        velocity: Prescribed velocity of all particles, which are rigid [U_av]; None if no force acts on them.
        boundary: Velocity on the wall and on prescribed ends as a function of points (z, r), (k, 2) -> (k, 2), in place
            of that of a developed flow; None in a tube.
    """

    flow: float = 1.0
    velocity: float | None = None
    boundary: Callable[[Any], Any] | None = None

    @property
    def free(self) -> bool:
        """Whether no force acts on the particles."""
        return self.velocity is None


DEVELOPED = Drive()
"""A developed flow, which carries the particles along."""
