"""Power law of Ostwald and de Waele: eta = K gamma^(n - 1)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

from pairsim.physics.liquids.viscous import ViscousLaw
from pairsim.physics.material import parameter
from pairsim.quantities.kinds import Kind
from pairsim.quantities.measurable import Measurable


@dataclass(frozen=True)
class PowerLaw(ViscousLaw):
    """eta/eta_0 = (gamma D_c/U_av)^(n - 1), with the unit of viscosity eta_0 = K (U_av/D_c)^(n - 1)."""

    name = "power-law"
    label = "power law"
    words = "viscosity K gamma^(n - 1), without limits at small and large shear rates"
    measured = Measurable(
        "consistency",
        Kind("a consistency", "Pa*s^{n}"),
        "consistency K of the liquid; gives eta_0 = K (U_av/D_c)^(n - 1)",
        "0.5 Pa.s^{n}",
        "K",
    )

    n: Any = parameter("n", "flow index", 0.2, 2.0)

    def viscosity(self, gamma2: Any) -> Any:
        return gamma2 ** ((self.n - 1) / 2)

    def easier(self) -> Self:
        return replace(self, n=min(max(self.n, 0.75), 1.3))

    def unit_viscosity(self, value: float, rate: float) -> float:
        return value * rate ** (self.n - 1)
