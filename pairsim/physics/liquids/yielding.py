"""Yield stresses of viscoelastic liquids (Saramito 2007, 2009): below them nothing relaxes, and the liquid is elastic.

The relaxation of a mode of any law is multiplied by a factor kappa, which depends on the deviatoric stress tau_d of the
polymer and vanishes up to |tau_d| = tau_y, with |tau_d|^2 = tau_d : tau_d/2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pairsim.physics.liquids.viscous import Plastic
from pairsim.physics.material import parameter
from pairsim.physics.operations import sqrt


@dataclass(frozen=True)
class YieldLaw(Plastic):
    """A law by which a yield stress stops the relaxation of a polymer."""

    width: Any = parameter("w", "width of the blunted kink over the yield stress", 1e-6, 1.0, default=1e-3)

    def factor(self, tau: Any) -> Any:
        """The factor kappa of the relaxation at |tau_d| > 0 [eta_0 U_av/D_c]."""
        raise NotImplementedError

    def excess(self, tau: Any) -> Any:
        """max(0, |tau_d| - Bn) with a rounded kink: Bn w at |tau_d| = Bn, about Bn w^2 at rest; exact at Bn = 0."""
        over = tau - self.Bn
        return (over + sqrt(over**2 + (2 * self.width * self.Bn) ** 2)) / 2


@dataclass(frozen=True)
class Saramito2007(YieldLaw):
    """kappa = max(0, 1 - Bn/|tau_d|) (J. Non-Newtonian Fluid Mech. 145, 1, 2007)."""

    name = "saramito-2007"
    label = "Saramito"
    words = "elastic solid below the yield stress, constant plastic viscosity above"

    def factor(self, tau: Any) -> Any:
        return self.excess(tau) / tau


@dataclass(frozen=True)
class Saramito2009(YieldLaw):
    """kappa = max(0, (|tau_d| - Bn)/(k |tau_d|^n))^(1/n) (J. Non-Newtonian Fluid Mech. 158, 154, 2009)."""

    name = "saramito-2009"
    label = "Saramito-Herschel-Bulkley"
    words = "elastic solid below the yield stress, a power law above: |tau| = Bn + k [(1 - xi) gamma]^n in shear"

    n: Any = parameter("n", "flow index", 0.2, 2.0)
    k: Any = parameter("k", "consistency, in units that make it 1 at n = 1", 1e-6, 1e6, default=1.0)

    def factor(self, tau: Any) -> Any:
        return (self.excess(tau) / self.k) ** (1 / self.n) / tau
