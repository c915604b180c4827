"""Giesekus liquid (Giesekus 1982), Eq. (5) of the paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pairsim.physics.liquids.conformation import LEAST_THINNING, ConformationLaw, Invariants
from pairsim.physics.material import parameter


@dataclass(frozen=True)
class Giesekus(ConformationLaw):
    """De (upper-convected derivative of c) = -[c - I + alpha (c - I)^2]."""

    name = "giesekus"
    label = "Giesekus"
    words = "anisotropic mobility: shear thinning, bounded stress in extension"
    default = True

    alpha: Any = parameter(r"\alpha", "mobility of the Giesekus liquid", 0.0, 1.0, default=0.2)

    def relaxation(self, at: Invariants) -> tuple[Any, Any, Any]:
        return self.alpha - 1, 1 - 2 * self.alpha, self.alpha

    @property
    def hardens(self) -> bool:
        return bool(self.alpha < LEAST_THINNING)
