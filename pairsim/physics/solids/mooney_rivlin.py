"""Mooney-Rivlin solid (Mooney 1940; Rivlin 1948)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pairsim.physics.material import parameter
from pairsim.physics.solids.solid import Solid


@dataclass(frozen=True)
class MooneyRivlin(Solid):
    """W = [(1 - c) (I_1 - 3) + c (I_2 - 3)]/2."""

    name = "mooney-rivlin"
    label = "Mooney-Rivlin"
    words = "rubber at larger strains: softer in extension and stiffer in compression than neo-Hookean"

    c: Any = parameter("c", "part of the second invariant in the shear modulus", 0.0, 1.0)

    def response(self, I1: Any, I2: Any) -> tuple[Any, Any]:
        return 1 - self.c, -self.c
