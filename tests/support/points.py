"""Points of curves without cells, whose dU are formulas."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from pairsim.physics.solids import soft
from pairsim.solvers.curves.point import Point
from pairsim.solvers.parameters import Parameters


@dataclass(frozen=True)
class MadePoint:
    """What of a `Point` curves are made of."""

    parameters: Parameters
    dUs: Any
    slopes: Any
    dU_errors: Any

    d, dU, zero_error = Point.d, Point.dU, Point.zero_error
    gaps = Point.gaps

    @property
    def discrete(self) -> Any:
        return SimpleNamespace(dU=self.dUs)

    @property
    def held_dUs(self) -> Any:
        return self.dUs

    @property
    def slope_at_rest(self) -> float:
        return float(self.slopes[0])

    @property
    def correction(self) -> Any:
        return np.zeros(len(self.dUs))


def made_point(d: float, dU: Any, slope: Any, error: float = 0.0) -> Any:
    """A point of which curves are made: dU and its slope of every gap, at the same distance."""
    dUs, slopes = np.atleast_1d(np.asarray(dU, dtype=float)), np.atleast_1d(np.asarray(slope, dtype=float))
    place = Parameters((d,) * len(dUs), soft(*(0.1,) * (len(dUs) + 1)))
    return MadePoint(place, dUs, slopes, np.full(len(dUs), error))
