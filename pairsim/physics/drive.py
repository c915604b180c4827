"""What drives the liquid and the particles. This module does not import numpy, since checks of case files use it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

PER_PARTICLE = {"per_particle": True}
"""Metadata of the fields of a dataclass that have a value for each particle, from upstream."""


@dataclass(frozen=True)
class Drive:
    """What drives the liquid and the particles. A case makes it, and its scene asks it.

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


def repeated[T](of: T, count: int) -> T:
    """A dataclass for `count` times as many particles: what it has for each of them is that of the same ones again."""
    each: Any = of
    of_particles = [one.name for one in fields(each) if one.metadata == PER_PARTICLE]
    return replace(each, **{name: getattr(of, name) * count for name in of_particles})
