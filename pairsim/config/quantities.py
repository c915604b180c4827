"""Physical quantities with units, such as 50 um, parsed with pint."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
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
        name: Its name in messages, with article.
        unit: Its SI unit; "" for one that is not known yet.
        example: A valid value, for messages.
    """

    name: str
    unit: str
    example: str

    @property
    def words(self) -> str:
        """What is allowed, for messages."""
        return f"{self.name} above 0 with its unit, such as {self.example}"


LENGTH = Kind("a length", "m", "50 um")
FLOW = Kind("a flow rate", "m^3/s", "1 ul/min")
VELOCITY = Kind("a velocity", "m/s", "5 mm/s")
STRESS = Kind("a modulus", "Pa", "5 kPa")
TIME = Kind("a time", "s", "2 ms")
DENSITY = Kind("a density", "kg/m^3", "1000 kg/m^3")


LONGEST = 100  # characters of a quantity
LEAST, MOST = 1e-30, 1e30  # limits of a quantity in its SI unit, whose products and ratios double precision can hold
QUANTITY = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\W\d_].*)")  # number and unit


@cache
def _registry() -> pint.UnitRegistry:
    import pint  # takes half a second; most cases have no units

    return pint.UnitRegistry()


def _parsed(text: str) -> tuple[float, pint.Unit]:
    """Split a text into number and unit. Products of units may be written with a point, as in Pa.s.

    Raises:
        ValueError: The text is not a number with a known unit; says why.
    """
    match = QUANTITY.fullmatch(text.strip()) if isinstance(text, str) and len(text) <= LONGEST else None
    if match is None:
        raise ValueError("has no unit" if _is_number(text) else "is not a number with a unit")
    number, unit = match.groups()
    try:
        return float(number), _registry().parse_units(re.sub(r"(?<=[^\W\d_])[.·](?=[^\W\d_])", "*", unit))
    except Exception:  # pint does not document which exceptions its parser raises
        raise ValueError(f"has the unknown unit {unit}") from None


def _is_number(value: Any) -> bool:
    try:
        float(value)
    except (TypeError, ValueError):
        return False
    except OverflowError:
        return True
    return True


def si(text: str, kind: Kind) -> float:
    """Convert a quantity to its SI unit.

    Args:
        text: Number and unit, such as "50 um".
        kind: The kind of quantity that is expected.

    Returns:
        The value in `kind.unit`.

    Raises:
        ValueError: It is not a positive quantity of this kind; says what is wrong and what is allowed.
    """
    try:
        number, unit = _parsed(text)
    except ValueError as error:
        raise ValueError(f"{error}; must be {kind.words}") from None
    if kind.unit and not unit.is_compatible_with(kind.unit):
        raise ValueError(f"has the unit {unit:~C}; must be {kind.words}")
    value = _in(kind.unit or unit, number, unit)
    if number <= 0 or math.isnan(value):
        raise ValueError(f"must be {kind.words}")
    if not LEAST <= value <= MOST:
        raise ValueError(f"must be from {LEAST:g} to {MOST:g} {kind.unit}")
    return value


def in_one_unit(texts: Sequence[str]) -> tuple[list[float], str]:
    """Quantities such as "2 ms" as numbers in the unit of the first one, and that unit.

    Raises:
        ValueError: One of them is not a number with a unit, or has one of another kind.
    """
    parsed = [_parsed(text) for text in texts]
    unit = parsed[0][1]
    if not all(other.is_compatible_with(unit) for _, other in parsed):
        raise ValueError("units must be of the same kind")
    return [_in(unit, number, other) for number, other in parsed], f"{unit:~P}"


def _in(unit: Any, number: float, given: pint.Unit) -> float:
    """Convert a number from the unit given to a compatible one; infinite if double precision cannot hold it."""
    try:
        return rounded(_registry().Quantity(number, given).to(unit).magnitude)
    except ArithmeticError:
        return math.inf


def rounded(value: float) -> float:
    """A converted number to fifteen digits: 50 um is 5e-05 m, not 4.9999999999999996e-05."""
    return float(f"{value:.15g}")


def quantity_range(described: Mapping[str, Any], most: int, spacing: str = "linear") -> list[str]:
    """Expand a range whose start and stop have units.

    Args:
        described: The range: start, stop, num and optionally spacing.
        most: Largest num allowed.
        spacing: Spacing if the range has none.

    Returns:
        The values as quantities, in the unit of `start`.

    Raises:
        ValueError: The range is invalid; says why.
    """
    ends = {}
    for key in ("start", "stop"):
        try:
            ends[key] = _parsed(described.get(key, ""))
        except ValueError as error:
            raise ValueError(f"{key} {error}") from None
    (start, unit), (stop, other) = ends["start"], ends["stop"]
    if not other.is_compatible_with(unit):
        raise ValueError("start and stop must have units of the same kind")
    values = spelled_out({**described, "start": start, "stop": _in(unit, stop, other)}, most, spacing)
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


def quantity(kind: Kind) -> Any:
    """The type of a key with a quantity."""
    return Annotated[str, _shown(kind), _checker(kind)]


Length = Annotated[str, _shown(LENGTH), _checker(LENGTH)]
FlowRate = Annotated[str, _shown(FLOW), _checker(FLOW)]
Velocity = Annotated[str, _shown(VELOCITY), _checker(VELOCITY)]
Modulus = Annotated[str, _shown(STRESS), _checker(STRESS)]
Time = Annotated[str, _shown(TIME), _checker(TIME)]
Density = Annotated[str, _shown(DENSITY), _checker(DENSITY)]


def _distances(value: Any) -> Any:
    """Validate a length, a list of lengths (or of lists, one length for each gap), or a range of lengths."""
    try:
        for text in distance_texts(value):
            for each in text if isinstance(text, tuple) else (text,):
                si(each, LENGTH)
    except ValueError as error:
        said = str(error) if LENGTH.words in str(error) else f"{error}; must be {LENGTH.words}"
        said += ", a list of these, or {start: 5 um, stop: 40 um, num: 9}"
        raise PydanticCustomError("quantity", "{said}", {"said": said}) from None
    return value


MOST_DISTANCES = 10_000


def distance_texts(value: Any) -> tuple[Any, ...]:
    """The distances given by `distance`, a single one, a list or a range, as quantities with units.

    Raises:
        ValueError: It is an invalid range.
    """
    if isinstance(value, dict):
        return tuple(quantity_range(value, MOST_DISTANCES, "log"))
    return value if isinstance(value, tuple) else (value,)


Distances = Annotated[
    str | tuple[str | tuple[str, ...], ...] | dict[str, Any],
    Field(json_schema_extra={"words": f"{LENGTH.words}, a list of these, or a range"}),
    BeforeValidator(_distances),
]
