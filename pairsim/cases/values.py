"""Kinds of values in case files and the range of each: the one place where limits of numbers are set.

Limits are wider than what has been computed (docs/explanation/limits.md) and narrower than what would overflow double
precision, stop gmsh or give names that no file system takes.
"""

from __future__ import annotations

import math
import re
from typing import Annotated, Any, TypeGuard

from pydantic import AfterValidator, Field

from pairsim.physics.liquids import Liquid
from pairsim.physics.solids import Solid

NAME = r"^\w[\w.+-]{0,99}$"  # pattern of a name of a case
NAME_WORDS = "a word of at most 100 letters, digits and . _ + -, not beginning with one of . + -"
FOLDER_WORDS = "a name for a folder, without / and not beginning with a point"


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


def fits_a_folder(name: str) -> bool:
    """Whether a text can be the name of a folder inside another one."""
    return bool(name) and not name.startswith(".") and "/" not in name


def _zero_or(least: float, most: float) -> Any:
    """What a number must be that is 0 or in a range."""

    def check(value: float) -> float:
        if 0 < value < least:
            raise ValueError(f"must be 0, or at least {least:g}")
        return value

    words = f"0, or a finite number from {least:g} to {most:g}"
    return Field(ge=0, le=most, json_schema_extra={"words": words}), AfterValidator(check)


def _named(text: str) -> str:
    if not is_name(text):
        raise ValueError(f"must be {NAME_WORDS}")
    return text


# Strict: booleans and texts are no numbers.
Whole = Annotated[int, Field(strict=True)]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
CaseName = Annotated[str, Field(json_schema_extra={"pattern": NAME, "words": NAME_WORDS}), AfterValidator(_named)]
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
