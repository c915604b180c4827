"""Physical quantities with units, such as 50 um or 1.5 +- 0.3 kPa, parsed with pint."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator

from pairsim.cases.unit_registry import registry
from pairsim.cases.values import Positive, Range, listed, several, spelled_out
from pairsim.quantities.kinds import PERCENTAGE, TIME
from pairsim.quantities.measurable import Measurable, a_length
from pairsim.runtime.errors import Argument, InputError

if TYPE_CHECKING:
    import pint

LEAST, MOST = 1e-30, 1e30  # limits of a quantity in its SI unit, whose products and ratios double precision can hold
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
QUANTITY = re.compile(rf"({NUMBER})\s*((?:1\s*/\s*)?[^\W\d_].*)")  # number and unit
PERCENT = re.compile(rf"({NUMBER})?\s*%?\s*(?:(?:\+-|\+/-|±)\s*({NUMBER})\s*)?%?")
POINTS = ".·⋅∙•"  # of products of units
PLUS_MINUS = re.compile(r"\+-|\+/-|±")
COMMON = {
    "m": {"nm": 1e-9, "um": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0},
    "s": {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0},
    "Pa": {"Pa": 1.0, "kPa": 1e3},
    "Pa*s": {"mPa.s": 1e-3, "Pa.s": 1.0},
    "m/s": {"um/s": 1e-6, "mm/s": 1e-3, "cm/s": 1e-2, "m/s": 1.0},
    "m^3/s": {"nl/min": 1.6666666666666673e-14, "ul/min": 1.666666666666667e-11, "ml/h": 2.777777777777778e-10},
    "m^3": {"pl": 1.0000000000000003e-15, "nl": 1.0000000000000004e-12, "ul": 1.0000000000000003e-09},
    "kg/m^3": {"kg/m^3": 1.0},
}
"""Common units in SI units, with pint's values: loading pint for them would take longer than an answer of an atlas."""
MEASURING = {
    "[length]": {"meter", "micron", "angstrom", "inch", "thou", "foot", "yard", "mile"},
    "[time]": {"second", "minute", "hour", "day", "week"},
    "[length] ** 3": {"liter", "cubic_centimeter", "gallon", "fluid_ounce"},
    "[length] / [time]": {"meter_per_second", "kilometer_per_hour", "mile_per_hour"},
    "[length] ** 3 / [time]": set(),
}
"""Units with names of their own that are used in a laboratory. Pint has more, some under names with another meaning
there: pc is a parsec, pt a pint, cp a cup, fps a foot per second, pa a picoyear."""
METRIC = {"meter", "second", "liter"}
LARGE = "mega", "giga", "tera", "peta", "exa", "zetta", "yotta", "ronna", "quetta"


A_LENGTH = a_length("length", "length")
"""Any length."""


def _parsed(text: Any) -> tuple[float, pint.Unit]:
    """Number and unit of a text, such as 2 Pa.s with a point for the product; ValueError for any other text."""
    match = QUANTITY.fullmatch(text.strip()) if isinstance(text, str) else None
    if match is None:
        raise ValueError("is not a number with a unit")
    number, unit = match.groups()
    if "," in unit:
        several = ", ".join(each.strip() for each in text.split(","))
        raise ValueError(f"is more than one quantity; where several are allowed, they are a list, [{several}]")
    if unit.endswith("Pas"):  # which pint would read as a plural of Pa
        raise ValueError(f"has the unit {unit}, which is written {unit[:-1]}.s")
    return float(number), _unit(re.sub(rf"(?<=[\w])[{POINTS}](?=[^\W\d_])", "*", unit), unit)


def _unit(text: str, given: str) -> pint.Unit:
    """A unit that is used in a laboratory; ValueError for others, and for those that pint does not know."""
    units = registry()
    try:
        unit = units.parse_units(re.sub(r"(?<=[^\W\d_])(-?\d+)(?!\w)", r"^\1", text))  # kg/m3 and s-1
        parts = {name: units.parse_unit_name(name)[0] for name in dict(unit._units)}
    except Exception:  # pint does not document which exceptions its parser raises
        raise ValueError(f"has the unknown unit {given}") from None
    printed = units.get_group("Printer").members
    for name, (prefix, root, _) in parts.items():
        if root in printed:
            raise ValueError(f"has the unit {given}, which is a unit of screens and print, not of what a camera sees")
        known = MEASURING.get(str(units.get_dimensionality(root)))
        prefixed = prefix and not (root in METRIC and prefix not in LARGE)
        if known is not None and (root not in known or prefixed):
            raise ValueError(f"has the unit {given}, which stands for {name.replace('_', ' ')} and is not accepted")
    return unit


