"""What drives the liquid and the particles. This module does not import numpy, since checks of case files use it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from math import inf
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pairsim.physics.waveform import Waveform

PER_PARTICLE = {"per_particle": True}
"""Metadata of a dataclass field that has one value for each particle, from upstream."""


@dataclass(frozen=True)
class Drive:
    """What drives the liquid and the particles; made by a case, and read by its scene.

    Attributes:
        flow: Mean velocity of the liquid in the tube [U_av]: 1 by the definition of U_av, 0 for a liquid at rest. If
            the flow varies in time, its value at t = 0.
        velocity: Prescribed velocity of all particles, which are rigid [U_av]; None if they move freely.
        boundary: Velocity on the wall and on prescribed ends as a function of points (z, r), (k, 2) -> (k, 2), in place
            of that of a developed flow; None in a tube.
        waveform: The mean velocity of the liquid [U_av] over time [D_c/U_av]; None if it is constant.
    """

    flow: float = 1.0
    velocity: float | None = None
    boundary: Callable[[Any], Any] | None = None
    waveform: Waveform | None = None

    @classmethod
    def varying(cls, waveform: Waveform) -> Drive:
        """A flow that varies in time."""
        return cls(flow=waveform.at(0.0), waveform=waveform)

    @property
    def is_flow_alone(self) -> bool:
        """Whether a flow of constant mean velocity 1 is the only drive; zeros for all particles do not count."""
        per_particle = (one.name for one in fields(self) if one.metadata == PER_PARTICLE)
        without: dict[str, Any] = {name: () for name in per_particle if not any(getattr(self, name))}
        return replace(self, **without) == type(self)()

    @property
    def free(self) -> bool:
        """Whether the particles move freely, that is, their velocities are not prescribed."""
        return self.velocity is None

    @property
    def varies(self) -> bool:
        """Whether the flow varies in time."""
        return self.waveform is not None

    def flow_at(self, t: float) -> float:
        """Mean velocity of the liquid at a time [U_av]; at a jump, its value before the jump."""
        return self.flow if self.waveform is None else self.waveform.at(t)

    def next_kink(self, t: float) -> float:
        """The first time after t at which the flow jumps or has a kink [D_c/U_av]; infinite if there is none."""
        return inf if self.waveform is None else self.waveform.next_kink(t)

    @property
    def largest(self) -> float:
        """Largest absolute value of the flow [U_av]."""
        return abs(self.flow) if self.waveform is None else self.waveform.largest

    def constant(self, flow: float) -> Drive:
        """This drive with a flow that does not vary [U_av]."""
        return replace(self, flow=flow, waveform=None)


DEVELOPED = Drive()
"""A developed flow, which carries the particles along."""


def repeated[T](of: T, count: int) -> T:
    """A copy of a dataclass for `count` times as many particles: fields marked `PER_PARTICLE` are repeated."""
    each: Any = of
    of_particles = [one.name for one in fields(each) if one.metadata == PER_PARTICLE]
    return replace(each, **{name: getattr(of, name) * count for name in of_particles})
