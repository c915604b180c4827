"""White-Metzner liquid (White and Metzner 1963) with a relaxation time that thins as the law of Carreau."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pairsim.physics.liquids.conformation import ConformationLaw, Invariants
from pairsim.physics.material import parameter
from pairsim.quantities.measurable import a_time


@dataclass(frozen=True)
class WhiteMetzner(ConformationLaw):
    """De psi (upper-convected derivative of c) = -(c - I), psi = [1 + (Cu gamma)^2]^((n - 1)/2)."""

    name = "white-metzner"
    label = "White-Metzner"
    words = "relaxation time and viscosity fall with the shear rate as a flow curve says"

    n: Any = parameter("n", "flow index of the thinning part", 0.1, 1.0)
    Cu: Any = parameter(
        r"\mathrm{Cu}",
        "Carreau number: time constant times U_av/D_c",
        0.0,
        1e6,
        dimension=a_time("time_constant", "time constant of thinning, the inverse of the rate where it begins"),
    )

    def relaxation(self, at: Invariants) -> tuple[Any, Any, Any]:
        faster = (1 + self.Cu**2 * at.gamma2) ** ((1 - self.n) / 2)
        return -faster, faster, 0.0
