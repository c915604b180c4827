"""Types of values that several keys of case files share. Limits of a single key are in the type of its field.

Limits are wider than what has been computed (docs/explanation/limits.md), and narrower than what would overflow double
precision, stop gmsh or give names that no file system accepts.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeGuard, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Discriminator, Field, Tag, WithJsonSchema

NAME = r"^\w[\w.+-]{0,99}$"  # pattern of a name of a case
NAME_WORDS = "a word of at most 100 letters, digits and . _ + -, not beginning with . + or -"


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


def zero_or(least: float, most: float) -> tuple[Any, ...]:
    """The limits of a number that is 0 or in a range."""

    def check(value: float) -> float:
        if 0 < value < least:
            raise ValueError(f"must be 0, or at least {least:g}")
        return value

    return Field(ge=0, le=most), AfterValidator(check)


# Strict: booleans and texts do not count as numbers.
Whole = Annotated[int, Field(strict=True)]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
# A much narrower gap needs more cells than fit in memory, and gmsh does not report that.
Distance = Annotated[Number, Field(ge=1e-4, le=1e4)]
DistanceOrLength = Annotated[
    Distance,
    WithJsonSchema(
        {"anyOf": [{"type": "number", "minimum": 1e-4, "maximum": 1e4}, {"type": "string", "examples": ["15 um"]}]}
    ),
]
"""A distance [D_c], which may also be given as a length if there is a `physical` block; a number in a valid case."""
MOST_TIME = 1e6
Time = Annotated[Number, Field(ge=1e-9, le=MOST_TIME)]

MOST_VALUES = 10_000  # largest number of values of a list or range


class Range[T](BaseModel):
    """`num` values from `start` to `stop`, with equal factors or equal differences between them."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)
    start: T
    stop: T
    num: Annotated[Whole, Field(ge=2, le=MOST_VALUES)]
    spacing: Literal["log", "linear"] = "log"


def spelled_out(described: Range[Any]) -> list[float]:
    """The values of a range of numbers.

    Raises:
        ValueError: It is logarithmic, and one of its ends is not above 0.
    """
    start, stop, num = described.start, described.stop, described.num
    part = [i / (num - 1) for i in range(num)]
    if described.spacing == "linear":
        values = [start * (1 - f) + stop * f for f in part]
    elif start <= 0 or stop <= 0:
        raise ValueError("start and stop must be above 0 with spacing: log")
    else:
        values = [math.exp(math.log(start) * (1 - f) + math.log(stop) * f) for f in part]
    # Rounded to twelve digits: 0.30000000000000004 would differ from a 0.3 given elsewhere and lengthen folder names.
    return [float(start), *(float(f"{value:.12g}") for value in values[1:-1]), float(stop)]


def _shape(value: Any) -> str:
    """The alternative that a value is meant to be, so that pydantic reports the mistakes of this alternative only."""
    if isinstance(value, Range) or (isinstance(value, Mapping) and value.keys() & Range.model_fields.keys()):
        return "range"
    return "each" if isinstance(value, list | tuple) else "one"


def listed(value: Any) -> Any:
    """A value, a list or a range of numbers as a tuple."""
    return value if isinstance(value, tuple) else tuple(spelled_out(value)) if isinstance(value, Range) else (value,)


T = TypeVar("T")
OneOrMany = Annotated[
    Annotated[T, Tag("one")] | Annotated[tuple[T, ...], Field(min_length=1), Tag("each")],
    Discriminator(lambda value: "each" if isinstance(value, list | tuple) else "one"),
]
"""One value, or a list of values."""


def several(one: Any, end: Any, listed: Callable[[Any], Any] = listed) -> Any:
    """The type of a value of type `one`, a list of these, or a range with ends of type `end`; it becomes a tuple."""
    each: Any = tuple[one, ...]
    ranged: Any = Range
    return Annotated[
        Annotated[one, Tag("one")]
        | Annotated[each, Field(min_length=1, max_length=MOST_VALUES), Tag("each")]
        | Annotated[ranged[end], Tag("range")],
        Discriminator(_shape),
        AfterValidator(listed),
    ]


if TYPE_CHECKING:  # their types depend on values that mypy does not know
    Gaps = tuple[float | tuple[float, ...] | Range[float], ...]
    Values = tuple[float, ...]
else:
    Gaps = several(
        Annotated[
            Annotated[Distance, Tag("one")]
            | Annotated[tuple[Distance, ...], Field(min_length=1), Tag("each")]
            | Annotated[Range[Distance], Tag("range")],
            Discriminator(_shape),
        ],
        Distance,
    )
    """Distances, each a number for all gaps or a list with one for each; or one entry per gap, one being a range."""
    Values = several(Positive, Positive)
    """Values of a parameter."""
