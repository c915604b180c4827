"""Compute the quasi-steady master curve dU(d) and its zeros.

The case file has d (distances in tube diameters D_c: a list, or {start, stop,
num, spacing}) in place of d0. Writes curve.csv (dU in U_av), equilibria.csv,
slopes.csv of more than two particles, curve.png of two points or more,
case.yaml and run.json.

Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
system at fault (pairsim doctor), 5 no steady state there, 130 interrupted.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field

from pairsim.cases.accuracy import DEFAULT, percent
from pairsim.cases.case import SceneCase
from pairsim.cases.estimate import Estimate, steady_estimate
from pairsim.cases.keys import Key, Part
from pairsim.cases.mistakes import Mistake, missing
from pairsim.cases.off_axis import OffAxisCase, points_off_axis
from pairsim.cases.spread import SpreadCase
from pairsim.cases.values import (
    MOST_VALUES,
    DistanceOrLength,
    Gaps,
    Number,
    Range,
    Time,
    Whole,
    spelled_out,
)
from pairsim.computing.off_axis.columns import NAME, TABLE
from pairsim.computing.question import Flag, InSweeps, Question
from pairsim.physics.drive import Drive
from pairsim.quantities.kinds import RATE
from pairsim.questions.curve.result import CurveResult, result_columns, row_in_sweeps
from pairsim.record.column import PARTICLE, Column, Columns
from pairsim.record.columns import CURVE_COLUMNS, DISTANCE, EQUILIBRIA_COLUMNS, WAY_COLUMNS
from pairsim.record.run_entries import OF_STEADY, SPREAD_OF_PARTICLES, TIME_STEPS, Entry
from pairsim.runtime.errors import Argument, InputError
from pairsim.runtime.plain import Plain
from pairsim.solvers.curves.distances import between
from pairsim.solvers.parameters import Parameters

if TYPE_CHECKING:
    from pairsim.computing.events import Events
    from pairsim.computing.workers import Workers
    from pairsim.plots.style import Page
    from pairsim.runtime.monitor import Monitor

GAP_OF_SLOPE = Column("gap", "", "number of the distance that varies in the derivative, from upstream", whole=True)
U_SLOPE = Column(
    "U_slope",
    r"\partial U{_}/\partial d",
    "derivative of U{_} with respect to a distance, to first order in the effect of the motion; exact where dU = 0",
    RATE,
    PARTICLE,
)
U_SLOPE_HELD = Column(
    "U_slope_held",
    r"\partial U_{h{,}}/\partial d",
    "derivative of U{_} at held distances with respect to a distance",
    RATE,
    PARTICLE,
)
SLOPES = Columns(DISTANCE, GAP_OF_SLOPE, U_SLOPE, U_SLOPE_HELD)
"""The columns of slopes.csv."""
AFTER = Entry[float]("after", "a quarter of the time from rest after which dU of the curve is taken [D_c/U_av]")


def _check_d(case: CurveCase) -> Iterator[Mistake]:
    """Yield the mistake of distances that do not fit the number of gaps, or that a curve from rest cannot have."""
    gaps, given = case.n - 1, case.d or ()
    lists = [list(place) for place in given if isinstance(place, tuple)]
    numbers = [place for place in given if isinstance(place, float)]
    one_varies = len(given) == gaps and len(numbers) == gaps - 1 and case.after is None
    if gaps and case.d is None:
        yield missing("d", "must be a list, or {start, stop, num, spacing: log or linear}")
    elif not gaps and case.d is not None:
        yield Mistake("d", list(case.d), "must be left out: there is only one particle")
    elif gaps and (wrong := [each for each in lists if len(each) != gaps]):
        yield Mistake("d", wrong[0], f"must be numbers, or lists of {gaps} numbers, one for each gap")
    elif case.varied is not None and not one_varies:
        yield Mistake("d", None, f"must be {gaps} numbers, one for each gap; without after, one of them may be a range")
    elif gaps and case.after is not None and not case.common:
        yield Mistake("d", case.d, "must be one number for all gaps with after")


def _check_fields(case: CurveCase) -> Iterator[Mistake]:
    """Yield the mistakes of distances at which no fields can be written."""
    if case.fields and not case.common:
        yield Mistake("fields", case.fields, "must be left out if the gaps have different distances")
    elif case.fields and case.places:
        least, most = case.range_of_d
        allowed = f"must be between the smallest and the largest d, {least:g} and {most:g}"
        yield from (Mistake("fields", d, allowed) for d in case.fields if not least <= d <= most)
    if case.fields and case.after is not None:
        yield Mistake("fields", case.fields, "must be left out with after: pairsim run with hold: true writes fields")


def _check_velocity(case: CurveCase) -> str:
    """What the velocity of the particles must be, or "" if it is right."""
    if case.velocity is None:
        return ""
    if case.after is not None:
        return "must be left out with after"
    return "must be left out: only rigid particles (Ca_e: 0) can be moved" if any(case.Ca_es) else ""


def _check_after(case: CurveCase) -> str:
    alone = case.after is not None and case.n < 2
    return "must be left out: there is only one particle" if alone else ""


def _check_flow(case: CurveCase) -> str:
    """What the flow must be, or "" if it is right."""
    if case.flow:
        return ""
    if not case.velocity:
        return "must be 1 unless velocity is given, and not 0: else nothing moves"
    return "" if case.physical is None else "must be 1 with a physical block, whose velocity is the unit"


PLACES = Key(part=Part.REPORT, usual={"start": 0.02, "stop": 0.8, "num": 9}, check=_check_d, first=True)
FIELDS_AT = Key(part=Part.REPORT, lengths=True, check=_check_fields)
SPEEDS = Field(ge=-1e3, le=1e3)


class CurveCase(OffAxisCase, SpreadCase):
    """A master curve dU(d): quasi-steady solutions at many distances d."""

    kind: ClassVar[str] = "curve"

    d: Annotated[Gaps | None, PLACES] = Field(
        None,
        description="distances between the facing surfaces [D_c]: a list of numbers (or of lists with one number for "
        "each gap), or a range, or one number for each gap with a range for one of them; points are added between "
        "these where they are more than a factor of 1.8 apart, or where tol requires it",
    )
    tol: Annotated[Number, Key(part=Part.NUMERICS)] = Field(
        percent(DEFAULT) / 100,
        ge=1e-9,
        le=1,
        description="points are added until the half-width of the interval of dU between them is below this fraction "
        "of the largest |dU|, or below twice the half-width at the points (default: accuracy)",
    )
    max_points: Annotated[Whole, Key(part=Part.NUMERICS)] = Field(
        200, ge=1, le=MOST_VALUES, description="no points are added once the curve has this many"
    )
    fields: Annotated[tuple[DistanceOrLength, ...], FIELDS_AT] = Field(
        (),
        max_length=MOST_VALUES,
        description="distances at which fields are written to fields.xdmf [D_c]; with a physical block also lengths "
        "with their unit",
    )
    velocity: Annotated[Annotated[Number, SPEEDS] | None, Key(slug="velocity", check=_check_velocity)] = Field(
        None,
        description="velocity at which the rigid particles are moved [U_av], 0 to hold them in place; the forces that "
        "this requires are in curve.csv (default: no force acts on the particles)",
    )
    after: Annotated[Time | None, Key("T", "D_c/U_{av}", caption=9, slug="after", check=_check_after)] = Field(
        None,
        description="dU after a start from rest at held distances, at this time, twice and four times it [D_c/U_av], "
        "instead of steady states; for liquids whose stress depends on the history, as below a yield stress",
    )
    flow: Annotated[Literal[0, 1], Key(check=_check_flow)] = Field(
        1,
        description="mean velocity of the liquid in the tube [U_av]; with 0 there is no net flow (developed ends are "
        "closed) and velocity must be given: with velocity: 1, velocities are in units of that of the particles",
    )

    def _defaults(self) -> dict[str, Plain]:
        return super()._defaults() | {"tol": self.error_wanted}

    @property
    def places(self) -> list[tuple[float, ...]]:
        """The requested distances [D_c] in the order of the file, a tuple with one value for each gap."""
        if self.n < 2:
            return [()]
        gaps: list[Any] = list(self.d or ())
        if (at := self.varied) is not None:
            return [(*gaps[:at], d, *gaps[at + 1 :]) for d in spelled_out(gaps[at])]
        return [v if isinstance(v, tuple) else (v,) * (self.n - 1) for v in gaps]

    @property
    def varied(self) -> int | None:
        """The index of the only gap whose distance varies, which is given as a range; None if there is no range."""
        return next((i for i, d in enumerate(self.d or ()) if isinstance(d, Range)), None)

    @property
    def gaps(self) -> tuple[float, ...]:
        """The largest distance of each gap [D_c], which sets the length of the tube."""
        return tuple(max(values) for values in zip(*self.places, strict=True))

    @property
    def first_gaps(self) -> tuple[float, ...]:
        return self.in_order[0]

    @property
    def first_case(self) -> SceneCase:
        if self.after is None:
            return self
        from pairsim.questions.curve.from_rest import run_at

        return run_at(self, self.first_gaps)

    @property
    def range_of_d(self) -> tuple[float, float]:
        values = [d for place in self.places for d in place]
        return min(values), max(values)

    @property
    def has_history(self) -> bool:
        return self.after is not None

    @property
    def drive(self) -> Drive:
        return replace(super().drive, flow=float(self.flow), velocity=self.velocity)

    @property
    def of_free_pairs(self) -> bool:
        return self.n == 2 and self.velocity is None and self.after is None

    @property
    def common(self) -> bool:
        """Whether all gaps have the same distance at every point, or only one varies: the result is a curve over d."""
        return self.varied is not None or (self.n > 1 and all(len(set(place)) == 1 for place in self.places))

    @property
    def in_order(self) -> list[tuple[float, ...]]:
        """The distances in the order of solution, a tuple with one value for each gap.

        A curve begins at its largest distance, where a first solution is easiest to find; other distances are solved in
        the order of the file.
        """
        if self.common:
            start = Parameters(self.places[0], (), varied=self.varied)
            wanted = {place[self.varied or 0] for place in self.places} | set(self.fields)
            return [start.with_gap(d).gaps for d in sorted(wanted, reverse=True)]
        return self.places

    def _slug_parts(self) -> list[str]:
        return [*super()._slug_parts(), *([] if self.flow else ["at-rest"])]


def check(case: CurveCase) -> Iterator[Mistake]:
    """Yield the mistake of a case without particles."""
    if case.n < 1:
        yield Mistake("particles", case.n, "must be at least 1 for a curve")


def estimate(case: CurveCase) -> Estimate:
    """Size and duration of a master curve: points requested, points between these, and a third more where dU bends."""
    points = len(case.places)
    if case.after is not None:
        from pairsim.questions.curve.from_rest import estimate_from_rest

        return estimate_from_rest(case, points)
    if case.common and points > 1:
        points = len(between(sorted(case.places), case.max_points))
        points = max(min(points + -(-points // 3), case.max_points), points)
    return steady_estimate(case, points - 1 + points_off_axis(case))


def solve(case: CurveCase, *, monitor: Monitor, workers: Workers, sensitivities: bool = False) -> Events:
    """Compute a master curve and, for a pair, its zeros; on request derivatives of dU by Ca_e, De, xi and beta."""
    if case.after is not None:
        from pairsim.questions.curve.from_rest import from_rest

        if sensitivities:
            allowed = "must be left out with after: derivatives are known of steady states only"
            raise InputError("pairsim curve", Argument("sensitivities"), None, allowed)
        return from_rest(case, monitor, workers)
    from pairsim.questions.curve.computation import computation

    return computation(case, monitor, workers, sensitivities)


def draw(folder: Path, out: Path, page: Page) -> list[Path]:
    """Draw the tables of a folder."""
    from pairsim.plots.runs_and_curves import draw_curve

    return draw_curve(folder, out, page)


QUESTION = Question(
    __name__,
    model=CurveCase,
    check=check,
    estimate=estimate,
    solve=solve,
    tables={
        "curve": CURVE_COLUMNS,
        "equilibria": EQUILIBRIA_COLUMNS,
        "slopes": SLOPES,
        NAME: TABLE,
        "way": WAY_COLUMNS,
    },
    entries=(*OF_STEADY, TIME_STEPS, AFTER, SPREAD_OF_PARTICLES),
    result=CurveResult,
    in_sweeps=InSweeps(result_columns, row_in_sweeps, drawn=True),
    draw=draw,
    captions={"curve": "Relative velocity and shapes over distance"},
    frames="d",
    draws_from=2,  # one point is no line, and loading matplotlib takes as long as solving for a point
    shared=True,
    flags=(Flag("sensitivities", "Add the derivatives of dU with respect to Ca_e, De, xi and beta."),),
    examples="Examples: pairsim curve configs/curve.yaml | pairsim curve case.yaml -o out --sensitivities "
    "--set 'd={start: 0.02, stop: 1, num: 12}' --workers 4 | pairsim curve gel.yaml --set after=1",
)
