"""Keys whose value is a list of numbers, a range of them, or a single one."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from pairsim.cases.values import (
    RANGE,
    Distance,
    OneOrEach,
    Positive,
    range_schema,
    spelled_out,
)

MOST_VALUES = 10_000
ALLOWED = "a list, or {start, stop, num, spacing: log or linear} with start and stop above 0 and num from 2 to 10000"


def expanded(value: Any) -> Any:
    """Expand a range {start, stop, num, spacing} into its values, and a single value into a tuple of one.

    Raises:
        PydanticCustomError: The range is invalid.
    """
    if not isinstance(value, dict):
        return value if isinstance(value, list | tuple) else (value,)
    try:
        if not value.keys() <= set(RANGE):
            raise ValueError
        return tuple(spelled_out(value, MOST_VALUES, "log"))
    except (ValueError, OverflowError):
        raise PydanticCustomError("range", f"must be {ALLOWED}") from None


_RANGE_SCHEMA = range_schema({"type": "number", "exclusiveMinimum": 0}, MOST_VALUES, "log", "linear")


def _or_range(schema: dict[str, Any]) -> None:
    """Add the other inputs of `expanded`, a single value or a range, to the JSON schema of a list."""
    listed = {key: schema.pop(key) for key in ("type", "items", "minItems", "maxItems")}
    schema["anyOf"] = [listed["items"], listed, _RANGE_SCHEMA]


Gaps = Annotated[
    tuple[OneOrEach[Distance], ...],
    Field(min_length=1, max_length=MOST_VALUES, json_schema_extra=_or_range),
    BeforeValidator(expanded),
]
Values = Annotated[
    tuple[Positive, ...],
    Field(min_length=1, max_length=MOST_VALUES, json_schema_extra=_or_range),
    BeforeValidator(expanded),
]
