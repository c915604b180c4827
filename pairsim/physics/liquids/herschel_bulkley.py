"""Liquid of Herschel and Bulkley (1926): a power law above a yield stress, regularised as the Bingham liquid."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

from pairsim.physics.liquids.bingham import Bingham
from pairsim.physics.liquids.power_law import PowerLaw
from pairsim.physics.material import parameter


@dataclass(frozen=True)
class HerschelBulkley(Bingham):
    """eta/eta_0 = gamma^(n - 1) + Bn [1 - exp(-m gamma)]/gamma, with eta_0 = K (U_av/D_c)^(n - 1)."""

    name = "herschel-bulkley"
    label = "Herschel-Bulkley"
    words = "solid below a yield stress, a power law above"
    measured = PowerLaw.measured

    n: Any = parameter("n", "flow index", 0.2, 2.0)

    def flowing(self, gamma2: Any) -> Any:
        return PowerLaw(n=self.n).viscosity(gamma2)

    def easier(self) -> Self:
        return replace(super().easier(), n=PowerLaw(n=self.n).easier().n)

    def unit_viscosity(self, value: float, rate: float) -> float:
        return PowerLaw(n=self.n).unit_viscosity(value, rate)
