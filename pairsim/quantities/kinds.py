"""Kinds of quantities: how numbers of pairsim convert to SI units, and to the units in which they are shown.

A number is the quantity divided by its unit in pairsim, which is a product of powers of the scales: a length is divided
by D_c.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from pairsim.quantities.quantity import Quantity
from pairsim.quantities.scales import Scales

SCALES = "stress", "viscosity", "velocity", "time", "length"
"""The scales whose powers make up a unit, in the order in which they are multiplied."""


@dataclass(frozen=True)
class Kind:
    """A kind of quantity.

    Attributes:
        words: What it is, with article.
        si: Its SI unit, "" for a pure number; "{n}" in it stands for the parameter n of the law that it belongs to.
        name: The unit of its number in pairsim, such as D_c; "" for a pure number.
        physical: The unit in which it is shown in an experiment, such as um.
        per_si: Number of these units in its SI unit, such as 1e6 for um.
        signed: Whether it may also be 0 or negative. Derivatives of a result are then taken with respect to the
            quantity itself, not to its logarithm.
        stress: Power of the unit of stress eta_0 U_av/D_c in the unit of its number.
        viscosity: Power of eta_0 there.
        velocity: Power of U_av there.
        time: Power of D_c/U_av there.
        length: Power of D_c there.
    """

    words: str = "a number"
    si: str = ""
    name: str = ""
    physical: str = ""
    per_si: float = 1.0
    signed: bool = False
    stress: int = 0
    viscosity: int = 0
    velocity: int = 0
    time: int = 0
    length: int = 0

    @property
    def tex(self) -> str:
        return self.name.replace("eta_0", r"\eta_0").replace("U_av", "U_{av}")

    def unit(self, scales: Scales) -> Any:
        """The unit of its number, in SI units."""
        return self._times_unit(1.0, scales)

    def number(self, value: Any, scales: Scales) -> Any:
        """The dimensionless number of a value in SI units."""
        return value / self.unit(scales)

    def factor(self, scales: Scales | None) -> Any:
        """The factor from its number to the unit in which it is shown; 1 without scales."""
        return 1.0 if scales is None else self._times_unit(self.per_si, scales)

    def __call__(
        self, value: float | Iterable[float], form: str = ".4g", *, error: float = 0.0, named: bool = False
    ) -> Quantity:
        """A quantity of this kind, for use in a message.

        Args:
            value: The number, or several in a list.
            form: How it is written without units, as in an f-string.
            error: Half-width of its interval, left out where it is 0.
            named: Whether the text without units has the name of the dimensionless unit, such as D_c.
        """
        texts = tuple(f"{each:{form}}" for each in (value if isinstance(value, Iterable) else (value,)))
        if error:
            return Quantity(self, (*texts, f"{error:.2g}"), " +- ", named)
        return Quantity(self, texts, named=named)

    def _times_unit(self, value: Any, scales: Scales) -> Any:
        for scale in SCALES:
            size, power = getattr(scales, scale), getattr(self, scale)
            if power:
                value = value * size**power if power > 0 else value / size**-power
        return value


PURE = Kind()
TIME = Kind("a time", "s", "D_c/U_av", "s", time=1)
LENGTH = Kind("a length", "m", "D_c", "um", 1e6, length=1)
POSITION = replace(LENGTH, physical="mm", per_si=1e3)
VELOCITY = Kind("a velocity", "m/s", "U_av", "um/s", 1e6, velocity=1)
FLOW_RATE = Kind("a flow rate", "m^3/s", "U_av D_c^2", "nl/s", 1e12, velocity=1, length=2)
STRESS = Kind("a stress", "Pa", "eta_0 U_av/D_c", "Pa", stress=1)
MODULUS = replace(STRESS, words="a modulus")
PRESSURE = replace(STRESS, words="a pressure")
VISCOSITY = Kind("a viscosity", "Pa*s", "eta_0", "Pa.s", viscosity=1)
DENSITY = Kind("a density", "kg/m^3", physical="kg/m^3")
RATE = Kind("a rate", "1/s", "U_av/D_c", "1/s", time=-1)
PRESSURE_RATE = Kind("a pressure per displacement", "Pa/m", "eta_0 U_av/D_c^2", "Pa/um", 1e-6, stress=1, length=-1)
AREA = Kind("an area", "m^2", "D_c^2", "um^2", 1e12, length=2)
VOLUME = Kind("a volume", "m^3", "D_c^3", "um^3", 1e18, length=3)
LIQUID_VOLUME = replace(VOLUME, physical="nl", per_si=1e12)
FORCE = Kind("a force", "N", "eta_0 U_av D_c", "nN", 1e9, stress=1, length=2)
SECONDS = Kind("a time", "s", "s", "s")
"""Computing time, which does not depend on the scales of an experiment."""
PERCENTAGE = Kind("a percentage", "%", physical="%", per_si=100.0, signed=True)
