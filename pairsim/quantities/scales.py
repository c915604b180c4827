"""Units of pairsim: lengths in tube diameters D_c, velocities in the mean velocity U_av, stresses in eta_0 U_av/D_c."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

TUBE_RADIUS = 0.5  # [D_c]
FLOW_RATE = pi / 4  # [U_av D_c^2]


@dataclass(frozen=True)
class Scales:
    """Conversion between the units of pairsim and SI units.

    Attributes:
        length: Tube diameter D_c [m].
        velocity: Mean velocity U_av of the liquid in the tube without particles [m/s].
        viscosity: Zero-shear viscosity eta_0 = eta_s + eta_p of the liquid [Pa s].
    """

    length: float
    velocity: float
    viscosity: float

    @property
    def time(self) -> float:
        """Unit of time, D_c/U_av [s]."""
        return self.length / self.velocity

    @property
    def stress(self) -> float:
        """Unit of stress, eta_0 U_av/D_c [Pa]."""
        return self.viscosity / self.time

    def reynolds(self, density: float) -> float:
        """Reynolds number rho U_av D_c/eta_0 of a liquid with the given density rho [kg/m^3]."""
        return density * self.velocity * self.length / self.viscosity


def cross_section(diameter: float) -> float:
    """Area pi D_c^2/4 of the cross-section of a tube of diameter D_c, in the square of its unit."""
    return FLOW_RATE * diameter**2


def mean_velocity(flow_rate: float, diameter: float) -> float:
    """Mean velocity U_av = 4 Q/(pi D_c^2) [m/s] for a flow rate Q [m^3/s] in a tube of diameter D_c [m]."""
    return flow_rate / cross_section(diameter)
