"""Kinds of values in case files and the range of each: the one place where limits of numbers are set.

Limits are wider than what has been computed (docs/explanation/limits.md) and narrower than what would overflow double
precision, stop gmsh or give names that no file system takes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Annotated, Any, TypeGuard

from pydantic import BeforeValidator, Field

from pairsim.physics.liquids import Liquid
from pairsim.physics.solids import Solid
from pairsim.runtime.names import LONGEST_NAME, fits_a_folder

NAME = r"^\w[\w.+-]{0,99}$"  # pattern of a name of a case
NAME_WORDS = (
    f"a word of at most 100 letters ({LONGEST_NAME} bytes), digits and . _ + -, not beginning with one of . + -"
)
FOLDER_WORDS = f"a name for a folder: at most {LONGEST_NAME} bytes, without /, not beginning with a point"


def is_finite(value: Any) -> TypeGuard[float]:
    """Whether a value is a number that double precision can hold; booleans are not."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def number(value: Any) -> float:
    """Validate a finite number; booleans and strings are rejected.

    Raises:
        ValueError: The value is not a finite number.
    """
    if not is_finite(value):
        raise ValueError("must be a finite number")
    return float(value)


def whole(value: Any) -> int:
    """Validate a whole number; booleans are rejected.

    Raises:
        ValueError: The value is not a whole number.
    """
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError("must be a whole number")
    return value


def is_name(text: str) -> bool:
    """Whether a text can be the name of a case."""
    return re.search(NAME, text) is not None and fits_a_folder(text)


def _name(value: Any) -> Any:
    """Validate the length in bytes of a name; its pattern is validated by pydantic.

    Raises:
        ValueError: The name is too long or not printable.
    """
    if isinstance(value, str) and not fits_a_folder(value):
        raise ValueError(f"must be {NAME_WORDS}")
    return value


def _zero_or_at_least(least: float) -> Callable[[Any], float]:
    def check(value: Any) -> float:
        if 0 < (checked := number(value)) < least:
            raise ValueError(f"must be 0, or at least {least:g}")
        return checked

    return check


def _zero_or(least: float, most: float) -> Any:
    """Bounds of a number that is 0 or in a range."""
    return Field(ge=0, le=most, json_schema_extra={"words": f"0, or a finite number from {least:g} to {most:g}"})


# Bounds come before the validator, so that they also appear in the JSON schema of a union.
Whole = Annotated[int, BeforeValidator(whole)]
CaseName = Annotated[str, Field(pattern=NAME, json_schema_extra={"words": NAME_WORDS}), BeforeValidator(_name)]
DIAMETERS = 1e-3, 0.999  # [D_c]; cell sizes by default follow from the diameter
Diameter = Annotated[float, Field(ge=DIAMETERS[0], le=DIAMETERS[1]), BeforeValidator(number)]
_SHARED = {name: (p.least, p.most) for name, p in {**Liquid.OF_POLYMER, **Solid.OF_ALL}.items()}
FOLLOWED = {name: _SHARED[name] for name in ("De", "Ca_e")}  # ranges of the parameters over which curves are followed
Deborah = Annotated[float, _zero_or(*_SHARED["De"]), BeforeValidator(_zero_or_at_least(_SHARED["De"][0]))]
Capillary = Annotated[float, _zero_or(*_SHARED["Ca_e"]), BeforeValidator(_zero_or_at_least(_SHARED["Ca_e"][0]))]
SolventPart = Annotated[float, _zero_or(*_SHARED["xi"]), BeforeValidator(_zero_or_at_least(_SHARED["xi"][0]))]
Fraction = Annotated[float, Field(ge=0, le=1), BeforeValidator(number)]
CellSize = Annotated[float, Field(ge=1e-4, le=0.5), BeforeValidator(number)]
Growth = Annotated[float, Field(ge=0.01, le=2), BeforeValidator(number)]
Grading = Annotated[float, Field(ge=0.1, le=10), BeforeValidator(number)]
CellCount = Annotated[int, Field(ge=0, le=1000), BeforeValidator(whole)]
TubeLength = Annotated[float, Field(ge=0.1, le=1e4), BeforeValidator(number)]
Rows = Annotated[float, _zero_or(0.05, 1e4), BeforeValidator(_zero_or_at_least(0.05))]
# A much narrower gap needs more cells than fit in memory, and gmsh does not report that.
Distance = Annotated[float, Field(ge=1e-4, le=1e4), BeforeValidator(number)]
Gap = Annotated[float, Field(ge=0, le=1e4), BeforeValidator(number)]
MOST_TIME = 1e6
Time = Annotated[float, Field(ge=1e-9, le=MOST_TIME), BeforeValidator(number)]
Tolerance = Annotated[float, Field(ge=1e-9, le=0.1), BeforeValidator(number)]
CurveTolerance = Annotated[float, Field(ge=1e-9, le=1), BeforeValidator(number)]
Velocity = Annotated[float, Field(ge=-1e3, le=1e3), BeforeValidator(number)]
Interval = Annotated[float, Field(ge=0, le=1e9), BeforeValidator(number)]
Seconds = Annotated[float, Field(ge=0.001, le=1e9), BeforeValidator(number)]
# Of several keys, each of which has a range of its own that is checked, too.
Number = Annotated[float, BeforeValidator(number)]
Positive = Annotated[float, Field(gt=0), BeforeValidator(number)]
