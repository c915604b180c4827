"""Oldroyd-B liquid (Oldroyd 1950)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pairsim.physics.liquids.conformation import ConformationLaw, Invariants


@dataclass(frozen=True)
class OldroydB(ConformationLaw):
    """De (upper-convected derivative of c) = -(c - I)."""

    name = "oldroyd-b"
    label = "Oldroyd-B"
    words = "Hookean dumbbells: constant viscosity, unbounded stress in strong extension"

    def relaxation(self, at: Invariants) -> tuple[Any, Any, Any]:
        return -1.0, 1.0, 0.0
