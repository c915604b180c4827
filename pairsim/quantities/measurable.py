"""Declarations of measurable quantities: keys of the `physical` block, from which parameters of a case follow."""

from __future__ import annotations

from dataclasses import dataclass, replace
from string import Formatter
from typing import Any, NamedTuple

from pairsim.quantities.kinds import LENGTH, PURE, TIME, VISCOSITY, VOLUME, Kind
from pairsim.quantities.scales import Scales


class Usual(NamedTuple):
    """The usual range of a quantity. A value outside it is remarked on, as its prefix may be wrong."""

    least: float  # in SI units
    most: float
    words: str  # the range in the units of a laboratory


MEAN, EACH = "mean", "each"
"""Keys of a quantity that differs among the particles: its mean, and its standard deviation among them."""
USUAL_VISCOSITY = Usual(1e-5, 1e5, "0.01 mPa.s to 100 kPa.s")
USUAL_TIME = Usual(1e-8, 1e5, "10 ns to 1e5 s")


@dataclass(frozen=True)
class Measurable:
    """A quantity that is measured.

    Attributes:
        key: Its key in the `physical` block, and the name of its option in `pairsim units` unless `short` is another.
        kind: What kind of quantity it is.
        words: What it is.
        example: A value with its unit, in which "{n}" stands for the same as in the unit of its kind.
        symbol: Its symbol (TeX), "" if it has none.
        gives: The dotted key of a case whose value it gives, and the names of this key in other kinds of cases; empty
            if it sets a scale, or if laws declare which of their parameters follow from it.
        inverse: Whether the number that it gives is inversely proportional to it: the unit of its kind over the
            quantity.
        times: Factor by which that number is multiplied.
        many: Whether it may be a list with one value for each particle.
        ranged: Whether it may be a list, or a range of values.
        uncertain: Whether it may have a half-width; derivatives of dU by the number that it gives must then be known.
        by: Name of the derivative with respect to it, such as "difference" in by_difference, if it gives no number of a
            case; else "".
        each: The dotted key of a case that its standard deviation among the particles, over its mean, gives; "" if it
            is the same for all.
        usual: Its usual range; None if any value is usual.
        as_volume: For a length of tube that may also be given as the volume that it holds: an example of such a volume;
            else "".
        if_several: Text that is added to the message if a list is given, such as what to write instead.
        in_captions: Whether it appears in captions.
        short: The name of its option, "" if that is its key.
        default: What `pairsim units` assumes if it is not given, in words.
    """

    key: str
    kind: Kind
    words: str
    example: str
    symbol: str = ""
    gives: tuple[str, ...] = ()
    inverse: bool = False
    times: float = 1.0
    many: bool = False
    ranged: bool = False
    uncertain: bool = False
    by: str = ""
    each: str = ""
    usual: Usual | None = None
    as_volume: str = ""
    if_several: str = ""
    in_captions: bool = True
    short: str = ""
    default: str = ""

    @property
    def deviation(self) -> Measurable:
        """Its standard deviation among the particles; in a case it is relative to the mean."""
        words = f"standard deviation of the {self.key} among particles that differ"
        return Measurable(f"{self.key}.{EACH}", PURE, words, self.example, gives=(self.each,))

    @property
    def volume(self) -> Measurable:
        """The volume that may be given in its place."""
        return Measurable(self.key, VOLUME, self.words, self.as_volume)

    @property
    def option(self) -> str:
        """Its option in `pairsim units`."""
        return f"--{self.short or self.key}".replace("_", "-")

    @property
    def unit(self) -> str:
        """Its SI unit, in which "{n}" stands for the parameter n of the law."""
        return self.kind.si

    def number(self, value: Any, scales: Scales) -> Any:
        """The number that follows from a value in SI units."""
        if self.inverse:
            return self.times * self.kind.unit(scales) / value
        return self.times * self.kind.number(value, scales)

    def size(self, viscosity: float) -> float:
        """The factor by which its number is multiplied to give the quantity in SI units, at U_av/D_c = 1/s.

        Args:
            viscosity: The unit of viscosity eta_0 [Pa s].
        """
        return 1 / float(self.number(1.0, Scales(1.0, 1.0, viscosity)))

    @property
    def of_unit(self) -> tuple[str, ...]:
        """Names of the parameters of the law on which the unit depends."""
        return tuple(name for _, name, _, _ in Formatter().parse(self.unit) if name)

    def with_parameters(self, numbers: dict[str, float]) -> Measurable:
        """This quantity with its unit at these parameters of the law; with no unit if it depends on a missing one."""
        if any(name not in numbers for name in self.of_unit):
            return replace(self, kind=replace(self.kind, si=""))
        return replace(
            self, kind=replace(self.kind, si=self.unit.format(**numbers)), example=self.example.format(**numbers)
        )


def a_length(key: str, words: str, example: str = "50 um", symbol: str = "", **more: Any) -> Measurable:
    """Declare a length, whose number is the length over D_c; `more` are further attributes."""
    return Measurable(key, LENGTH, words, example, symbol, **more)


def a_time(key: str, words: str, symbol: str = "", **more: Any) -> Measurable:
    """Declare a time, whose number is the time over D_c/U_av; `more` are further attributes."""
    return Measurable(key, TIME, words, "2 ms", symbol, **{"usual": USUAL_TIME, **more})


def a_viscosity(key: str, words: str, example: str = "1 mPa.s", symbol: str = "", **more: Any) -> Measurable:
    """Declare a viscosity, whose number is the viscosity over eta_0; `more` are further attributes."""
    return Measurable(key, VISCOSITY, words, example, symbol, **{"usual": USUAL_VISCOSITY, **more})
