"""Cases of `pairsim curve` and `pairsim critical`: a scene, and where along its parameters it is wanted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from pairsim.config.accuracy import DEFAULT, SETTINGS
from pairsim.config.case import Distance, Number, Positive, SceneCase, Whole, number
from pairsim.config.case_checks import check_scene
from pairsim.config.mistakes import Mistake, missing
from pairsim.config.ranges import RANGE, spelled_out

MOST_VALUES = 10_000
_RANGE = "a list, or {start, stop, num, spacing: log or linear} with start and stop above 0 and num from 2 to 10000"


def expanded(value: Any) -> Any:
    """A range {start, stop, num, spacing} as the values that it stands for; one value as a list of one."""
    if not isinstance(value, dict):
        return value if isinstance(value, tuple) else (value,)
    try:
        if not value.keys() <= set(RANGE):
            raise ValueError
        return tuple(map(number, spelled_out(value, MOST_VALUES, "log")))
    except (ValueError, OverflowError):
        raise PydanticCustomError("range", f"must be {_RANGE}") from None


_SHORT = "{start, stop, num, spacing: log or linear}"
_NUMBER = {"type": "number", "exclusiveMinimum": 0}
_RANGE_SCHEMA = {
    "type": "object",
    "properties": {
        "start": _NUMBER,
        "stop": _NUMBER,
        "num": {"type": "integer", "minimum": 2, "maximum": MOST_VALUES},
        "spacing": {"enum": ["log", "linear"]},
    },
    "required": ["start", "stop", "num"],
    "additionalProperties": False,
}


def _or_range(each: str) -> Callable[[dict[str, Any]], None]:
    """Adds to the schema of a list what `expanded` takes besides: one value, or a range."""

    def extend(schema: dict[str, Any]) -> None:
        listed = {key: schema.pop(key) for key in ("type", "items", "minItems", "maxItems")}
        schema |= {"anyOf": [listed, listed["items"], _RANGE_SCHEMA], "words": f"{each}, a list of such, or {_SHORT}"}

    return extend


Gaps = Annotated[
    tuple[Distance | tuple[Distance, ...], ...],
    Field(
        min_length=1,
        max_length=MOST_VALUES,
        json_schema_extra=_or_range("a finite number at least 0.0001 (or a list, one for each gap)"),
    ),
    BeforeValidator(expanded),
]
Values = Annotated[
    tuple[Positive, ...],
    Field(min_length=1, max_length=MOST_VALUES, json_schema_extra=_or_range("a finite number above 0")),
    BeforeValidator(expanded),
]


class CurveCase(SceneCase):
    """A master curve: the same scene at many distances d."""

    kind: ClassVar[str] = "curve"

    d: Gaps | None = Field(
        None, description="distances between surfaces [D_c]: a list (of numbers or lists of gaps), or a range"
    )
    tol: Number = Field(
        SETTINGS[DEFAULT].curve_tol,
        gt=0,
        le=1,
        description="points are added until dU between them is known to this part of its largest value "
        "(default: by accuracy)",
    )
    max_points: Whole = Field(
        200, ge=1, le=MOST_VALUES, description="points are added while the curve has fewer than this"
    )
    fields: tuple[Positive, ...] = Field((), description="distances at which fields.xdmf is written [D_c]")
    mesh_error: bool = Field(
        False, strict=True, description="solve every point on a coarser mesh too, as a check of dU_error"
    )

    @property
    def places(self) -> list[tuple[float, ...]]:
        """The wanted distances, each one value a gap, in the order of the file; one empty place without gaps."""
        if self.n < 2:
            return [()]
        return [v if isinstance(v, tuple) else (v,) * (self.n - 1) for v in self.d or ()]

    @property
    def gaps(self) -> tuple[float, ...]:
        """The widest distances, which decide the length of the tube."""
        return tuple(max(values) for values in zip(*self.places, strict=True))

    @property
    def common(self) -> bool:
        """Whether every place has one distance for all gaps, so that there is a curve over d."""
        return self.n > 1 and all(len(set(place)) == 1 for place in self.places)

    def _words(self) -> list[str]:
        return ["curve", *super()._words()]


class CriticalCase(SceneCase):
    """Critical distances: zeros of dU, followed along one parameter."""

    kind: ClassVar[str] = "critical"

    along: dict[str, Values] | None = Field(
        None, description="the parameter to follow them along: Ca_e or De, with its values (a list or a range)"
    )
    lines: dict[str, Values] | None = Field(
        None, description="the other of the two, with values of which each gives a line of its own"
    )
    d: tuple[Distance, Distance] = Field((0.02, 0.8), description="distances between which zeros are looked for [D_c]")
    mesh_error: bool = Field(
        False, strict=True, description="solve on a coarser mesh too, as a check of the error of every distance"
    )

    @property
    def gaps(self) -> tuple[float, ...]:
        """The widest distance, which decides the length of the tube."""
        return (max(self.d),) * (self.n - 1)

    def _words(self) -> list[str]:
        return ["critical", *super()._words()]


def check_curve(case: CurveCase) -> Iterator[Mistake]:
    """What no key of a curve can say alone; as `check_scene`."""
    if case.n < 1:
        yield Mistake("particles", case.n, "must be at least 1: a tube without particles has no curve")
        return
    if case.n > 1 and case.d is None:
        yield missing("d", f"must be {_RANGE}")
    if case.n == 1 and case.d is not None:
        yield Mistake("d", list(case.d), "must be left out: one particle has no distance")
    wrong = [place for place in case.d or () if isinstance(place, tuple) and len(place) != case.n - 1]
    if wrong and case.n > 1:
        yield Mistake("d", list(wrong[0]), f"must be numbers, or lists of {case.n - 1}, one for each gap")
        return
    if case.fields and not case.common:
        yield Mistake("fields", list(case.fields), "must be left out, unless one distance holds for all gaps")
    elif case.fields:
        lowest, highest = (f(place[0] for place in case.places) for f in (min, max))
        for d in case.fields:
            if not lowest <= d <= highest:
                allowed = f"must be between the least and largest d, {lowest:g} and {highest:g}"
                yield Mistake("fields", d, allowed)
    yield from check_scene(case, {})


def check_critical(case: CriticalCase) -> Iterator[Mistake]:
    """What no key of a search for critical distances can say alone; as `check_scene`."""
    if case.n != 2:
        yield Mistake("particles", case.n, "must be 2: critical distances are those of a pair")
        return
    if case.d[0] >= case.d[1]:
        yield Mistake("d", list(case.d), "must be [least, largest], ascending")
    for key, values in (("along", case.along), ("lines", case.lines)):
        if values is None:
            continue
        if len(values) != 1 or next(iter(values)) not in ("Ca_e", "De"):
            allowed = f"must be one of Ca_e and De, such as {key}: {{Ca_e: [0.05, 0.1]}}"
            yield Mistake(key, dict(values), allowed)
            continue
        if "Ca_e" in values and case.Ca_e is not None and len({Ca_e for Ca_e in case.Ca_es if Ca_e}) != 1:
            yield Mistake("Ca_e", case.Ca_e, f"must be one value above 0, which those of {key} replace")
        if "De" in values and case.De == 0:
            yield Mistake("De", case.De, f"must be above 0; the values of {key} replace it")
    if case.lines is not None and (case.along is None or case.lines.keys() == case.along.keys()):
        allowed = "must be the other parameter of along, which must be given too"
        yield Mistake("lines", dict(case.lines), allowed)
    yield from check_scene(case, {})
