"""Neo-Hookean solid: the exact time integral of Eq. (7) of the paper from a stress-free state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pairsim.physics.solids.solid import Solid


@dataclass(frozen=True)
class NeoHookean(Solid):
    """W = (I_1 - 3)/2."""

    name = "neo-hookean"
    label = "neo-Hookean"
    words = "stress linear in B, as rubber at moderate strains"
    default = True

    def response(self, I1: Any, I2: Any) -> tuple[Any, Any]:
        return 1, 0
