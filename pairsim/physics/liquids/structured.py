"""Viscosity laws with a structure: transported scalars, which flow breaks down and rest restores.

The stress is 2 eta e(u) with eta a function of the shear rate gamma and of scalars l, each of which obeys

    Dl/Dt = f(gamma, l).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pairsim.physics.liquids.viscous import ViscousLaw


@dataclass(frozen=True)
class StructuredLaw(ViscousLaw):
    """Viscosity as a function of the shear rate and of the scalars that `transported` declares, in their order."""

    def viscosity_at(self, gamma2: Any, *state: Any) -> Any:
        """Viscosity over its unit.

        Args:
            gamma2: Square of the shear rate [(U_av/D_c)^2], above 0.
            *state: The scalars.
        """
        raise NotImplementedError

    def rates(self, gamma2: Any, *state: Any) -> tuple[Any, ...]:
        """Material derivatives Dl/Dt = f of the scalars [U_av/D_c]."""
        raise NotImplementedError

    def in_steady_shear(self, gamma2: Any) -> tuple[Any, ...]:
        """The scalars in steady shear, where their rates vanish."""
        raise NotImplementedError

    def viscosity(self, gamma2: Any) -> Any:
        """Viscosity in steady shear."""
        return self.viscosity_at(gamma2, *self.in_steady_shear(gamma2))
