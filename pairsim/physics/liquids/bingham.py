"""Bingham liquid (Bingham 1922), regularised by Papanastasiou (1987)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

from pairsim.physics.liquids.viscous import ZERO_SHEAR, Plastic, ViscousLaw
from pairsim.physics.material import parameter
from pairsim.physics.operations import expm1, sqrt

NEARLY_NEWTONIAN = 0.01  # m from which solutions are continued; at .1 the first one is not always found


@dataclass(frozen=True)
class Bingham(Plastic, ViscousLaw):
    """eta/eta_0 = 1 + Bn [1 - exp(-m gamma)]/gamma, with eta_0 the plastic viscosity."""

    name = "bingham"
    label = "Bingham"
    words = "solid below a yield stress, constant plastic viscosity above"
    measured = replace(
        ZERO_SHEAR,
        key="plastic_viscosity",
        words="plastic viscosity of the liquid; gives eta_0",
        symbol=r"\eta_p",
        uncertain=False,
    )
    regularisation = "m"

    m: Any = parameter(
        "m",
        "regularisation, a time over D_c/U_av: unyielded liquid has the viscosity eta_0 Bn m",
        1e-3,
        1e6,
        default=1000.0,
    )

    def viscosity(self, gamma2: Any) -> Any:
        gamma = sqrt(gamma2)
        return self.flowing(gamma2) - self.Bn * expm1(-self.m * gamma) / gamma

    def flowing(self, gamma2: Any) -> Any:
        """The viscosity without the contribution of the yield stress."""
        return 1.0

    def easier(self) -> Self:
        return replace(self, m=min(self.m, NEARLY_NEWTONIAN))
