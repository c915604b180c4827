"""What is declared of a quantity that is measured: a key of the `physical` block, and what a parameter follows from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from string import Formatter
from typing import Any, NamedTuple

from pairsim.quantities.kinds import LENGTH, PURE, TIME, VISCOSITY, VOLUME, Kind
from pairsim.quantities.scales import Scales


class Usual(NamedTuple):
    """What is usual of a quantity; others are remarked on, as one is whose prefix was misread."""

    least: float  # in SI units
    most: float
    words: str  # both in units of a bench


MEAN, EACH = "mean", "each"
"""What is given of a quantity that differs among the particles: its mean, and its standard deviation among them."""
USUAL_VISCOSITY = Usual(1e-5, 1e5, "0.01 mPa.s to 100 kPa.s")
USUAL_TIME = Usual(1e-8, 1e5, "10 ns to 1e5 s")


@dataclass(frozen=True)
class Measurable:
    """A quantity that is measured.

    Attributes:
        key: Its key in the `physical` block, and the name of its option in `pairsim units` unless `short` is another.
        kind: What kind of quantity it is.
        words: What it is.
        example: A value with its unit, in which "{n}" stands for what it does in the unit of its kind.
        symbol: Its symbol (TeX), "" if it has none.
        gives: The dotted key of a case that it stands for, and other names which that has in other kinds of cases; none
            if it sets a scale, or if laws say which of their parameters follow from it.
        inverse: Whether the number that it gives falls with it, as the unit of its kind over the quantity.
        times: What that number is multiplied by.
        many: Whether it may be a list with one value for each particle.
        ranged: Whether it may be a list, or a range of values.
        uncertain: Whether it may have a half-width, as there are derivatives of dU by what follows from it.
        by: The name of the derivative by it, such as "difference" of by_difference, where it is no number of a case.
        each: The dotted key of a case that its standard deviation among the particles gives, over its mean; "" where it
            is the same for all.
        usual: What is usual; None if all is.
        as_volume: An example of the volume as which a length of tube may be given, too: it is then the length in which
            the tube holds this volume. "" where it may not.
        if_several: What is added to the message of who gives a list, such as what to write instead.
        in_captions: Whether captions have it.
        short: The name of its option, "" if that is its key.
        default: What `pairsim units` takes where it is not given, in words.
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
        """Its standard deviation among the particles, in a case over its mean."""
        words = f"standard deviation of the {self.key} of each particle, which differ"
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
        """What its number is to be multiplied by for the quantity in SI units, at U_av/D_c = 1/s.

        Args:
            viscosity: The unit of viscosity eta_0 [Pa s].
        """
        return 1 / float(self.number(1.0, Scales(1.0, 1.0, viscosity)))

    @property
    def of_unit(self) -> tuple[str, ...]:
        """Names of the parameters that the unit depends on."""
        return tuple(name for _, name, _, _ in Formatter().parse(self.unit) if name)

    def with_parameters(self, numbers: dict[str, float]) -> Measurable:
        """With a unit for these parameters of the law, if it depends on some; without a unit if one is missing."""
        if any(name not in numbers for name in self.of_unit):
            return replace(self, kind=replace(self.kind, si=""))
        return replace(
            self, kind=replace(self.kind, si=self.unit.format(**numbers)), example=self.example.format(**numbers)
        )


def a_length(key: str, words: str, example: str = "50 um", symbol: str = "", **more: Any) -> Measurable:
    """A length, whose number is the length over D_c; `more` is what else is declared of it."""
    return Measurable(key, LENGTH, words, example, symbol, **more)


def a_time(key: str, words: str, symbol: str = "", **more: Any) -> Measurable:
    """A time, whose number is the time over D_c/U_av; `more` is what else is declared of it."""
    return Measurable(key, TIME, words, "2 ms", symbol, **{"usual": USUAL_TIME, **more})


def a_viscosity(key: str, words: str, example: str = "1 mPa.s", symbol: str = "", **more: Any) -> Measurable:
    """A viscosity, whose number is the viscosity over eta_0; `more` is what else is declared of it."""
    return Measurable(key, VISCOSITY, words, example, symbol, **{"usual": USUAL_VISCOSITY, **more})
