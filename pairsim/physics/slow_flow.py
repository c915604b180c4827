"""The slow-flow limit of a viscoelastic liquid: the normal stress coefficients of a second-order fluid.

To first order in De every liquid with a fading memory and a viscosity that does not depend on the shear rate is a
second-order fluid, with Psi_1 = N_1/gamma^2 and Psi_2 = N_2/gamma^2 of slow steady shear (Bird, Armstrong and Hassager,
Dynamics of Polymeric Liquids 1, 1987, chapter 6).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from pairsim.physics.homogeneous import normal_stresses, steady_shear
from pairsim.physics.liquids import Liquid

SLOW = 1e-3  # Weissenberg number of slow shear: coefficients are off by about its square; chosen
RATES = np.linspace(0.1, 1.0, 10)  # shear rates, over the largest one, at which shear is compared with slow shear


@dataclass(frozen=True)
class SecondOrderFluid:
    """The normal stress coefficients of slow shear, in units of eta_0 D_c/U_av.

    Attributes:
        Psi_1: The first one; 2 (1 - xi) De of one mode of Oldroyd-B.
        Psi_2: The second one; -alpha/2 times that in a Giesekus liquid.
    """

    Psi_1: float = 0.0
    Psi_2: float = 0.0

    @classmethod
    def of(cls, liquid: Liquid) -> Self:
        """The coefficients of a liquid; both are 0 without modes."""
        if not liquid.modes:
            return cls()
        rate = SLOW / liquid.longest
        N1, N2 = normal_stresses(liquid, np.array([rate]))
        return cls(float(N1[0]) / rate**2, float(N2[0]) / rate**2)


def departure(liquid: Liquid, rate: float) -> float:
    """Largest relative difference of viscosity or first normal stress coefficient from slow shear, up to a shear rate.

    Args:
        liquid: The liquid.
        rate: The largest shear rate [U_av/D_c].
    """
    rates = rate * RATES
    viscosity, N1 = steady_shear(liquid, rates)
    largest = float(np.abs(viscosity - 1).max())
    if not liquid.modes:
        return largest
    slow = SecondOrderFluid.of(liquid).Psi_1
    return max(largest, float(np.abs(N1 / (slow * rates**2) - 1).max()))


def slower(liquid: Liquid, factor: float) -> Liquid:
    """The same liquid with De multiplied by a factor, as in a slower flow; other parameters are not changed."""
    return replace(liquid, De=factor * liquid.De) if liquid.modes else liquid
