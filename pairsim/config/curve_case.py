"""Cases of `pairsim curve` and `pairsim critical`: a scene, and where along its parameters it is wanted."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from pairsim.config.accuracy import DEFAULT, SETTINGS
from pairsim.config.case import Distance, Number, Positive, SceneCase, Whole, check_scene, number
from pairsim.config.ranges import RANGE, spelled_out
from pairsim.runtime.errors import InputError

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
        raise PydanticCustomError("range", _RANGE) from None


Gaps = Annotated[
    tuple[Distance | tuple[Distance, ...], ...], Field(min_length=1, max_length=MOST_VALUES), BeforeValidator(expanded)
]
Values = Annotated[tuple[Positive, ...], Field(min_length=1, max_length=MOST_VALUES), BeforeValidator(expanded)]


class CurveCase(SceneCase):
    """A master curve: the same scene at many distances d."""

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


def check_curve(case: CurveCase, source: str) -> None:
    """What no key of a curve can say alone.

    Raises:
        InputError: With the first key that does not fit the others.
    """
    if case.n < 1:
        raise InputError(source, "particles", case.n, "at least 1: a tube without particles has no curve")
    if case.n > 1 and case.d is None:
        raise InputError(source, "d", None, f"is missing; {_RANGE}")
    if case.n == 1 and case.d is not None:
        raise InputError(source, "d", list(case.d), "nothing: one particle has no distance")
    for place in case.d or ():
        if isinstance(place, tuple) and len(place) != case.n - 1:
            raise InputError(source, "d", list(place), f"numbers, or lists of {case.n - 1}, one for each gap")
    if case.fields and not case.common:
        raise InputError(source, "fields", list(case.fields), "nothing, unless one distance holds for all gaps")
    if case.fields:
        lowest, highest = (f(place[0] for place in case.places) for f in (min, max))
        for d in case.fields:
            if not lowest <= d <= highest:
                raise InputError(source, "fields", d, f"between the least and largest d, {lowest:g} and {highest:g}")
    check_scene(case, source, {})


def check_critical(case: CriticalCase, source: str) -> None:
    """What no key of a search for critical distances can say alone.

    Raises:
        InputError: With the first key that does not fit the others.
    """
    if case.n != 2:
        raise InputError(source, "particles", case.n, "2: critical distances are those of a pair")
    if case.d[0] >= case.d[1]:
        raise InputError(source, "d", list(case.d), "[least, largest], ascending")
    for key, values in (("along", case.along), ("lines", case.lines)):
        if values is None:
            continue
        if len(values) != 1 or next(iter(values)) not in ("Ca_e", "De"):
            raise InputError(source, key, dict(values), f"one of Ca_e and De, such as {key}: {{Ca_e: [0.05, 0.1]}}")
        if "Ca_e" in values and len({Ca_e for Ca_e in case.Ca_es if Ca_e}) != 1:
            raise InputError(source, "Ca_e", list(case.Ca_es), f"one value above 0, which those of {key} replace")
        if "De" in values and case.De == 0:
            raise InputError(source, "De", 0, f"above 0; the values of {key} replace it")
    if case.lines is not None and (case.along is None or case.lines.keys() == case.along.keys()):
        raise InputError(source, "lines", dict(case.lines), "the other parameter of along, which must be given too")
    check_scene(case, source, {})
