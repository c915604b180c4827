"""Cases of `pairsim curve` and `pairsim critical`: the scene, and the distances or parameters to solve for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from pairsim.cases.accuracy import DEFAULT, percent
from pairsim.cases.case import SceneCase
from pairsim.cases.case_checks import check_scene
from pairsim.cases.materials import is_viscous
from pairsim.cases.mistakes import Mistake, broken, missing
from pairsim.cases.values import (
    FOLLOWED,
    RANGE,
    CurveTolerance,
    Distance,
    OneOrEach,
    Positive,
    Velocity,
    Whole,
    range_schema,
    spelled_out,
)

MOST_VALUES = 10_000
_RANGE = "a list, or {start, stop, num, spacing: log or linear} with start and stop above 0 and num from 2 to 10000"


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
        raise PydanticCustomError("range", f"must be {_RANGE}") from None


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


class CurveCase(SceneCase):
    """A master curve dU(d): quasi-steady solutions at many distances d."""

    kind: ClassVar[str] = "curve"
    usual_distances: ClassVar[dict[str, Any]] = {"d": {"start": 0.02, "stop": 0.8, "num": 9}}

    d: Gaps | None = Field(
        None,
        description="distances between the facing surfaces [D_c]: a list of numbers (or of lists, one number for each "
        "gap), or a range; a curve has points at other distances, too, no more than a factor of 1.8 apart",
    )
    tol: CurveTolerance = Field(
        percent(DEFAULT) / 100,
        description="points are added until the half-width of the interval of dU between them is below this fraction "
        "of the largest |dU|, or below twice that at the points (default: accuracy)",
    )
    max_points: Whole = Field(200, ge=1, le=MOST_VALUES, description="no points are added once the curve has this many")
    fields: tuple[Distance, ...] = Field(
        (), max_length=MOST_VALUES, description="distances at which fields are written to fields.xdmf [D_c]"
    )
    velocity: Velocity | None = Field(
        None,
        description="velocity at which the rigid particles are moved, 0 to hold them [U_av]; the forces that this "
        "takes are columns of curve.csv (default: no force acts on the particles)",
    )
    flow: Literal[0, 1] = Field(
        1,
        description="mean velocity of the liquid in the tube [U_av]; 0 is a liquid at rest, between closed ends if "
        "these are developed, in which velocity must be given: with velocity: 1 the unit is that of the particles",
    )

    def _defaults(self) -> dict[str, Any]:
        return super()._defaults() | {"tol": self.error_wanted}

    @property
    def places(self) -> list[tuple[float, ...]]:
        """The requested distances [D_c] in the order of the file, a tuple with one value for each gap."""
        if self.n < 2:
            return [()]
        return [v if isinstance(v, tuple) else (v,) * (self.n - 1) for v in self.d or ()]

    @property
    def gaps(self) -> tuple[float, ...]:
        """The largest distance of each gap [D_c], which sets the length of the tube."""
        return tuple(max(values) for values in zip(*self.places, strict=True))

    @property
    def range_of_d(self) -> tuple[float, float]:
        """See `SceneCase`."""
        values = [d for place in self.places for d in place]
        return min(values), max(values)

    @property
    def driven(self) -> tuple[float, float | None]:
        """See `SceneCase`."""
        return float(self.flow), self.velocity

    @property
    def common(self) -> bool:
        """Whether all gaps have the same distance at every point, so that the result is a curve over d."""
        return self.n > 1 and all(len(set(place)) == 1 for place in self.places)

    def _slug_parts(self) -> list[str]:
        parts = ["curve", *super()._slug_parts()]
        parts += [] if self.velocity is None else [f"velocity{self.velocity:g}"]
        return parts if self.flow else [*parts, "at-rest"]


class CriticalCase(SceneCase):
    """Critical distances: zeros of dU(d), optionally followed over a parameter."""

    kind: ClassVar[str] = "critical"
    usual_distances: ClassVar[dict[str, Any]] = {"d": [0.02, 0.8]}

    along: dict[str, Values] | None = Field(
        None,
        description="parameter over which critical distances are followed: Ca_e or De, with its values (a list or a "
        "range); default: the values of the case only",
    )
    lines: dict[str, Values] | None = Field(
        None, description="the other parameter, with its values (a list or a range): each gives a line of its own"
    )
    d: tuple[Distance, Distance] = Field(
        (0.02, 0.8), description="least and largest distance of the search for zeros of dU [D_c]"
    )

    @property
    def gaps(self) -> tuple[float, ...]:
        """The largest distance [D_c], which sets the length of the tube."""
        return (max(self.d),) * (self.n - 1)

    @property
    def range_of_d(self) -> tuple[float, float]:
        """See `SceneCase`."""
        return self.d

    @property
    def values_of_De(self) -> tuple[float, ...]:
        """See `SceneCase`."""
        followed = [De for line in (self.along, self.lines) if line for De in line.get("De", ())]
        return (self.De, *followed)

    def _slug_parts(self) -> list[str]:
        return ["critical", *super()._slug_parts()]


def check_curve(case: CurveCase) -> Iterator[Mistake]:
    """Check the keys of a curve against each other; yields mistakes as `check_scene` does."""
    if case.n < 1:
        yield Mistake("particles", case.n, "must be at least 1 for a curve")
        return
    if case.n > 1 and case.d is None:
        yield missing("d", f"must be {_RANGE}")
    if case.n == 1 and case.d is not None:
        yield Mistake("d", list(case.d), "must be left out: there is only one particle")
    wrong = [place for place in case.d or () if isinstance(place, tuple) and len(place) != case.n - 1]
    if wrong and case.n > 1:
        yield Mistake("d", list(wrong[0]), f"must be numbers, or lists of {case.n - 1} numbers, one for each gap")
        return
    if case.fields and not case.common:
        yield Mistake("fields", list(case.fields), "must be left out if the gaps have different distances")
    elif case.fields and case.places:
        least, most = case.range_of_d
        allowed = f"must be between the smallest and the largest d, {least:g} and {most:g}"
        yield from (Mistake("fields", d, allowed) for d in case.fields if not least <= d <= most)
    moved, at_rest = case.velocity is not None, case.flow == 0
    yield from broken(
        case,
        ("velocity", moved and any(case.Ca_es), "must be left out: only rigid particles (Ca_e: 0) can be moved"),
        ("flow", at_rest and not case.velocity, "must be 1: nothing moves, unless velocity is given and not 0"),
        ("flow", at_rest and case.physical is not None, "must be 1 with a physical block, whose velocity is its unit"),
    )
    yield from check_scene(case)


def check_critical(case: CriticalCase) -> Iterator[Mistake]:
    """Check the keys of critical distances against each other; yields mistakes as `check_scene` does."""
    if case.n != 2:
        yield Mistake("particles", case.n, "must be 2: a critical distance is that of a pair")
        return
    if case.d[0] >= case.d[1]:
        yield Mistake("d", list(case.d), "must be [least, largest] in ascending order")
    for key, values in (("along", case.along), ("lines", case.lines)):
        if values is None:
            continue
        if len(values) != 1 or next(iter(values)) not in ("Ca_e", "De"):
            allowed = f"must be Ca_e or De with its values, such as {key}: {{Ca_e: [0.05, 0.1]}}"
            yield Mistake(key, dict(values), allowed)
            continue
        (name, given), *_ = values.items()
        least, most = FOLLOWED[name]
        if wrong := [value for value in given if not least <= value <= most]:
            yield Mistake(key, wrong[0], f"must be values of {name} from {least:g} to {most:g}")
        if "Ca_e" in values and case.Ca_e is not None and len({Ca_e for Ca_e in case.Ca_es if Ca_e}) != 1:
            yield Mistake("Ca_e", case.Ca_e, f"must be a single value above 0, as {key} replaces it")
        if "De" in values and is_viscous(dict(case)):
            yield Mistake(key, dict(values), "must be Ca_e: the liquid has no relaxation time, and so no De")
        elif "De" in values and case.De == 0:
            yield Mistake("De", case.De, f"must be above 0, as {key} replaces it")
    if case.lines is not None and (case.along is None or case.lines.keys() == case.along.keys()):
        allowed = "must be the parameter that along does not have; along must be given, too"
        yield Mistake("lines", dict(case.lines), allowed)
    yield from check_scene(case)
