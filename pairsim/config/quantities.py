"""Quantities with units, such as 50 um, as users write them; pint parses them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from pairsim.config.ranges import spelled_out

if TYPE_CHECKING:
    import pint


@dataclass(frozen=True)
class Kind:
    """A kind of quantity.

    Attributes:
        name: What messages call it.
        unit: Its SI unit.
        example: A value as a user would write it.
    """

    name: str
    unit: str
    example: str

    @property
    def words(self) -> str:
        """What must be given."""
        return f"{self.name} above 0 with its unit, such as {self.example}"


LENGTH = Kind("a length", "m", "50 um")
FLOW = Kind("a flow rate", "m^3/s", "1 ul/min")
VELOCITY = Kind("a velocity", "m/s", "5 mm/s")
STRESS = Kind("a modulus", "Pa", "5 kPa")
VISCOSITY = Kind("a viscosity", "Pa*s", "1 Pa.s")
TIME = Kind("a time", "s", "2 ms")
DENSITY = Kind("a density", "kg/m^3", "1000 kg/m^3")


QUANTITY = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\W\d_].*)")  # a number and the rest


@cache
def _registry() -> pint.UnitRegistry:
    import pint  # takes half a second, and most cases have no units

    return pint.UnitRegistry()


def _parsed(text: str) -> tuple[float, pint.Unit]:
    """Number and unit of a text. Products of units may be written with a point, as in Pa.s.

    Raises:
        ValueError: In words, why it is none.
    """
    match = QUANTITY.fullmatch(text.strip()) if isinstance(text, str) else None
    if match is None:
        raise ValueError("has no unit" if _is_number(text) else "is no number with a unit")
    number, unit = match.groups()
    try:
        return float(number), _registry().parse_units(re.sub(r"(?<=[^\W\d_])[.·](?=[^\W\d_])", "*", unit))
    except Exception:  # the parser of pint raises whatever tokenize, its operators and its numbers do
        raise ValueError(f"has the unknown unit {unit}") from None


def _is_number(value: Any) -> bool:
    try:
        float(value)
    except (TypeError, ValueError):
        return False
    return True


def si(text: str, kind: Kind) -> float:
    """A quantity in its SI unit.

    Raises:
        ValueError: In words, what is wrong and what must be.
    """
    try:
        number, unit = _parsed(text)
    except ValueError as error:
        raise ValueError(f"{error}; must be {kind.words}") from None
    if not unit.is_compatible_with(kind.unit):
        raise ValueError(f"is not {kind.name} but has the unit {unit:~C}; must be {kind.words}")
    # Fifteen digits: 50 um is 5e-05 m, not 4.9999999999999996e-05.
    value = float(f"{_registry().Quantity(number, unit).to(kind.unit).magnitude:.15g}")
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"must be {kind.words}")
    return value


def quantity_range(described: Mapping[str, Any], most: int, spacing: str = "linear") -> list[str]:
    """The values of a range whose start and stop have units, as quantities in the unit of its start.

    Raises:
        ValueError: In words, what is wrong with it.
    """
    ends = {}
    for key in ("start", "stop"):
        try:
            ends[key] = _parsed(described.get(key, ""))
        except ValueError as error:
            raise ValueError(f"{key} {error}") from None
    (start, unit), (stop, other) = ends["start"], ends["stop"]
    if not other.is_compatible_with(unit):
        raise ValueError("start and stop have units of different kinds")
    converted = float(f"{_registry().Quantity(stop, other).to(unit).magnitude:.15g}")
    values = spelled_out({**described, "start": start, "stop": converted}, most, spacing)
    return [f"{value:.12g} {unit:~C}" for value in values]


def _checker(kind: Kind) -> BeforeValidator:
    def check(value: Any) -> Any:
        try:
            si(value, kind)
        except ValueError as error:
            raise PydanticCustomError("quantity", "{said}", {"said": str(error)}) from None
        return value

    return BeforeValidator(check)


def _shown(kind: Kind) -> Any:
    return Field(json_schema_extra={"words": kind.words, "examples": [kind.example]})


Length = Annotated[str, _shown(LENGTH), _checker(LENGTH)]
FlowRate = Annotated[str, _shown(FLOW), _checker(FLOW)]
Velocity = Annotated[str, _shown(VELOCITY), _checker(VELOCITY)]
Modulus = Annotated[str, _shown(STRESS), _checker(STRESS)]
Viscosity = Annotated[str, _shown(VISCOSITY), _checker(VISCOSITY)]
Time = Annotated[str, _shown(TIME), _checker(TIME)]
Density = Annotated[str, _shown(DENSITY), _checker(DENSITY)]


def _distances(value: Any) -> Any:
    """A length, a list of lengths (each perhaps a list, one a gap), or a range of them."""
    try:
        for text in distance_texts(value):
            for each in text if isinstance(text, tuple) else (text,):
                si(each, LENGTH)
    except ValueError as error:
        said = str(error) if "must be" in str(error) else f"{error}; must be {LENGTH.words}"
        said += ", a list of such, or {start: 5 um, stop: 40 um, num: 9}"
        raise PydanticCustomError("quantity", "{said}", {"said": said}) from None
    return value


MOST_DISTANCES = 10_000


def distance_texts(value: Any) -> tuple[Any, ...]:
    """The distances that a value of `distance` stands for, as quantities.

    Raises:
        ValueError: It is a range and none.
    """
    if isinstance(value, dict):
        return tuple(quantity_range(value, MOST_DISTANCES, "log"))
    return value if isinstance(value, tuple) else (value,)


Distances = Annotated[
    str | tuple[str | tuple[str, ...], ...] | dict[str, Any],
    Field(json_schema_extra={"words": f"{LENGTH.words}, a list of such, or a range of them"}),
    BeforeValidator(_distances),
]
