"""Viscosity laws, of liquids and of solvents of viscoelastic liquids: the stress follows the present rate of strain.

The stress is 2 eta e(u), with the viscosity eta a function of the shear rate gamma = sqrt(2 e : e).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

from pairsim.physics.fields import Field
from pairsim.physics.material import LawField, Material, parameter
from pairsim.quantities.kinds import STRESS
from pairsim.quantities.measurable import Measurable, Usual, a_viscosity

# Shear rate [U_av/D_c] below which the viscosity is constant: that of a power law would be infinite at rest. Chosen;
# velocities change by less than 1e-7 between values of 1e-2 and 1e-6.
LEAST_RATE = 1e-6

ZERO_SHEAR = a_viscosity(
    "viscosity",
    "zero-shear viscosity of the liquid eta_0, including that of the solvent",
    "1 Pa.s",
    r"\eta_0",
    uncertain=True,
)


YIELD_STRESS = Measurable(
    "yield_stress",
    STRESS,
    "yield stress tau_y; gives Bn = tau_y D_c/(eta_0 U_av)",
    "5 Pa",
    r"\tau_y",
    usual=Usual(1e-4, 1e6, "0.1 mPa to 1 MPa"),
)


@dataclass(frozen=True)
class Plastic(Material):
    """Base of the laws with a yield stress."""

    fields: ClassVar = {"yielding": LawField(r"|\tau|/\tau_y", lambda law, tau, _: tau / law.yield_stress, level=1.0)}
    Bn: Any = parameter(r"\mathrm{Bn}", "Bingham number tau_y D_c/(eta_0 U_av)", 0.0, 1e4, dimension=YIELD_STRESS)

    @property
    def yield_stress(self) -> Any:
        """Stress [eta_0 U_av/D_c] up to which the liquid does not flow, except by the rounding of the kink."""
        return self.Bn


@dataclass(frozen=True)
class ViscousLaw(Material):
    """Viscosity as a function of the shear rate.

    Attributes:
        linear: Whether the viscosity is constant.
        transported: Transported scalar fields on which it depends; a law that has any is a `StructuredLaw`.
        measured: The quantity that gives the unit of viscosity eta_0, by `unit_viscosity`.
    """

    linear: ClassVar[bool] = False
    transported: ClassVar[tuple[Field, ...]] = ()
    measured: ClassVar[Measurable] = ZERO_SHEAR

    def viscosity(self, gamma2: Any) -> Any:
        """Viscosity over its unit.

        Args:
            gamma2: Square of the shear rate [(U_av/D_c)^2], above 0.
        """
        raise NotImplementedError

    @property
    def yield_stress(self) -> Any:
        """Stress [eta_0 U_av/D_c] up to which the liquid does not flow, except by the regularisation; 0 without one."""
        return 0.0

    def viscosity_at(self, gamma2: Any, *state: Any) -> Any:
        """Viscosity over its unit at a square of the shear rate, and at values of the transported scalars if any."""
        return self.viscosity(gamma2)

    @property
    def memory(self) -> Any:
        """Relaxation time of the transported scalars [D_c/U_av]; 0 without any."""
        return 0.0

    def easier(self) -> Self:
        """The same law with parameters for which Newton's method converges from a liquid at rest."""
        return self

    def unit_viscosity(self, value: float, rate: float) -> float:
        """The unit of viscosity eta_0 [Pa s].

        Args:
            value: What was measured, in SI units.
            rate: U_av/D_c [1/s].
        """
        return value
