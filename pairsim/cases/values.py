"""Kinds of values in case files and the range of each: the one place where limits of numbers are set.

Limits are wider than what has been computed (docs/explanation/limits.md) and narrower than what would overflow double
precision, stop gmsh or give names that no file system takes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Annotated, Any, TypeGuard, TypeVar

from pydantic import AfterValidator, Discriminator, Field, Tag

from pairsim.physics.liquids import Liquid
from pairsim.physics.solids import Solid

NAME = r"^\w[\w.+-]{0,99}$"  # pattern of a name of a case
NAME_WORDS = "a word of at most 100 letters, digits and . _ + -, not beginning with one of . + -"


def is_finite(value: Any) -> TypeGuard[float]:
    """Whether a value is a number that double precision can hold; booleans are not."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def is_name(text: str) -> bool:
    """Whether a text can be the name of a case."""
    return re.fullmatch(NAME, text) is not None


def _zero_or(least: float, most: float) -> Any:
    """What a number must be that is 0 or in a range."""

    def check(value: float) -> float:
        if 0 < value < least:
            raise ValueError(f"must be 0, or at least {least:g}")
        return value

    return Field(ge=0, le=most), AfterValidator(check)


def _named(text: str) -> str:
    if not is_name(text):
        raise ValueError(f"must be {NAME_WORDS}")
    return text


# Strict: booleans and texts are no numbers.
Whole = Annotated[int, Field(strict=True)]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
CaseName = Annotated[str, Field(json_schema_extra={"pattern": NAME}), AfterValidator(_named)]
DIAMETERS = 1e-3, 0.999  # [D_c]; cell sizes by default follow from the diameter
Diameter = Annotated[Number, Field(ge=DIAMETERS[0], le=DIAMETERS[1])]
_SHARED = {name: (p.least, p.most) for name, p in {**Liquid.OF_POLYMER, **Solid.OF_ALL}.items()}
FOLLOWED = {name: _SHARED[name] for name in ("De", "Ca_e")}  # ranges of the parameters over which curves are followed
Deborah = Annotated[Number, *_zero_or(*_SHARED["De"])]
Capillary = Annotated[Number, *_zero_or(*_SHARED["Ca_e"])]
SolventPart = Annotated[Number, *_zero_or(*_SHARED["xi"])]
Fraction = Annotated[Number, Field(ge=0, le=1)]
CellSize = Annotated[Number, Field(ge=1e-4, le=0.5)]
Growth = Annotated[Number, Field(ge=0.01, le=2)]
Grading = Annotated[Number, Field(ge=0.1, le=10)]
CellCount = Annotated[Whole, Field(ge=0, le=1000)]
TubeLength = Annotated[Number, Field(ge=0.1, le=1e4)]
Rows = Annotated[Number, *_zero_or(0.05, 1e4)]
# A much narrower gap needs more cells than fit in memory, and gmsh does not report that.
Distance = Annotated[Number, Field(ge=1e-4, le=1e4)]
Gap = Annotated[Number, Field(ge=0, le=1e4)]
MOST_TIME = 1e6
Time = Annotated[Number, Field(ge=1e-9, le=MOST_TIME)]
Tolerance = Annotated[Number, Field(ge=1e-9, le=0.1)]
CurveTolerance = Annotated[Number, Field(ge=1e-9, le=1)]
Velocity = Annotated[Number, Field(ge=-1e3, le=1e3)]
Interval = Annotated[Number, Field(ge=0, le=1e9)]
Seconds = Annotated[Number, Field(ge=0.001, le=1e9)]

T = TypeVar("T")
OneOrEach = Annotated[
    Annotated[T, Tag("one")] | Annotated[tuple[T, ...], Field(min_length=1), Tag("each")],
    Discriminator(lambda value: "each" if isinstance(value, list | tuple) else "one"),
]
"""One value for all particles or gaps, or a list with one for each."""

RANGE = ("start", "stop", "num", "spacing")


def range_schema(end: Mapping[str, Any], most: int, *spacings: str) -> dict[str, Any]:
    """The JSON schema of a range: that of start and stop, the largest num, and the spacings, the default first."""
    return {
        "type": "object",
        "properties": {
            "start": end,
            "stop": end,
            "num": {"type": "integer", "minimum": 2, "maximum": most},
            "spacing": {"enum": list(spacings)},
        },
        "required": ["start", "stop", "num"],
        "additionalProperties": False,
    }


def spelled_out(described: Mapping[str, Any], most: int, spacing: str = "linear") -> list[float]:
    """Expand a range into its values.

    Args:
        described: The range: start, stop, num and optionally spacing.
        most: Largest num allowed.
        spacing: Spacing if the range has none, "linear" or "log".

    Returns:
        The num values from start to stop.

    Raises:
        ValueError: The range is invalid; says why.
    """
    if missing := [key for key in RANGE[:3] if key not in described]:
        raise ValueError(f"must have start, stop and num; {missing[0]} is missing")
    start, stop, num = (described[key] for key in RANGE[:3])
    if not (is_finite(start) and is_finite(stop)):
        raise ValueError("start and stop must be finite numbers")
    if isinstance(num, bool) or not isinstance(num, int) or not 2 <= num <= most:
        raise ValueError(f"num must be a whole number from 2 to {most}")
    spacing = described.get("spacing", spacing)
    if spacing not in ("linear", "log"):
        raise ValueError("spacing must be linear or log")
    if spacing == "log" and (start <= 0 or stop <= 0):
        raise ValueError("start and stop must be above 0 with spacing: log")
    part = [i / (num - 1) for i in range(num)]
    if spacing == "log":
        values = [math.exp(math.log(start) * (1 - f) + math.log(stop) * f) for f in part]
    else:
        values = [start * (1 - f) + stop * f for f in part]
    # Rounded to twelve digits: 0.30000000000000004 would differ from a 0.3 given elsewhere and lengthen folder names.
    return [float(start), *(float(f"{value:.12g}") for value in values[1:-1]), float(stop)]
