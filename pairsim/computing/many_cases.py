"""The keys of sweep and study files, and the checks that involve several of them.

`pairsim.sweeps.grid` and `pairsim.sweeps.study` form the cases.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, WithJsonSchema

from pairsim.cases.keys import Keys
from pairsim.cases.mistakes import Mistake, missing
from pairsim.cases.quantities import quantity_range
from pairsim.cases.values import Number, Positive, Range, Whole, is_finite, spelled_out
from pairsim.computing import QUESTIONS

MOST_CASES = 100_000


class GridRange(Range[Number | str]):
    """A range of a grid, of numbers or of quantities."""

    num: Annotated[Whole, Field(ge=2, le=MOST_CASES)]
    spacing: Literal["linear", "log"] = "linear"


def _listed(value: list[Any] | GridRange) -> list[Any]:
    if isinstance(value, list):
        return value
    return list(quantity_range(value) if isinstance(value.start, str) else spelled_out(value))


def _bounds(value: Any) -> Any:
    """A value of `exclude`: any, but the bounds of {min, max} are numbers."""
    if isinstance(value, Mapping) and not all(map(is_finite, value.values())):
        raise ValueError("must have numbers for min and max")
    return value


def _folder(name: str) -> str:
    if not name or name.startswith(".") or "/" in name:
        raise ValueError("must be a name for a folder, without / and not beginning with a point")
    return name


def _as_list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


Changes = dict[str, Any] | Annotated[str, Field(examples=["case.yaml"])]
Exclusion = Annotated[
    dict[str, Annotated[Any, BeforeValidator(_bounds)]], Field(min_length=1, examples=["{Ca_e: 0, De: {min: 1}}"])
]
FolderName = Annotated[str, AfterValidator(_folder)]
if TYPE_CHECKING:  # mypy cannot know them
    CommandName = str
    Values = dict[str, list[Any]]
else:
    CommandName = Literal[tuple(QUESTIONS)]
    Values = dict[
        str,
        Annotated[
            Annotated[list[Any], Field(min_length=1), Tag("list")] | Annotated[GridRange, Tag("range")],
            Discriminator(lambda value: "range" if isinstance(value, Mapping) and "start" in value else "list"),
            AfterValidator(_listed),
        ],
    ]


Ends = tuple[Annotated[float, Field(ge=0)], Annotated[float, Field(ge=0)]]


class SweepFile(Keys):
    """A grid file: many cases for one command. Ranges become lists of values, a single group of `zip` a list of one."""

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
        BeforeValidator(lambda value: [] if value == {} else _as_list(value)),
        WithJsonSchema({"anyOf": [{"type": "object"}, {"type": "array", "items": {"type": "object"}}]}),
    ] = Field([], description="keys whose values are combined one by one; several such groups (a list) are multiplied")
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
        yield missing("grid", "must be given, or else zip or cases")


class StudyFile(Keys):
    """A study file: one case in many discretisations."""

    discretisations: list[dict[str, Any]] = Field(
        min_length=2,
        description="two or more discretisations, each with the keys that differ from base",
        examples=["[{mesh.Np: 20, time.tol: 1e-4}, {mesh.Np: 40}]"],
    )
    name: FolderName | None = Field(None, description="name of the study and of its folder; default: that of the file")
    command: Literal["run", "curve"] = Field("run", description="command that computes each discretisation")
    base: Changes = Field({}, description="keys that all discretisations share, or the path of a case file")
    quantity: str = Field("dU", description="what is compared: a column of the results")
    at: Positive | list[Positive] = Field(
        [], description="times [D_c/U_av] or distances [D_c] where it is compared; default: the end of the run or curve"
    )
    reference: Literal["finest"] | Whole = Field(
        "finest", description="index (from 0) of the discretisation that errors refer to; finest: the most unknowns"
    )

    @property
    def places(self) -> list[float]:
        """The values of `at`."""
        return _as_list(self.at)


def check_study(file: StudyFile) -> Iterator[Mistake]:
    """Check the keys of a study file against each other; yields mistakes."""
    last = len(file.discretisations) - 1
    if isinstance(file.reference, int) and not 0 <= file.reference <= last:
        yield Mistake("reference", file.reference, f"must be finest, or the index of a discretisation from 0 to {last}")


class AtlasFile(Keys):
    """An atlas file: a box of parameters, in which master curves are computed where they tell most."""

    name: FolderName | None = Field(None, description="name of the folder of the atlas; default: that of the file")
    base: Changes = Field({}, description="keys that all curves share, or the path of a case file")
    beta: Ends = Field(description="least and largest diameter of the particles [D_c]", examples=[[0.3, 0.5]])
    De: Ends = Field(description="least and largest Deborah number", examples=[[0, 1]])
    Ca_e: Ends = Field(description="least and largest elastic capillary number", examples=[[0, 0.1]])
    d: Ends = Field((0.02, 2.0), description="least and largest distance [D_c]")
    curves: Whole = Field(ge=1, le=MOST_CASES, description="number of curves, in rounds of 6 (the first one up to 11)")
    start: str | list[str] = Field(
        [],
        description="file of an atlas, to whose curves these are added; or several, the first one of this box and "
        "base, and of the others those curves that are in the box, as those of a Newtonian liquid are at De = 0",
    )
    within: dict[Literal["beta", "De", "Ca_e"], Ends] = Field(
        {},
        description="part of the box in which the curves that are added to those of start are computed; default: all",
        examples=[{"De": [0, 0.3]}],
    )
    seed: Whole = Field(0, description="seed of the places that are candidates")

    @property
    def starts(self) -> list[str]:
        """The values of `start`."""
        return _as_list(self.start)


def check_atlas(file: AtlasFile) -> Iterator[Mistake]:
    """Check the keys of an atlas file; yields mistakes."""
    for key in ("beta", "De", "Ca_e", "d"):
        low, high = getattr(file, key)
        if not low < high and (key in ("beta", "d") or low > high):
            yield Mistake(key, [low, high], "must be the least and the largest value")
    for key, (low, high) in file.within.items():
        if not getattr(file, key)[0] <= low <= high <= getattr(file, key)[1]:
            yield Mistake(f"within.{key}", [low, high], f"must be a part of {key}: {list(getattr(file, key))}")
    if file.within and not file.start:
        yield Mistake("within", None, "must be left out without start: the first curves are those at the corners")
    if file.De[1] == file.Ca_e[1] == 0:
        yield Mistake(
            "Ca_e", list(file.Ca_e), "must end above 0, or De: dU of rigid pairs vanishes in Newtonian liquids"
        )
