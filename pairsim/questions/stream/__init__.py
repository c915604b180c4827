"""Compute how streams of beads that differ develop along the tube, and how many beads each drop gets.

The case file has d (mean distance between facing surfaces, in tube diameters
D_c) or stream: {concentration: ...}, or the positions of the beads; spread: how
much they differ; stream: {drop: ...}, the length of tube whose liquid one drop
takes. Writes stream.csv (spread of the distances, beads in contact, shares of
drops with none, one, two and more beads, at fifty lengths of tube),
distances.csv (their histograms), kymograph.csv, stream.png, kymograph.png,
case.yaml and run.json.

Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
system at fault (pairsim doctor), 5 no steady state there, 130 interrupted.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from pairsim.cases import values
from pairsim.cases.case import ENDS, Ends
from pairsim.cases.estimate import Estimate, steady_estimate
from pairsim.cases.keys import Key, Keys
from pairsim.cases.mistakes import Mistake, missing
from pairsim.cases.spread import SpreadCase
from pairsim.computing.question import InSweeps, Question
from pairsim.computing.result import Result
from pairsim.quantities.kinds import LENGTH, POSITION
from pairsim.questions.stream.positions import read_positions
from pairsim.record.column import Column, Columns, Shown
from pairsim.record.columns import T, Z
from pairsim.record.run_entries import POINTS, SPREAD_OF_PARTICLES, Entry
from pairsim.runtime.plain import Plain

if TYPE_CHECKING:
    from pairsim.computing.events import Events
    from pairsim.computing.workers import Workers
    from pairsim.plots.style import Page
    from pairsim.runtime.monitor import Monitor

LONG = 50.0  # length of the tube of short rows over the diameter of a bead, as for other cases with periodic ends
LEAST_BEADS = 10  # least number of beads of a stream; chosen
NEAREST = 0.1  # least mean distance between the surfaces of beads, over their diameter; chosen


def _with_errors(column: Column) -> tuple[Column, Column, Column]:
    """A column, and two columns with the half-widths of its intervals: by the streams drawn, and by the model."""
    half = f"half-width of the interval of {column.name}: "
    error = Column(f"{column.name}_error", r"\epsilon", f"{half}finite number of streams", unknown=True)
    model = Column(
        f"{column.name}_model",
        r"\epsilon_m",
        f"{half}model of the row, from the first stream",
        unknown=True,
    )
    return replace(column, half_width=error.name), error, model


def _of_drops(name: str, symbol: str, words: str) -> Column:
    return Column(name, symbol, f"share of drops with {words}", shown=Shown.ALWAYS, unknown=True)


POSITION_OF_STREAM = Column(
    "position", "z", "mean distance that the beads have moved along the tube", POSITION, shown=Shown.ALWAYS
)
MEAN_D = Column("d_mean", r"\bar d", "mean distance between the facing surfaces of neighbours", LENGTH)
SPREAD = Column(
    "d_spread", r"\sigma_d/\bar d", "standard deviation of the distances over their mean", shown=Shown.ALWAYS
)
IN_CONTACT = Column("in_contact", "c", "share of beads that touch another one", shown=Shown.ALWAYS)
EMPTY = _of_drops("empty", "P_0", "no bead")
SINGLE = _of_drops("single", "P_1", "one bead")
DOUBLE = _of_drops("double", "P_2", "two beads")
MORE = _of_drops("more", r"P_{3+}", "three beads or more")
OF_DROPS = EMPTY, SINGLE, DOUBLE, MORE
STATISTICS = SPREAD, IN_CONTACT, *OF_DROPS
"""The columns with half-widths, in the order of the numbers in `Way.counted` (`statistics.py`)."""
POISSON = {
    each: Column(
        f"{each.name}_poisson", f"{each.symbol}", f"{each.meaning} if beads arrived independently", unknown=True
    )
    for each in OF_DROPS
}
STREAM = Columns(
    *(POSITION_OF_STREAM, T, MEAN_D),
    *(part for each in STATISTICS for part in _with_errors(each)),
    *POISSON.values(),
)
"""The columns of stream.csv."""
LEAST = Column("least", "d", "least distance of the bin", LENGTH)
LARGEST = Column("largest", "d", "largest distance of the bin", LENGTH)
PART = Column(
    "part", "p", "fraction of the distances in the bin; the last bin at each length of tube includes all larger ones"
)
DISTANCES = Columns(POSITION_OF_STREAM, LEAST, LARGEST, PART)
"""The columns of distances.csv."""
KYMOGRAPH = Columns(POSITION_OF_STREAM, T, Z)
"""The columns of kymograph.csv."""
SENTENCES = Entry[list[str]]("sentences", "the answer in words")


AS_LONG = "must be left out: the program chooses the length of the tube of short rows"


def _places(case: StreamCase) -> list[str]:
    """Which of the keys that determine the distances between beads are given; there must be one."""
    stream = case.stream
    places = {"d": case.d, "stream.concentration": stream.concentration, "stream.positions": stream.positions}
    return [key for key, value in places.items() if value is not None]


def _too_many(case: StreamCase, key: str) -> str:
    """That one of these keys must be left out, if another one before it is given, too; else ""."""
    first, *others = _places(case) or [key]
    return f"must be left out if {first} is given" if key in others else ""


def _too_near(case: StreamCase, d: float) -> str:
    """What a key must be that gives the mean distance `d` [D_c], if this is too small; else ""."""
    near = d < NEAREST * max(case.betas, default=0.0) or d <= case.stream.min_gap
    return f"must leave beads {NEAREST:g} of their diameter apart on average" if near else ""


def _check_d(case: StreamCase) -> Iterator[Mistake]:
    """Yield the mistake of streams whose mean distance is not given, or is too small."""
    if not _places(case):
        yield missing(
            "d", "must be a number, the mean distance, or stream.concentration or stream.positions must be given"
        )
    elif case.d is not None and (why := _too_near(case, case.d)):
        yield Mistake("d", case.d, why)


def _check_concentration(case: StreamCase) -> str:
    if case.stream.concentration is None:
        return ""
    beta = max(case.betas, default=0.0)
    about = spacing_of(case, 2 - 4 / 3 * beta**2) - beta  # with an estimate of the velocity of a bead
    return _too_many(case, "stream.concentration") or _too_near(case, about)


def _check_positions(case: StreamCase) -> str:
    given = case.stream.positions
    if isinstance(given, str):  # a file that could not be read
        try:
            read_positions(Path(given), case.scales)
        except ValueError as error:
            return str(error)
    if (wrong := _too_many(case, "stream.positions")) or not isinstance(given, tuple):
        return wrong
    if len(given) < LEAST_BEADS:
        return f"must be at least {LEAST_BEADS} numbers"
    apart, beta = min(after - before for before, after in pairwise(sorted(given))), min(case.betas, default=0.0)
    near = f"two are {apart:.4g} D_c apart, less than half of the diameter, {beta:.4g} D_c"
    return f"must be positions of centres, not distances: {near}" if apart < beta / 2 else ""


class StreamOptions(Keys):
    """The streams."""

    beads: values.Whole = Field(500, ge=LEAST_BEADS, le=20_000, description="number of beads of each stream")
    streams: values.Whole = Field(8, ge=2, le=1000, description="number of streams that are drawn")
    seed: values.Whole = Field(0, ge=0, description="seed of the random numbers")
    concentration: Annotated[Annotated[values.Number, Field(gt=0, le=0.3)] | None, Key(check=_check_concentration)] = (
        Field(None, description="volume fraction of the beads in the suspension, in place of d")
    )
    arrivals: Literal["random", "regular"] = Field(
        "random",
        description="how beads arrive: independently of each other, but without overlap, or equally spaced",
    )
    jitter: Annotated[values.Number, Field(ge=0, le=0.5)] = Field(
        0.1, description="for regular arrivals, standard deviation of the positions of beads, relative to their spacing"
    )
    positions: Annotated[tuple[values.Number, ...] | str | None, Key(check=_check_positions)] = Field(
        None,
        description="positions of the centres of beads along the tube, in place of d [D_c]; or a file of them, one a "
        "line, below a heading such as z [um] where they have a unit",
    )
    tube: values.Distance = Field(300.0, description="length of tube along which beads are followed [D_c]")
    drop: values.Distance | None = Field(
        None, description="volume of a drop, as the length of tube that holds it [D_c]; without it no drops are counted"
    )
    min_gap: values.Distance = Field(0.002, description="distance at which beads touch [D_c]")
    neighbours: values.Whole = Field(
        3,
        ge=2,
        le=5,
        description="beads in the longest short rows to which the model is fitted; 5 gives the model of pairsim train",
    )


class StreamCase(SpreadCase):
    """Streams of beads that may differ."""

    kind: ClassVar[str] = "stream"

    particles: values.Whole = Field(1, ge=1, le=1, description="1: beads differ by their spread alone")
    d: Annotated[values.Distance | None, Key(check=_check_d, first=True)] = Field(
        None, description="mean distance between the facing surfaces of neighbours [D_c]"
    )
    ends: Annotated[Ends, Key(check=lambda case: "" if case.ends == "periodic" else AS_LONG)] = Field(
        "periodic", description=ENDS
    )
    stream: StreamOptions = StreamOptions()

    @property
    def tube_length(self) -> float:
        """Length of the tube in which a single bead is solved [D_c]."""
        return LONG * max(self.betas, default=1.0)

    def _defaults(self) -> dict[str, Plain]:
        """The defaults; positions are also read from their file, so that the case no longer depends on it."""
        found = super()._defaults()
        if isinstance(file := self.stream.positions, str):
            try:
                positions = read_positions(Path(file), self.scales)
            except ValueError:
                return found  # `check` says why
            object.__setattr__(self.stream, "positions", positions)
        return found

    @property
    def beads(self) -> int:
        """Number of beads of each stream."""
        known = self.stream.positions
        return len(known) if isinstance(known, tuple) else self.stream.beads

    def resolved(self) -> dict[str, Plain]:
        return {key: value for key, value in super().resolved().items() if key != "length"}  # no case may give it

    def _slug_parts(self) -> list[str]:
        return [part for part in super()._slug_parts() if part != "n1"]


def check(case: StreamCase) -> Iterator[Mistake]:
    """Yield the mistake of a length that is given."""
    if case.length is not None:
        yield Mistake("length", case.length, AS_LONG)


def spacing_of(case: StreamCase, U: float) -> float:
    """Mean distance between the centres of beads that move at U [U_av], by their concentration [D_c].

    The concentration is that of the flowing suspension, as in the reservoir; as beads move faster than the liquid, they
    are farther apart in the tube.
    """
    assert case.stream.concentration is not None
    volume = max(case.betas) ** 3 * (1 + 3 * case.spread.diameter**2)
    return 2 / 3 * volume * U / case.stream.concentration


def estimate(case: StreamCase) -> Estimate:
    """Size and duration of the short rows; the motion of the streams is left out."""
    from pairsim.questions.stream.work import of_rows

    return steady_estimate(case, round(of_rows(case)))


def solve(case: StreamCase, *, monitor: Monitor, workers: Workers) -> Events:
    """Compute the short rows, and the motion of streams by the model that is fitted to them."""
    from pairsim.questions.stream.computation import computation

    return computation(case, monitor, workers)


class StreamResult(Result):
    """Streams. `table` is stream.csv, with a row for each length of tube."""

    def findings(self) -> list[str]:
        """How many beads drops get, how the distances spread, and what fraction of the beads touch."""
        said = "What was found is in stream.csv; the answer in words is written when all is done."
        return SENTENCES.of(self.record) or [said if self.columns.rows else "No stream was followed."]


def draw(folder: Path, out: Path, page: Page) -> list[Path]:
    """Draw the tables of a folder."""
    from pairsim.questions.stream.picture import draw_stream

    return draw_stream(folder, out, page)


def _in_sweeps(case: StreamCase) -> tuple[str, ...]:
    """The columns of results.csv, whose values are those in the last row of stream.csv."""
    names = [SPREAD, IN_CONTACT, *(OF_DROPS if case.stream.drop else ())]
    poisson = [POISSON[SINGLE].name] if case.stream.drop else []
    return (*(part.name for each in names for part in _with_errors(each)), *poisson)


QUESTION = Question(
    __name__,
    model=StreamCase,
    check=check,
    estimate=estimate,
    solve=solve,
    tables={"stream": STREAM, "distances": DISTANCES, "kymograph": KYMOGRAPH},
    shared=True,
    result=StreamResult,
    entries=(POINTS, SPREAD_OF_PARTICLES, SENTENCES),
    draw=draw,
    captions={
        "stream": "Drops by their number of beads, beads in contact and spread of the distances along the tube",
        "kymograph": "Positions of beads of a stream relative to their middle, on their way along the tube",
    },
    in_sweeps=InSweeps(_in_sweeps),
    examples="Examples: pairsim stream configs/stream.yaml | pairsim stream case.yaml -o out --set stream.seed=1",
)
