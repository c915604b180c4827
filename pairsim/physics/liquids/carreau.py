"""Carreau-Yasuda liquid (Carreau 1972; Yasuda, Armstrong and Cohen 1981)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

from pairsim.physics.liquids.viscous import ViscousLaw
from pairsim.physics.material import parameter
from pairsim.quantities.measurable import a_time, a_viscosity


@dataclass(frozen=True)
class Carreau(ViscousLaw):
    """eta/eta_0 = eta_inf + (1 - eta_inf) [1 + (Cu gamma)^a]^((n - 1)/a), gamma in units of U_av/D_c."""

    name = "carreau"
    label = "Carreau-Yasuda"
    words = "shear thinning between the viscosities eta_0 at rest and eta_inf at large shear rates"

    n: Any = parameter("n", "flow index of the thinning part", 0.1, 2.0)
    Cu: Any = parameter(
        r"\mathrm{Cu}",
        "Carreau number: time constant times U_av/D_c",
        1e-6,
        1e6,
        dimension=a_time("time_constant", "time constant of thinning, the inverse of the rate where it begins"),
    )
    a: Any = parameter("a", "exponent of the transition; 2 is the law of Carreau", 0.1, 10.0, default=2.0)
    eta_inf: Any = parameter(
        r"\eta_\infty",
        "viscosity at large shear rates over that at rest",
        0.0,
        1.0,
        default=0.0,
        dimension=a_viscosity("viscosity_inf", "viscosity at large shear rates", symbol=r"\eta_\infty"),
    )

    def viscosity(self, gamma2: Any) -> Any:
        thinned = (1 + (self.Cu**2 * gamma2) ** (self.a / 2)) ** ((self.n - 1) / self.a)
        return self.eta_inf + (1 - self.eta_inf) * thinned

    def easier(self) -> Self:
        return replace(self, n=min(max(self.n, 0.75), 1.3))
