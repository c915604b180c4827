"""Newtonian liquid: constant viscosity, Eq. (4) of the paper without the polymer stress."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pairsim.physics.liquids.viscous import ViscousLaw


@dataclass(frozen=True)
class Newtonian(ViscousLaw):
    """eta = eta_0."""

    name = "newtonian"
    label = "Newtonian"
    words = "constant viscosity"
    linear = True

    def viscosity(self, gamma2: Any) -> Any:
        return 1.0