def _in_common(text: Any, unit: str) -> float | None:
    """Convert a quantity in a unit of `COMMON` to the SI unit `unit`; None for other units, or if it is no quantity."""
    match = QUANTITY.fullmatch(text.strip()) if isinstance(text, str) else None
    factor = COMMON.get(unit, {}).get(match[2]) if match is not None else None
    return None if match is None or factor is None else rounded(float(match[1]) * factor)


def _in(unit: Any, number: float, given: pint.Unit) -> float:
    """Convert a number from the unit given to a compatible one; infinite if double precision cannot hold it."""
    try:
        return rounded(registry().Quantity(number, given).to(unit).magnitude)
    except ArithmeticError:
        return math.inf


def rounded(value: float) -> float:
    """A converted number to fifteen digits: 50 um is 5e-05 m, not 4.9999999999999996e-05."""
    return float(f"{value:.15g}")


def si(text: Any, of: Measurable) -> float:
    """Convert a quantity that is above 0 to its SI unit.

    Raises:
        ValueError: It is not a quantity of this kind; says what is wrong and what is allowed.
    """
    allowed = f"must be {of.kind.words} above 0 with its unit, such as {of.example}"
    allowed += f", or {of.volume.kind.words}, such as {of.as_volume}" if of.as_volume else ""
    if isinstance(text, list | tuple):
        raise ValueError(f"is a list; {allowed}{of.if_several}")
    if (value := _in_common(text, of.unit)) is None:
        try:
            number, unit = _parsed(text)
        except ValueError as error:
            raise ValueError(f"{error}; {allowed}") from None
        if of.unit and not unit.is_compatible_with(of.unit):
            raise ValueError(f"has the unit {unit:~C}; {allowed}")
        value = _in(of.unit or unit, number, unit)
    if value <= 0:
        raise ValueError(allowed)
    if not LEAST <= value <= MOST:
        raise ValueError(f"must be from {LEAST:g} to {MOST:g} {of.unit}")
    return value


def measured(text: Any, of: Measurable) -> tuple[float, float]:
    """Convert a quantity that may have a half-width to its SI unit: 1.5 +- 0.3 kPa, 1.5 kPa +- 300 Pa, 8 ms +- 20 %.

    A percentage, such as 0 +- 1 %, becomes a fraction.

    Returns:
        The quantity, and the half-width of its 95 % interval, 0 if none is given.

    Raises:
        ValueError: As for `si` or `percentage`, or the half-width is not a quantity of this kind, or not smaller than
            the value.
    """
    if of.kind == PERCENTAGE:
        return percentage(text)
    value, half = _halves(text)
    number = si(value, of)
    if half is None:
        return number, 0.0
    relative = re.fullmatch(rf"({NUMBER})\s*%", half)
    half_width = number * float(relative[1]) / 100 if relative else si(half, of)
    if not 0 < half_width < number:
        raise ValueError(f"must have a half-width below its value, such as {of.example} +- 10 %")
    return number, half_width


def percentage(text: Any) -> tuple[float, float]:
    """A percentage of either sign as a fraction, and the half-width of its 95 % interval, 0 if none is given.

    Raises:
        ValueError: It is not a percentage between -100 % and 100 %.
    """
    match = _percent(text)
    if match is not None and any(match.groups()):
        value, half_width = (float(each or 0) / 100 for each in match.groups())
        if abs(value) < 1 and 0 <= half_width < 1:
            return value, half_width
    raise ValueError(
        "must be a percentage between -100 % and 100 %, such as 0.5 %, or 0 +- 0.5 % if only a bound is known"
    )


def as_given(text: str) -> tuple[float, str]:
    """The value of a quantity in the unit in which it is given, and this unit; a half-width is ignored.

    Raises:
        ValueError: The text is not a quantity.
    """
    if (percent := _percent(text)) is not None:
        return float(percent[1] or 0), PERCENTAGE.si
    value = _halves(text)[0]
    match = QUANTITY.fullmatch(value.strip())
    if match is not None and any(match[2] in units for units in COMMON.values()):
        return float(match[1]), match[2]
    number, unit = _parsed(value)
    return number, f"{unit:~C}".replace("\N{GREEK SMALL LETTER MU}", "u").replace("*", ".")


def _percent(text: Any) -> re.Match[str] | None:
    """The match of the value and the half-width of a percentage; None for any other text."""
    return PERCENT.fullmatch(text.strip()) if isinstance(text, str) and "%" in text else None


