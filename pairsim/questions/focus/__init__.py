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

from collections.abc import Iterator, Sequence
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import Field

from pairsim.cases.case import SceneCase
from pairsim.cases.estimate import Estimate, steady_estimate
from pairsim.cases.followed_key import FollowedKey
from pairsim.cases.keys import Key, PerGap
from pairsim.cases.mistakes import Mistake, missing
from pairsim.cases.physical import BLOCK, DENSITY, QUANTITIES
from pairsim.cases.quantity_text import ValuesOrQuantities, si
from pairsim.cases.values import Distance, Whole, is_finite
from pairsim.computing.question import InSweeps, Question
from pairsim.computing.result import Result
from pairsim.quantities.kinds import POSITION, RATE
from pairsim.record.column import ENTRY, MODE, Column, Columns, Shown
from pairsim.record.columns import CA_E, DE, DISTANCE, NEWTON, POLYMER_HEALTH, STEADY_HEALTH, U_ERROR, WAY_COLUMNS, U
from pairsim.record.run_entries import OF_STEADY
from pairsim.solvers.parameters import Parameters

if TYPE_CHECKING:
    from pairsim.computing.events import Events
    from pairsim.plots.style import Page
    from pairsim.runtime.monitor import Monitor

FOLLOWED = {each.name: each for each in (DISTANCE, CA_E, DE)}
"""What rates are followed over, by the key in `along`."""
IN_UNITS = QUANTITIES["distance"]
"""The quantity by which distances are given there, too."""
KEYS = *FOLLOWED, f"{BLOCK}.{IN_UNITS.key}"
"""The keys in `along`."""
MOST = 5  # particles; chosen
LEAST_D, MOST_D = 1e-4, 1e4  # distances, as of the key d [D_c]
DISTURBED = 2.0  # factor of the time for disturbances, half-widths and inertia; measured in docs/how-to/focus.md

VERDICT = Column(
    "verdict",
    "",
    "focuses: small displacements from the axis decay; leaves: some grow; swings: they oscillate, and neither decay "
    "nor grow; stays: they do not change at all; undecided: not certain",
)
GROWTH = Column(
    "growth",
    r"\mathrm{Re}\,\lambda",
    "largest growth rate of displacements; negative: they decay",
    RATE,
    half_width="growth_error",
)
GROWTH_ERROR = Column("growth_error", r"\epsilon", "half-width of its interval: error by mesh", RATE, unknown=True)
TUBE = Column(
    "tube",
    "L",
    "length of tube for a tenfold smaller (leaves: larger) displacement, ln(10) U/|growth|",
    POSITION,
    unknown=True,
)
TUBE_LEAST = Column("tube_least", r"L_\mathrm{min}", "the least by the interval of growth", POSITION, unknown=True)
TUBE_MOST = Column("tube_most", r"L_\mathrm{max}", "the largest by it", POSITION, unknown=True)
RE_MOST = Column(
    "Re_most",
    r"\mathrm{Re}_c",
    "Reynolds number rho U_av D_c/eta_0 up to which displacements decay, to first order in it; 0: they do not decay "
    "without inertia; empty: inertia does not prevent it, or it is not known",
    unknown=True,
)
RE = Column("Re", r"\mathrm{Re}", "Reynolds number of the experiment, with physical.density")
A = Column("a", r"a{_}", "velocity away from the axis of {of}", RATE, ENTRY, half_width="a_error")
A_ERROR = Column(
    "a_error", r"\epsilon{_}", "half-width of the interval of a{_}: error by mesh", RATE, ENTRY, unknown=True
)
AT_REST = Column(
    "at_rest",
    r"a^0{_}",
    "a{_} if stresses and shapes were those of displacements that do not change",
    RATE,
    ENTRY,
    Shown.ON_REQUEST,
)
MODE_GROWTH = Column("rate", r"\mathrm{Re}\,\lambda{_}", "growth rate of {of}", RATE, MODE)
FREQUENCY = Column("frequency", r"\mathrm{Im}\,\lambda{_}", "angular frequency of {of}", RATE, MODE)
UNKNOWNS = Column("disturbed", "n", "unknowns of the disturbances", shown=Shown.ON_REQUEST, whole=True)
INTERVALS = VERDICT, GROWTH, GROWTH_ERROR, TUBE, TUBE_LEAST, TUBE_MOST, RE_MOST
MATRIX = A, A_ERROR, AT_REST, MODE_GROWTH, FREQUENCY
TABLE = Columns(DISTANCE, CA_E, DE, U, U_ERROR, INTERVALS, RE, MATRIX, NEWTON, UNKNOWNS, STEADY_HEALTH, POLYMER_HEALTH)
"""The columns that focus.csv may have, in their order."""


def column_of(key: str) -> Column:
    """The column of what is followed by its key in `along`."""
    return FOLLOWED.get(key, DISTANCE)


def _check_d(case: FocusCase) -> Iterator[Mistake]:
    """Yield the mistake of a distance that is missing, or given where there is none or `along` has it."""
    if case.n > 1 and case.d is None and not case.spreads:
        yield missing("d", "must be a number, the distance between facing surfaces, or along: {d: [...]} be given")
    elif case.d is not None and case.n == 1:
        yield Mistake("d", case.d, "must be left out: there is only one particle")
    elif case.d is not None and case.spreads:
        yield Mistake("d", case.d, "must be left out: along has its values")


