"""The keys of grid files, and the checks that involve several of them; `grid.py` forms the cases."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, WithJsonSchema

from pairsim.cases.keys import Keys
from pairsim.cases.mistakes import Mistake, missing
from pairsim.cases.quantity_text import quantity_range
from pairsim.cases.values import Number, Range, Whole, is_finite, spelled_out
from pairsim.questions.registry import NAMES

MOST_CASES = 100_000


class GridRange(Range[Number | str]):
    """A range of a grid, of numbers or of quantities."""

    num: Annotated[Whole, Field(ge=2, le=MOST_CASES)]
    spacing: Literal["linear", "log"] = "linear"


def _listed(value: list[Any] | GridRange) -> list[Any]:
    if isinstance(value, list):
        return value
    if isinstance(value.start, str):
        return list(quantity_range(value))
    numbers = spelled_out(value)
    whole = all(each.is_integer() for each in numbers)  # as keys of whole numbers need them
    return [int(each) for each in numbers] if whole else numbers


def _bounds(value: Any) -> Any:
    """Check a value of `exclude`: it may be anything, but the bounds of {min, max} must be numbers."""
    if isinstance(value, Mapping) and not all(map(is_finite, value.values())):
        raise ValueError("must have numbers for min and max")
    return value


def _folder(name: str) -> str:
    if not name or name.startswith(".") or "/" in name:
        raise ValueError("must be the name of a folder, without / and not beginning with a dot")
    return name


def as_list(value: Any) -> list[Any]:
    """The value if it is a list, else a list with the single value."""
    return value if isinstance(value, list) else [value]


Changes = dict[str, Any] | Annotated[str, Field(examples=["case.yaml"])]
Exclusion = Annotated[
    dict[str, Annotated[Any, BeforeValidator(_bounds)]], Field(min_length=1, examples=["{Ca_e: 0, De: {min: 1}}"])
]
FolderName = Annotated[str, AfterValidator(_folder)]
if TYPE_CHECKING:  # their types depend on values that mypy does not know
    CommandName = str
    Values = dict[str, list[Any]]
else:
    CommandName = Literal[NAMES]
    Values = dict[
        str,
        Annotated[
            Annotated[list[Any], Field(min_length=1), Tag("list")] | Annotated[GridRange, Tag("range")],
            Discriminator(lambda value: "range" if isinstance(value, Mapping) and "start" in value else "list"),
            AfterValidator(_listed),
        ],
    ]


class SweepFile(Keys):
    """A grid file: many cases for one command. Ranges become lists of values, a single group of `zip` a list."""

    name: FolderName | None = Field(None, description="name of the sweep and of its folder; default: that of the file")
    command: CommandName = Field("run", description="command that computes each case")
    base: Changes = Field({}, description="keys that all cases share, or the path of a case file")
    grid: Values = Field(
        {},
        description="keys (dotted within a group, such as mesh.Np), each with a list or a range; all combinations",
        examples=["{d0: [0.1, 0.2], mesh.Np: {start: 10, stop: 40, num: 4}}"],
    )
    zip: Annotated[
        list[Annotated[Values, Field(min_length=1)]],
        BeforeValidator(lambda value: [] if value == {} else as_list(value)),
        WithJsonSchema({"anyOf": [{"type": "object"}, {"type": "array", "items": {"type": "object"}}]}),
    ] = Field([], description="keys whose values go together one by one; a list of such groups gives all combinations")
    cases: list[Changes] = Field([], description="further cases: keys and values, or paths of case files")
    exclude: list[Exclusion] = Field(
        [], description="combinations of grid and zip to leave out, by values or {min, max}"
    )


def check_sweep(file: SweepFile) -> Iterator[Mistake]:
    """Check the keys of a sweep file against each other; yields mistakes."""
    seen = set(file.grid)
    cases = math.prod(map(len, file.grid.values()))
    for i, zipped in enumerate(file.zip):
        key = f"zip[{i}]" if len(file.zip) > 1 else "zip"
        lengths = {name: len(values) for name, values in zipped.items()}
        if len(set(lengths.values())) > 1:
            counts = ", ".join(f"{name} has {count}" for name, count in lengths.items())
            yield Mistake(key, None, f"must have the same number of values for all keys; {counts}")
        for name in sorted(seen & set(zipped)):
            yield Mistake(f"{key}.{name}", None, "must occur only once in grid and zip")
        seen |= set(zipped)
        cases *= min(lengths.values())
    if cases > MOST_CASES:
        yield Mistake("grid", None, f"must give at most {MOST_CASES} cases, not {cases}")
    if not (file.grid or file.zip or file.cases):
        yield missing("grid", "must be given, or zip or cases instead")