def _halves(text: Any) -> tuple[Any, str | None]:
    """The texts on both sides of +-; a side without a unit gets that of the other. The second is None without +-."""
    if not isinstance(text, str) or len(sides := PLUS_MINUS.split(text.replace("(", "").replace(")", ""))) != 2:
        return text, None
    value, half = map(str.strip, sides)
    if re.fullmatch(NUMBER, value) and (match := QUANTITY.fullmatch(half)):
        value = f"{value} {match[2]}"
    elif re.fullmatch(NUMBER, half) and (match := QUANTITY.fullmatch(value)):
        half = f"{half} {match[2]}"
    return value, half


def is_in(text: Any, unit: str) -> bool:
    """Whether a text is a quantity of the kind of this SI unit, with a half-width or without."""
    value = _halves(text)[0]
    match = QUANTITY.fullmatch(value.strip()) if isinstance(value, str) else None
    common = [each for each, units in COMMON.items() if match is not None and match[2] in units]
    if match is None or common:
        return unit in common
    try:
        return bool(_parsed(value)[1].is_compatible_with(unit))
    except ValueError:
        return False


def has_half_width(text: object) -> bool:
    """Whether a quantity is given with the half-width of its interval."""
    return isinstance(text, str) and PLUS_MINUS.search(text) is not None


def suited(value: float, unit: str) -> tuple[str, float]:
    """The unit of `COMMON` in which a value in SI units reads best, such as ms for 0.008 s, and its size in these."""
    known = [each for each in COMMON.get(unit, {}).items() if each[0] != "min"] or [(unit.replace("*", "."), 1.0)]
    return max((each for each in known if each[1] <= 2 * abs(value)), key=lambda each: each[1], default=known[0])


def unit_in(other: str, unit: str) -> float:
    """The size of `unit` in the unit `other`: 0.001 for ms in s.

    Raises:
        ValueError: `unit` is not a unit, or of another kind.
    """
    try:
        return float(registry().Quantity(1.0, _unit(unit, unit)).to(other).magnitude)
    except Exception:  # pint does not document which exceptions its parser raises
        raise ValueError(f"is not a unit of the kind of {other}") from None


def seconds_of(budget: str | None) -> float | None:
    """A budget such as "10min" in seconds; None stays None.

    Raises:
        InputError: It is not a time.
    """
    if budget is None:
        return None
    try:
        return si(budget, Measurable("budget", TIME, "budget", "10 min"))
    except ValueError as error:
        raise InputError(Argument("budget"), "", budget, str(error)) from None


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


def numbers_in_one_unit(texts: Sequence[Any]) -> tuple[list[float], str]:
    """Quantities without their half-widths as numbers in one unit, see `in_one_unit`; percentages are numbers in %.

    Raises:
        ValueError: As for `in_one_unit`.
    """
    percentages = [match for match in map(_percent, texts) if match is not None]
    if percentages and len(percentages) == len(texts):
        return [float(match[1] or 0) for match in percentages], PERCENTAGE.physical
    return in_one_unit([_halves(text)[0] for text in texts])


def quantity_range(described: Range[Any]) -> list[str]:
    """The values of a range whose ends have units, as quantities in the unit of `start`.

    Raises:
        ValueError: An end is not a number with a unit, or both have units of different kinds.
    """
    ends, _ = in_one_unit([described.start, described.stop])
    numbers = described.model_copy(update=dict(zip(("start", "stop"), ends, strict=True)))
    unit = _parsed(described.start)[1]
    return [f"{value:.12g} {unit:~C}" for value in spelled_out(numbers)]


def _listed(value: Any) -> Any:
    return tuple(quantity_range(value)) if isinstance(value, Range) and isinstance(value.start, str) else listed(value)


def _refuse_group(value: Any) -> Any:
    """Raise a ValueError for a group in place of values, as when a dotted key is written as a group."""
    if isinstance(value, Mapping) and not value.keys() & Range.model_fields.keys():
        dotted = "a key in a group is written with a dot, such as physical.flow_rate: [1 ul/min, 2 ul/min]"
        raise ValueError(f"must be a list of values or a range: {dotted}")
    return value


if TYPE_CHECKING:  # their types depend on values that mypy does not know
    ValuesOrQuantities = tuple[float | str, ...]
else:
    ValuesOrQuantities = Annotated[several(Positive | str, Positive | str, _listed), BeforeValidator(_refuse_group)]
    """Values of a number, or of a quantity as texts with a unit."""
