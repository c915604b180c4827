r"""Compute whether particles stay on the axis, and how fast they return to it.

The case file has particles: 1 to 5 and, of several, d: the distances between
facing surfaces in tube diameters D_c; along: {d: ...} (or Ca_e, De) has several
values. Writes focus.csv (rates per displacement with their errors, a verdict,
the length of tube within which a small displacement falls to a tenth, and the
Reynolds number up to which this holds), focus.png, case.yaml and run.json.

Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
system at fault (pairsim doctor), 5 no steady state there, 130 interrupted.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, cast

from pydantic import Field

from pairsim.cases.case import COUNT, SceneCase
from pairsim.cases.checks import asked_by
from pairsim.cases.estimate import Estimate, steady_estimate
from pairsim.cases.followed_key import FollowedKey
from pairsim.cases.keys import Key, Part, PerGap, keys_of
from pairsim.cases.mistakes import Mistake, missing
from pairsim.cases.off_axis import MOST, YIELDS
from pairsim.cases.physical import BLOCK, QUANTITIES
from pairsim.cases.quantity_text import ValuesOrQuantities, si
from pairsim.cases.values import Distance, Whole, is_finite
from pairsim.computing.off_axis.columns import INTERVALS, NAME, RE, TABLE
from pairsim.computing.question import InSweeps, Question
from pairsim.computing.result import Result
from pairsim.record.column import Column
from pairsim.record.columns import CA_E, DE, DISTANCE, FOLLOWED, WAY_COLUMNS
from pairsim.record.folder import FIELDS_XDMF
from pairsim.record.run_entries import OF_STEADY
from pairsim.solvers.parameters import Parameters

if TYPE_CHECKING:
    from pairsim.computing.events import Events
    from pairsim.computing.workers import Workers
    from pairsim.plots.style import Page
    from pairsim.quantities.scales import Scales
    from pairsim.record.table import Table
    from pairsim.runtime.monitor import Monitor

BETA = "beta"
"""The key of diameters, which need a mesh each."""
COLUMNS = {each.name: each for each in (DISTANCE, CA_E, DE)}
"""Columns that every table has, by the key in `along` whose values they hold."""
IN_UNITS = QUANTITIES["distance"]
"""The quantity as which `along` may have distances with units."""
OF_DISTANCES = DISTANCE.name, f"{BLOCK}.{IN_UNITS.key}"
"""The keys of distances in `along`."""
LEAST_D, MOST_D = 1e-4, 1e4  # limits of distances, as for the key d [D_c]
LEAST_BETA, MOST_BETA = 1e-3, 0.999  # limits of diameters, as for the key beta [D_c]
DISTURBED = 2.0  # factor of the time for disturbances, half-widths and inertia; measured in docs/how-to/focus.md


def column_of(key: str) -> Column:
    """The column with the values of the followed key, the one in `along`."""
    return DISTANCE if key in OF_DISTANCES else COLUMNS.get(key, FOLLOWED)


@dataclass(frozen=True)
class Place:
    """Where rates are computed.

    Attributes:
        parameters: Distances and materials.
        value: The value of the followed key, in the unit of the case file; if no key is followed, the distance, or
            else the largest Ca_e, or else De.
        scales: The units there; None without a `physical` block.
    """

    parameters: Parameters
    value: float
    scales: Scales | None


def _check_d(case: FocusCase) -> Iterator[Mistake]:
    """Yield the mistake of a distance that is missing, or is given although there is no gap or `along` has it."""
    if case.n > 1 and case.d is None and not case.spreads:
        yield missing("d", "must be a number, the distance between facing surfaces, or along: {d: [...]} must be given")
    elif case.d is not None and case.n == 1:
        yield Mistake("d", case.d, "must be left out: there is only one particle")
    elif case.d is not None and case.spreads:
        yield Mistake("d", case.d, "must be left out: along gives its values")


def _check_along(case: FocusCase) -> str:
    """What `along`, the followed key with its values, must be, or "" if it is right."""
    if case.along is None:
        return ""
    if len(case.along) != 1:
        return "must be one key with its values, such as along: {Ca_e: [0.01, 0.02]}"
    given = case.along[case.key]
    if case.key == BETA:
        return _allowed_betas(case, given)
    if not case.spreads:
        try:
            FollowedKey.of(case, case.key, given)
        except ValueError as error:
            return str(error)
        return ""
    if case.n == 1:
        return "must be Ca_e or De: there is only one particle"
    if case.key != DISTANCE.name:
        return _allowed_in_units(case, given)
    if all(is_finite(each) and LEAST_D <= each <= MOST_D for each in given):
        return ""
    return f"must be distances from {LEAST_D:g} to {MOST_D:g} [D_c]; with units it is physical.distance"


def _allowed_betas(case: FocusCase, given: Sequence[float | str]) -> str:
    """What diameters in `along` must be, or "" if they are right."""
    if case.physical is not None:
        return f"must not be {BETA}, which follows from {BLOCK}.particle: use pairsim sweep"
    if len(set(case.betas)) > 1:
        return f"must go with a single {BETA}, which changes along it"
    if not all(is_finite(each) and LEAST_BETA <= each <= MOST_BETA for each in given):
        return f"must be diameters from {LEAST_BETA:g} to {MOST_BETA:g} [D_c]"
    for scene in case.scenes:
        for mistake in asked_by(keys_of(FocusCase)["length"], scene):
            return f"must be diameters that fit into the tube: at {BETA} = {scene.betas[0]:g} length {mistake.allowed}"
    return ""


def _allowed_in_units(case: FocusCase, given: Sequence[float | str]) -> str:
    """What distances with units in `along` must be, or "" if they are right."""
    if case.scales is None:
        return f"must be d: the case has no {BLOCK} block"
    try:
        numbers = [IN_UNITS.number(si(each, IN_UNITS), case.scales) for each in given]
    except ValueError as error:
        return str(error)
    inside = all(LEAST_D <= each <= MOST_D for each in numbers)
    return "" if inside else f"must be distances from {LEAST_D:g} to {MOST_D:g} tube diameters"


class FocusCase(SceneCase):
    """Particles on the axis that are displaced from it."""

    kind: ClassVar[str] = "focus"

    particles: Annotated[Whole, COUNT] = Field(
        1, ge=1, le=MOST, description="number of particles on the axis; they are displaced one by one"
    )
    d: Annotated[PerGap[Distance] | None, Key(slug="d", check=_check_d)] = Field(
        None, description="distance between the facing surfaces [D_c], unless along gives it"
    )
    along: Annotated[dict[str, ValuesOrQuantities] | None, Key(check=_check_along, first=True)] = Field(
        None,
        description="the parameter over which rates are followed, with its values (a list or a range): Ca_e, De, beta, "
        "d or physical.distance of all gaps, a parameter of a law such as liquid.alpha, or a quantity such as "
        "physical.flow_rate, on which only the liquid and the softness depend; default: the values of the case only",
        examples=["{Ca_e: [0.01, 0.02]}"],
    )

    fields: Annotated[bool, Key(part=Part.REPORT)] = Field(
        False,
        strict=True,
        description="whether the fields with all particles on the axis, and their disturbances by displacements of "
        "unit length, are written to fields.xdmf at each value",
    )

    @property
    def key(self) -> str:
        """The key over which rates are followed; "" if only those of the case are asked for."""
        return next(iter(self.along or ()), "")

    @property
    def followed(self) -> FollowedKey | None:
        """The followed key if only liquid and softness depend on it; None for distances, diameters or no key."""
        if not self.key or self.spreads or self.key == BETA:
            return None
        return FollowedKey.of(self, self.key, (self.along or {})[self.key])

    @property
    def series(self) -> tuple[float, ...]:
        """The values of the followed key, in the order of solution: distances descend, all others ascend."""
        if (followed := self.followed) is not None:
            return tuple(dict.fromkeys(followed.values))
        given = (self.along or {}).get(self.key, ())
        if self.key == OF_DISTANCES[1] and self.scales is not None:
            given = tuple(IN_UNITS.number(si(each, IN_UNITS), self.scales) for each in given)
        values = sorted({float(each) for each in given})
        return tuple(values[:: -1 if self.spreads else 1])

    @property
    def spreads(self) -> bool:
        """Whether the followed key is that of the distances."""
        return self.key in OF_DISTANCES

    @property
    def scenes(self) -> list[FocusCase]:
        """The cases with a mesh each: this one, or one for each of the followed diameters."""
        if self.key != BETA:
            return [self]
        given = {key: getattr(self, key) for key in self.model_fields_set - {"along", BETA}}
        return [type(self).model_validate(given | {BETA: value}) for value in self.series]

    @property
    def places(self) -> list[Place]:
        """Where rates are computed on one mesh, in the order of solution."""
        here = Parameters(self.each("d"), self.solid_models, self.liquid_model)
        if self.spreads:
            every = ((d,) * (self.n - 1) for d in self.series)
            return [Place(Parameters(gaps, here.solids, here.liquid), gaps[0], self.scales) for gaps in every]
        if (followed := self.followed) is None:
            alone = here.gaps[0] if here.gaps else max(here.Ca_es, default=0.0) or here.De
            return [Place(here, alone, self.scales)]
        found = list[Place]()
        for value in self.series:
            liquid, solids = followed.materials(value)
            found.append(Place(Parameters(here.gaps, solids, liquid), value, followed.scales(value)))
        return found

    @property
    def gaps(self) -> tuple[float, ...]:
        """The largest distances [D_c], which set the length of the tube."""
        return (self.series[0],) * (self.n - 1) if self.spreads else self.each("d")

    @property
    def narrowest(self) -> float:
        """The smallest distance [D_c]; infinite without one."""
        return self.series[-1] if self.spreads else min(self.each("d"), default=inf)

    @property
    def range_of_d(self) -> tuple[float, float]:
        return self.narrowest, max(self.gaps)

    @property
    def values_of_De(self) -> tuple[float, ...]:
        if (followed := self.followed) is None:
            return (self.De,)
        return (self.De, *(followed.numbers(value).get(DE.name, self.De) for value in followed.values))


def check(case: FocusCase) -> Iterator[Mistake]:
    """Yield the mistakes in keys that all cases have."""
    if case.ends != "developed":
        yield Mistake(
            "ends", case.ends, "must be developed: disturbances that leave one end must not re-enter at the other"
        )
    if case.liquid_model.regularisation:
        yield Mistake("liquid", case.laws.liquid.name, YIELDS)


def estimate(case: FocusCase) -> Estimate:
    """The largest size of a mesh, and the duration on all of them."""
    every = [steady_estimate(scene, len(scene.places) - 1, DISTURBED) for scene in case.scenes]
    return replace(max(every, key=lambda each: each.unknowns), seconds=sum(each.seconds for each in every))


def solve(case: FocusCase, *, monitor: Monitor, workers: Workers) -> Events:
    """Compute the rates at all values of the followed key."""
    from pairsim.questions.focus.computation import computation

    return computation(case, monitor, workers)


class FocusResult(Result):
    """Rates of displaced particles. `table` is focus.csv, with a row for each value of the followed key."""

    @property
    def followed(self) -> FollowedKey | None:
        """The key that was followed; None if there is none, or if its values have their own column, as Ca_e and De."""
        return cast("FocusCase", self.case).followed if self.columns.has(FOLLOWED) else None

    def _place_of(self, text: str) -> float:
        followed = cast("FocusCase", self.case).followed
        return super()._place_of(text) if followed is None else followed.value_of(text)

    def scales_of_rows(self, table: Table, scales: Scales) -> list[Scales]:
        if not table.has(FOLLOWED) or (followed := self.followed) is None:
            return super().scales_of_rows(table, scales)
        return [followed.scales(float(value)) or scales for value in table[FOLLOWED]]

    @property
    def own_units(self) -> Mapping[str, str]:
        return {} if (followed := self.followed) is None else {FOLLOWED.name: followed.unit}

    def findings(self) -> list[str]:
        """Whether the particles stay on the axis, within which length of tube, and up to which Reynolds number."""
        from pairsim.computing.off_axis.answer import answer_of_focus

        table, scales, along = self.columns, self.record.scales, None
        if not table.rows:
            return ["No rate was found."]
        if key := (case := cast("FocusCase", self.case)).key:
            along = DISTANCE.name if case.spreads else key, "" if self.followed is None else self.followed.unit
        return answer_of_focus(table, None if scales is None else self.scales_of_rows(table, scales), along)


def draw(folder: Path, out: Path, page: Page) -> list[Path]:
    """Draw the table of a folder, and streamlines of its fields."""
    from pairsim.questions.focus.picture import draw_focus

    drawn = draw_focus(folder, out, page)
    if (folder / FIELDS_XDMF).exists():
        from pairsim.questions.focus.streamlines import draw_streamlines

        drawn += draw_streamlines(folder, out, page)
    return drawn


def columns_in_sweeps(case: FocusCase) -> list[str]:
    """The columns of results.csv, whose values are those in the last row of focus.csv."""
    known = [] if case.reynolds_number is None else [RE]
    return ["points", *(each.name for each in (*INTERVALS, *known))]


QUESTION = Question(
    __name__,
    model=FocusCase,
    check=check,
    estimate=estimate,
    solve=solve,
    tables={NAME: TABLE, "way": WAY_COLUMNS},
    entries=OF_STEADY,
    shared=True,
    result=FocusResult,
    in_sweeps=InSweeps(columns_in_sweeps),
    draw=draw,
    captions={
        "focus": "Growth rates of displacements from the axis",
        "disturbance": "What displacements of a particle add to the velocity, in their plane, in the frame of the tube",
    },
    frames="value",
    draws_from=2,  # one point is no line
    examples="Examples: pairsim focus configs/focus.yaml | "
    "pairsim focus case.yaml -o out --set 'along={Ca_e: [0.01, 0.05]}'",
)
