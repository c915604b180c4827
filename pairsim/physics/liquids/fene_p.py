"""FENE-P liquid: finitely extensible dumbbells with the closure of Peterlin (Bird, Dotson and Johnson 1980)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pairsim.physics.liquids.conformation import ConformationLaw, Invariants
from pairsim.physics.material import parameter


@dataclass(frozen=True)
class FeneP(ConformationLaw):
    """De (upper-convected derivative of c) = -(F c - I), tau = G (F c - I), F = (L2 - 3)/(L2 - tr c)."""

    name = "fene-p"
    label = "FENE-P"
    words = "finitely extensible dumbbells: shear thinning, large but bounded stress in extension"

    L2: Any = parameter("L^2", "largest trace of the conformation tensor", 3.0, 1e9, open=True)

    def relaxation(self, at: Invariants) -> tuple[Any, Any, Any]:
        return -1.0, self._spring(at), 0.0

    def stress(self, at: Invariants) -> tuple[Any, Any]:
        return -1.0, self._spring(at)

    def _spring(self, at: Invariants) -> Any:
        return (self.L2 - 3) / (self.L2 - at.trace)

    @property
    def largest_trace(self) -> Any:
        return self.L2
