"""Kelvin-Voigt solid: a neo-Hookean solid with a viscosity, as gels and cells have."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pairsim.physics.material import parameter
from pairsim.physics.solids.neo_hookean import NeoHookean
from pairsim.quantities.measurable import a_viscosity


@dataclass(frozen=True)
class KelvinVoigt(NeoHookean):
    """sigma = (B - I)/Ca_e + 2 eta e(v), with the velocity v of the material; the retardation time is eta Ca_e."""

    name = "kelvin-voigt"
    label = "Kelvin-Voigt"
    words = "neo-Hookean with a viscosity: the same shapes at rest, reached more slowly"

    eta: Any = parameter(
        r"\eta_v/\eta_0",
        "viscosity of the solid over eta_0",
        0.0,
        1e4,
        dimension=a_viscosity("particle_viscosity", "viscosity of the particles", "2 Pa.s", r"\eta_p"),
    )

    @property
    def viscosity(self) -> Any:
        return self.eta