def _check_along(case: FocusCase) -> str:
    """What `along` must be: what is followed, and its values."""
    if case.along is None:
        return ""
    if len(case.along) != 1 or case.key not in KEYS:
        return f"must be one key of {', '.join(KEYS)} with its values, such as along: {{Ca_e: [0.01, 0.02]}}"
    given = case.along[case.key]
    if not case.spreads:
        try:
            FollowedKey.of(case, case.key, given)
        except ValueError as error:
            return str(error)
        return ""
    if case.n == 1:
        return "must be Ca_e or De: there is only one particle"
    if case.key not in FOLLOWED:
        return _allowed_in_units(case, given)
    if all(is_finite(each) and LEAST_D <= each <= MOST_D for each in given):
        return ""
    return f"must be distances from {LEAST_D:g} to {MOST_D:g} [D_c]; with units it is physical.distance"


def _allowed_in_units(case: FocusCase, given: Sequence[float | str]) -> str:
    """What distances with their units must be."""
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

    particles: Annotated[Whole, Key(caption=5)] = Field(
        1, ge=1, le=MOST, description="number of particles on the axis; they are displaced one by one"
    )
    d: Annotated[PerGap[Distance] | None, Key(slug="d", check=_check_d)] = Field(
        None, description="distance between the facing surfaces [D_c], unless along has it"
    )
    along: Annotated[dict[str, ValuesOrQuantities] | None, Key(check=_check_along, first=True)] = Field(
        None,
        description="what rates are followed over, with its values (a list or a range): Ca_e, De, or d or "
        "physical.distance of all gaps; default: the values of the case only",
        examples=["{Ca_e: [0.01, 0.02]}"],
    )

    @property
    def key(self) -> str:
        """What rates are followed over; "" where the values of the case alone are asked for."""
        return next(iter(self.along or ()), "")

    @property
    def series(self) -> tuple[float, ...]:
        """The values of what is followed, in the order of solution: distances from the largest down, else ascending."""
        given = (self.along or {}).get(self.key, ())
        if self.key not in FOLLOWED and self.scales is not None:
            given = tuple(IN_UNITS.number(si(each, IN_UNITS), self.scales) for each in given)
        values = sorted({float(each) for each in given})
        return tuple(values[:: -1 if self.spreads else 1])

    @property
    def spreads(self) -> bool:
        """Whether the distances are followed."""
        return bool(self.key) and column_of(self.key) is DISTANCE

    @property
    def places(self) -> list[Parameters]:
        """The parameters at which rates are computed, in the order of solution."""
        here = Parameters(self.each("d"), self.solid_models, self.liquid_model)
        if not self.key:
            return [here]
        if self.spreads:
            gaps = self.n - 1
            return [Parameters((d,) * gaps, here.solids, here.liquid) for d in self.series]
        followed = FollowedKey.of(self, self.key, self.series)
        materials = map(followed.materials, followed.values)
        return [Parameters(here.gaps, solids, liquid) for liquid, solids in materials]

    @property
    def gaps(self) -> tuple[float, ...]:
        """The largest distances [D_c], which set the length of the tube."""
        return (self.series[0],) * (self.n - 1) if self.spreads else self.each("d")

    @property
    def narrowest(self) -> float:
        """The smallest distance [D_c]; infinite without one."""
        return self.series[-1] if self.spreads else min(self.each("d"), default=inf)

    @property
    def reynolds_number(self) -> float | None:
        """The Reynolds number of the experiment; None where its density is not known."""
        density = self.experiment.values.get(DENSITY.key) if self.experiment is not None else None
        return float(self.scales.reynolds(density)) if self.scales and isinstance(density, float) else None

    @property
    def range_of_d(self) -> tuple[float, float]:
        return self.narrowest, max(self.gaps)

    @property
    def values_of_De(self) -> tuple[float, ...]:
        return (self.De, *(self.series if self.key == DE.name else ()))


def check(case: FocusCase) -> Iterator[Mistake]:
    """Yield mistakes in keys that all cases have."""
    if case.ends != "developed":
        yield Mistake("ends", case.ends, "must be developed: what leaves one end must not enter at the other one")
    if case.liquid_model.regularisation:
        allowed = "must be one without a yield stress: how much a rounded one changes the rates has not been judged"
        yield Mistake("liquid", case.laws.liquid.name, allowed)


def estimate(case: FocusCase) -> Estimate:
    """Size and duration."""
    return steady_estimate(case, max(len(case.series) - 1, 0), DISTURBED)


def solve(case: FocusCase, *, monitor: Monitor) -> Events:
    """Compute the rates at all values of what is followed."""
    from pairsim.questions.focus.computation import computation

    return computation(case, monitor)


class FocusResult(Result):
    """Rates of displaced particles. `table` is focus.csv, with a row for each value of what is followed."""

    def findings(self) -> list[str]:
        """Whether the particles stay on the axis, within which length of tube, and up to which Reynolds number."""
        from pairsim.questions.focus.answer import answer_of_focus

        if not self.columns.rows:
            return ["No rate was found."]
        return answer_of_focus(self.columns, self.record.scales)


def draw(folder: Path, out: Path, page: Page) -> list[Path]:
    """Draw the table of a folder."""
    from pairsim.questions.focus.picture import draw_focus

    return draw_focus(folder, out, page)


def columns_in_sweeps(case: FocusCase) -> list[str]:
    """What a sweep shows of it, for the last of its values."""
    known = [] if case.reynolds_number is None else [RE]
    return ["points", *(each.name for each in (*INTERVALS, *known))]


QUESTION = Question(
    __name__,
    model=FocusCase,
    check=check,
    estimate=estimate,
    solve=solve,
    tables={"focus": TABLE, "way": WAY_COLUMNS},
    entries=OF_STEADY,
    result=FocusResult,
    in_sweeps=InSweeps(columns_in_sweeps),
    draw=draw,
    captions={"focus": "Growth rates of displacements from the axis"},
    draws_from=2,  # one point is no line
    examples="Examples: pairsim focus configs/focus.yaml | "
    "pairsim focus case.yaml -o out --set 'along={Ca_e: [0.01, 0.05]}'",
)
