"""Units of pairsim: lengths in tube diameters D_c, velocities in the mean velocity U_av, stresses in eta_0 U_av/D_c."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

TUBE_RADIUS = 0.5  # [D_c]
FLOW_RATE = pi / 4  # [U_av D_c^2]


@dataclass(frozen=True)
class Scales:
    """What the units of pairsim are in SI units.

    Attributes:
        length: Tube diameter D_c [m].
        velocity: Mean velocity U_av of the liquid in the tube without particles [m/s].
        viscosity: Zero-shear viscosity eta_0, that of the solvent included [Pa s].
    """

    length: float
    velocity: float
    viscosity: float

    @property
    def time(self) -> float:
        """D_c/U_av [s]."""
        return self.length / self.velocity

    @property
    def stress(self) -> float:
        """eta_0 U_av/D_c [Pa]."""
        return self.viscosity / self.time

    def reynolds(self, density: float) -> float:
        """Reynolds number rho U_av D_c/eta_0 at a density [kg/m^3]."""
        return density * self.velocity * self.length / self.viscosity


def mean_velocity(flow_rate: float, diameter: float) -> float:
    """U_av = 4 Q/(pi D_c^2) [m/s], from the flow rate Q [m^3/s] and the diameter D_c [m] of the tube."""
    return flow_rate / (FLOW_RATE * diameter**2)
