r"""Find the distances at which dU = 0, and follow them over a parameter.

The case file has along: {Ca_e: ...}, or De, a number of a law or a quantity
such as physical.flow_rate, with values or {start, stop, num, spacing}, and
d: \[least, largest], the range of distances in tube diameters D_c. Writes
critical.csv, critical.png, case.yaml and run.json.

Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
system at fault (pairsim doctor), 5 no steady state there, 130 interrupted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, TypedDict, cast

from pydantic import Field

from pairsim.cases.case import SceneCase
from pairsim.cases.estimate import Estimate, steady_estimate
from pairsim.cases.followed_key import FollowedKey
from pairsim.cases.keys import Key, Part
from pairsim.cases.quantity_text import ValuesOrQuantities
from pairsim.cases.values import Distance, Whole
from pairsim.computing.question import InSweeps, Question, Tables, Value
from pairsim.computing.result import Result
from pairsim.quantities.kinds import LENGTH, VELOCITY
from pairsim.quantities.text import in_unit
from pairsim.record.column import Column, Columns
from pairsim.record.columns import (
    BRANCH,
    CA_E,
    CORRECTED,
    D_CR,
    D_ERROR,
    DE,
    DP,
    DP_PLUS,
    DU_CORRECTION,
    DU_ERROR,
    ENDS_ERROR,
    FOLLOWED,
    KIND,
    NEWTON,
    PARAMETER_ERROR,
    SLOPE,
    STABLE,
    STEADY,
    TAYLOR,
    WAY_COLUMNS,
)
from pairsim.record.run_entries import OF_STEADY, Entry
from pairsim.runtime.message import Text
from pairsim.runtime.text import counted

if TYPE_CHECKING:
    from pairsim.analysis.zeros import Zero
    from pairsim.computing.events import Events
    from pairsim.computing.workers import Workers
    from pairsim.plots.style import Page
    from pairsim.quantities.scales import Scales
    from pairsim.record.record import Record
    from pairsim.record.table import Table
    from pairsim.runtime.monitor import Monitor

IN_RESULTS = {"zeros": D_CR, "stable": STABLE}
"""Columns of critical.csv that results.csv of a sweep contains, by their names there."""
U = Column("U", "U", "velocity of the pair", VELOCITY)
CRITICAL_COLUMNS = Columns(
    *(CA_E, DE, D_CR, STABLE, KIND, BRANCH, SLOPE, U, TAYLOR, DP, DP_PLUS),
    *(NEWTON, DU_CORRECTION, CORRECTED, DU_ERROR, ENDS_ERROR, D_ERROR, PARAMETER_ERROR),
)
"""The columns that critical.csv begins with."""
MOST_LISTED = 4  # number of followed values up to which an answer lists the zeros at every value; chosen


class EndOfBranch(TypedDict):
    """Where a branch of critical distances ends, as in run.json; see `EndOfLine`."""

    branch: int
    reason: str
    message: Text


ENDS = Entry[list[EndOfBranch]]("ends", "where each branch of critical distances ends, and why")


def _check_along(case: CriticalCase) -> str:
    """What `along` must be, or "" if it is right."""
    if case.along is None:
        return ""
    if len(case.along) != 1:
        return "must be one key with its values, such as along: {Ca_e: [0.05, 0.1]}"
    (key, given), *_ = case.along.items()
    try:
        FollowedKey.of(case, key, given)
    except ValueError as error:
        return str(error)
    return ""


def _check_d(case: CriticalCase) -> str:
    return "" if case.d[0] < case.d[1] else "must be the smallest and the largest distance, in ascending order"


class CriticalCase(SceneCase):
    """Critical distances: zeros of dU(d), optionally followed over a parameter."""

    kind: ClassVar[str] = "critical"

    particles: Whole = Field(2, ge=2, le=2, description="2: a critical distance is that of a pair")
    along: Annotated[dict[str, ValuesOrQuantities] | None, Key(check=_check_along)] = Field(
        None,
        description="the parameter over which critical distances are followed, with its values (a list or a range): "
        "Ca_e, De, a number of a law such as liquid.alpha, or a quantity such as physical.flow_rate on which only the "
        "liquid and the softness depend; default: the values of the case only",
        examples=["{Ca_e: [0.05, 0.1]}"],
    )
    d: Annotated[tuple[Distance, Distance], Key(part=Part.REPORT, usual=[0.02, 0.8], check=_check_d)] = Field(
        (0.02, 0.8), description="smallest and largest distance between which zeros of dU are sought [D_c]"
    )

    @property
    def gaps(self) -> tuple[float, ...]:
        """The largest distance [D_c], which sets the length of the tube."""
        return (max(self.d),) * (self.n - 1)

    @property
    def range_of_d(self) -> tuple[float, float]:
        return self.d

    @property
    def followed(self) -> FollowedKey | None:
        """The key over which critical distances are followed; None if those of the case alone are asked for."""
        return None if self.along is None else FollowedKey.of(self, *next(iter(self.along.items())))

    @property
    def values_of_De(self) -> tuple[float, ...]:
        followed = self.followed
        along = () if followed is None else (followed.numbers(value).get("De", self.De) for value in followed.values)
        return (self.De, *along)


def estimate(case: CriticalCase) -> Estimate:
    """Size and duration: those of a search for zeros, and then of two branches over all values."""
    values = len(next(iter(case.along.values()))) if case.along else 1
    return steady_estimate(case, 15 + 4 * values)


def solve(case: CriticalCase, *, monitor: Monitor, workers: Workers) -> Events:
    """Find the critical distances, and follow them over the parameter of the case."""
    from pairsim.questions.critical.computation import computation

    return computation(case, monitor, workers)


def answer_of_critical(zeros: Sequence[Zero], record: Record) -> list[str]:
    """The answer, in words, of a search that has found critical distances."""
    lines = []
    scales = record.scales
    for stable, meaning in ((False, "closer pairs come together, wider ones separate"), (True, "pairs settle there")):
        found = sorted((zero for zero in zeros if zero.stable == stable), key=lambda zero: zero.d)
        if found:
            kind, ends = found[0].kind, found[:: max(len(found) - 1, 1)]
            where = f"d = {' to '.join(in_unit(scales, LENGTH, zero.d, zero.error) for zero in ends)}"
            lines.append(f"{counted(len(found), f'{kind} critical distance')}, {where}: {meaning}.")
    early = [end for end in ENDS.of(record) or () if end.get("reason") != "range"]  # the others reach the last value
    return [*lines, *(f"A line of critical distances ends: {end['message']}." for end in early)]


def read(tables: Tables, record: Record) -> dict[str, Value]:
    """The values of a case in results.csv; those of zeros are lists, in the order of critical.csv."""
    table = tables["critical"]
    wanted = table[KIND] == "wanted"
    return {"points": table.rows, **{name: table[of][wanted].tolist() for name, of in IN_RESULTS.items()}}


class CriticalResult(Result):
    """Critical distances. `table` is critical.csv, with a row for each zero of dU."""

    @property
    def ends(self) -> list[EndOfBranch]:
        """Where each branch of critical distances ends, and why."""
        return list(ENDS.of(self.record) or ())

    @property
    def followed(self) -> FollowedKey | None:
        """The key that was followed; None if there is none, or if its values have their own column, as Ca_e and De."""
        return cast("CriticalCase", self.case).followed if self.columns.has(FOLLOWED) else None

    def scales_of_rows(self, table: Table, scales: Scales) -> list[Scales]:
        if (followed := self.followed) is None or not table.has(FOLLOWED):
            return super().scales_of_rows(table, scales)
        return [followed.scales(float(value)) or scales for value in table[FOLLOWED]]

    @property
    def own_units(self) -> Mapping[str, str]:
        return {} if self.followed is None else {FOLLOWED.name: self.followed.unit}

    def findings(self) -> list[str]:
        """Which critical distances there are, and where branches of them end."""
        table = self.tables["critical"]
        if not table.rows:
            return ["No critical distance was found in the given range: dU keeps its sign."]
        from pairsim.analysis.zeros import zeros_in  # loads numpy

        asked = table[KIND] == "wanted"  # at the values of the case, not at points of a line between them
        shown = table.where(asked) if asked.any() else table
        lines = answer_of_critical(zeros_in(shown, D_CR), self.record)
        return lines if self.followed is None else [*lines, self._by_value(self.followed, shown)]

    def _by_value(self, followed: FollowedKey, table: Table) -> str:
        """The critical distances at the followed values, in words: at all if they are few, else at both ends."""
        from pairsim.analysis.zeros import zeros_in

        values = [value for value in followed.values if (table[FOLLOWED] == value).any()]
        listed = values if len(values) <= MOST_LISTED else values[:: len(values) - 1]
        found = []
        for value in listed:
            zeros = zeros_in(table.where(table[FOLLOWED] == value), D_CR)
            d = " and ".join(in_unit(self.record.scales, LENGTH, zero.d, zero.error) for zero in zeros)
            found.append(f"{d} at {value:.4g} {followed.unit}".rstrip())
        return f"Over {followed.key}: {', '.join(found)}."


def draw(folder: Path, out: Path, page: Page) -> list[Path]:
    """Draw the tables of a folder."""
    from pairsim.plots.critical import draw_critical

    return draw_critical(folder, out, page)


QUESTION = Question(
    __name__,
    model=CriticalCase,
    estimate=estimate,
    solve=solve,
    tables={"critical": Columns(CRITICAL_COLUMNS, STEADY, FOLLOWED), "way": WAY_COLUMNS},
    entries=(*OF_STEADY, ENDS),
    shared=True,
    result=CriticalResult,
    in_sweeps=InSweeps(lambda _: ("points", "zeros", "stable"), read, drawn=True),
    draw=draw,
    captions={"critical": "Critical distances"},
    examples="Examples: pairsim critical configs/critical.yaml | "
    "pairsim critical case.yaml --set 'along={Ca_e: [0.02, 0.05, 0.1]}'",
)
