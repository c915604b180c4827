"""Compute whether an infinite train of equal beads orders or clusters.

The case file has d (between facing surfaces) or train: {spacing: ...} (from
centre to centre), in tube diameters D_c. Writes train.csv (velocity, whether
distances become equal, length of tube), spectrum.csv (growth rate of every
disturbance with its error), train.png, case.yaml and run.json; with row:
{beads: ...} or a list of distances it follows a row of beads: row.csv,
row.png, kymograph.png.

Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
system at fault (pairsim doctor), 5 no steady state there, 130 interrupted.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import Field

from pairsim.cases import values
from pairsim.cases.case import ENDS, Ends
from pairsim.cases.estimate import Estimate, steady_estimate
from pairsim.cases.keys import Key, Keys
from pairsim.cases.mistakes import Mistake, missing
from pairsim.cases.off_axis import OffAxisCase, points_off_axis
from pairsim.computing.off_axis.columns import NAME, TABLE
from pairsim.computing.off_axis.lines import lines_beside
from pairsim.computing.question import InSweeps, Question
from pairsim.computing.result import Result
from pairsim.quantities.kinds import LENGTH, POSITION, RATE
from pairsim.record.column import GAP, Column, Columns, Shown
from pairsim.record.columns import D_ERROR, DISTANCE, DU, DU_ERROR, T_RELAX, U_ERROR, T, U, Z
from pairsim.record.run_entries import SIZE, Entry
from pairsim.runtime.plain import Plain

if TYPE_CHECKING:
    from pairsim.computing.events import Events
    from pairsim.computing.workers import Workers
    from pairsim.plots.style import Page
    from pairsim.runtime.monitor import Monitor

# Factor of the time for several meshes and the response of the cell, and the factor within which the estimate holds, as
# one to three meshes are needed; factor for the search for a transition; number of beads in a cell whose response takes
# as long as the short rows. From the processor times in tests/questions/test_train.py.
MESHES, BY_MESHES = 2.2, 4.0
SEARCH = 2.0
SHORT_ROWS = 150
OF_A_ROW = 3  # beads of the row, at the distance of the train, that are displaced from the axis; chosen

K = Column("k", "k", "phase difference between neighbours, in a wave of 2 pi/k beads")
GROWTH = Column(
    "growth",
    r"\mathrm{Re}\,\lambda",
    "growth rate of the wave; negative: it decays",
    RATE,
    half_width="growth_error",
)
FREQUENCY = Column(
    "frequency",
    r"\mathrm{Im}\,\lambda",
    "angular frequency of the wave; positive: it travels upstream past the beads",
    RATE,
    half_width="frequency_error",
)
GROWTH_ERROR = Column(
    "growth_error",
    r"\epsilon_\mathrm{Re}",
    "half-width of the interval of growth: error due to the mesh and the last term of the series in the rate of "
    "change; in train.csv, also due to beads beyond the cell",
    RATE,
)
SPECTRUM = Columns(
    *(K, GROWTH, GROWTH_ERROR, FREQUENCY),
    Column("frequency_error", r"\epsilon_\mathrm{Im}", "half-width of the interval of frequency", RATE),
)
VERDICT = Column(
    "verdict", "", "orders: all waves decay; clusters: some grow; neither: all keep their size; undecided: not certain"
)
SPACING = Column("spacing", "s", "distance between the centres of neighbours", LENGTH)
D = Column("d", "d", "distance between the facing surfaces of neighbours", LENGTH, half_width="d_error")
DIFFUSION = Column("diffusion", "C", "C in the growth rate -C k^2 of long waves", RATE, half_width="diffusion_error")
DIFFUSION_ERROR = Column("diffusion_error", r"\epsilon_C", "half-width of the interval of C", RATE)
TUBE = Column(
    "tube",
    "L",
    "length of tube within which the spread of the distances falls to a tenth (clusters: grows tenfold); empty unless "
    "the train certainly orders or certainly clusters",
    LENGTH,
    unknown=True,
)
TUBE_LEAST = Column(
    "tube_least",
    r"L_\mathrm{min}",
    "smallest such length within the intervals of the growth rates of all waves",
    LENGTH,
    unknown=True,
)
TUBE_MOST = Column(
    "tube_most",
    r"L_\mathrm{max}",
    "largest such length within the intervals of the growth rates of all waves",
    LENGTH,
    unknown=True,
)
TRAIN = Columns(
    *(SPACING, D, D_ERROR, U, U_ERROR, VERDICT, K, GROWTH, GROWTH_ERROR),
    *(DIFFUSION, DIFFUSION_ERROR, TUBE, TUBE_LEAST, TUBE_MOST, T_RELAX),
)
"""The columns of train.csv, which has one row."""
POSITION_OF_ROW = Column(
    "position", "z", "mean distance that the row has moved along the tube", POSITION, shown=Shown.ALWAYS
)
ROW = Columns(POSITION_OF_ROW, T, Z, DISTANCE, DU, DU_ERROR)
"""The columns of row.csv."""
BY_DISTANCE = Column(
    "by_d", "", "derivative of a distance at the outlet, one in each row, with respect to d{_} at the inlet", of=GAP
)
SENTENCES = Entry[list[str]]("sentences", "the answer in words")


def _places(case: TrainCase) -> list[str]:
    """Which of the keys that determine the distance between beads are given; there must be one."""
    places = {"d": case.d, "train.spacing": case.train.spacing, "train.transition": case.train.transition}
    return [key for key, value in places.items() if value is not None]


def _too_many(case: TrainCase, key: str) -> str:
    """That one of these keys must be left out, if another one before it is given, too; else ""."""
    first, *others = _places(case) or [key]
    return f"must be left out if {first} is given: one follows from the other, as beads deform" if key in others else ""


def _check_spacing(case: TrainCase) -> str:
    spacing, beta = case.train.spacing, max(case.betas, default=0.0)
    inside = spacing is not None and spacing <= beta
    return _too_many(case, "train.spacing") or (
        f"must be above beta = {beta:g}: it is the distance between centres" if inside else ""
    )


def _check_transition(case: TrainCase) -> str:
    given = case.train.transition
    descends = given is not None and given[0] >= given[1]
    return _too_many(case, "train.transition") or ("must be two distances in ascending order" if descends else "")


def _check_d(case: TrainCase) -> Iterator[Mistake]:
    """Yield the mistake of a train whose distance is not given."""
    if not _places(case):
        yield missing("d", "must be a number, the distance between facing surfaces, or train.spacing must be given")


def _check_beads(case: TrainCase) -> Iterator[Mistake]:
    """Yield the mistake of a row whose number of beads is not given, or given twice."""
    if case.listed and case.row.beads:
        yield Mistake("row.beads", case.row.beads, "must be left out: d lists the distances of the row")
    elif case.row != RowOptions() and not (case.listed or case.row.beads):
        yield missing("row.beads", "must be given to follow a row, or row must be left out")


def _check_min_gap(case: TrainCase) -> str:
    return "must be below d" if case.row.min_gap >= min(case.listed or (case.mean_d or inf,)) else ""


AS_LONG = "must be left out: a period of the train is as long as its spacing"


class RowOptions(Keys):
    """A row of beads that is followed along the tube, with distances at random of mean d, or those listed in d."""

    beads: Annotated[values.Whole | None, Key(check=_check_beads)] = Field(
        None, ge=2, le=1000, description="number of beads in the row; without it, a row is followed only if d is a list"
    )
    spread: values.Positive = Field(
        0.2, le=1, description="standard deviation of the distances at the inlet, relative to their mean"
    )
    seed: values.Whole = Field(0, ge=0, description="seed of the random numbers")
    tube: values.Distance = Field(300.0, description="length of tube along which the row is followed [D_c]")
    min_gap: Annotated[values.Distance, Key(check=_check_min_gap)] = Field(
        0.002, description="distance at which beads touch [D_c]"
    )


class TrainOptions(Keys):
    """The train."""

    spacing: Annotated[values.Distance | None, Key(check=_check_spacing)] = Field(
        None, description="distance between the centres of neighbours, in place of d [D_c]"
    )
    cell: Annotated[values.Whole, Key(check=lambda case: "must be even" if case.train.cell % 2 else "")] = Field(
        8, ge=4, le=64, description="number of beads in the periodic cell whose waves are computed; even"
    )
    transition: Annotated[tuple[values.Distance, values.Distance] | None, Key(check=_check_transition)] = Field(
        None,
        description="in place of d, two distances between which trains change from clustering to ordering, or back "
        "[D_c]; the train is the one at the transition",
    )


class TrainCase(OffAxisCase):
    """An infinite train of equal beads."""

    kind: ClassVar[str] = "train"

    particles: values.Whole = Field(1, ge=1, le=1, description="1: all beads of the train are equal")
    d: Annotated[values.OneOrMany[values.Distance] | None, Key(usual=0.1, check=_check_d, first=True)] = Field(
        None,
        description="distance between the facing surfaces of neighbours [D_c]; a list: the initial distances of a "
        "row, from upstream, whose mean is the distance of the train",
    )
    ends: Annotated[Ends, Key(check=lambda case: "" if case.ends == "periodic" else AS_LONG)] = Field(
        "periodic", description=ENDS
    )
    train: TrainOptions = TrainOptions()
    row: RowOptions = RowOptions()

    @property
    def closed(self) -> bool:
        return True

    @property
    def of_train(self) -> bool:
        return True

    @property
    def gaps(self) -> tuple[float, ...]:
        """The single distance in a period, between undeformed beads [D_c]."""
        return (self.tube_length - max(self.betas, default=0.0),)

    @property
    def listed(self) -> tuple[float, ...]:
        """The first distances of a row from upstream [D_c]; empty if they are not given."""
        return self.d if isinstance(self.d, tuple) else ()

    @property
    def beads(self) -> int:
        """Number of beads of the row that is followed; 0 without one."""
        return self.row.beads or (len(self.listed) + 1 if self.listed else 0)

    @property
    def mean_d(self) -> float | None:
        """Distance of the train [D_c]; None if its spacing is given."""
        return sum(self.d) / len(self.d) if isinstance(self.d, tuple) else self.d

    @property
    def tube_length(self) -> float:
        """Length of a period with undeformed beads [D_c]."""
        d = self.mean_d or max(self.train.transition or (0.0,))
        return self.train.spacing or max(self.betas, default=0.0) + d

    def resolved(self) -> dict[str, Plain]:
        return {key: value for key, value in super().resolved().items() if key != "length"}  # no case may give it

    def _slug_parts(self) -> list[str]:
        distance = f"d{self.mean_d:g}" if self.mean_d is not None else f"spacing{self.tube_length:g}"
        return [*(part for part in super()._slug_parts() if part != "n1"), distance]


def check(case: TrainCase) -> Iterator[Mistake]:
    """Yield the mistake of a length that is given."""
    if case.length is not None:
        yield Mistake("length", case.length, AS_LONG)


def estimate(case: TrainCase) -> Estimate:
    """Size and duration of a bead on several meshes and of the cell, and of the short rows if a row is followed."""
    rates = OF_A_ROW * points_off_axis(case)
    if case.beads:
        return steady_estimate(case, case.train.cell + SHORT_ROWS + rates, MESHES)
    factor = MESHES * (SEARCH if case.train.transition is not None else 1.0)
    return replace(steady_estimate(case, case.train.cell + rates, factor), within=BY_MESHES)


def solve(case: TrainCase, *, monitor: Monitor, workers: Workers) -> Events:
    """Compute the train and its growth rates, and follow a row of beads."""
    from pairsim.questions.train.computation import computation

    return computation(case, monitor, workers)


class TrainResult(Result):
    """An infinite train. `table` is train.csv, with one row; `frame("spectrum")` has a row for each wave."""

    def findings(self) -> list[str]:
        """Whether the train orders or clusters, within what length of tube, and what becomes of a row."""
        said = "What was found is in train.csv; the answer in words is written when all is done."
        found = SENTENCES.of(self.record) or [said if self.columns.rows else "No train was found."]
        return [*found, *lines_beside(self.tables, self.record)]


def draw(folder: Path, out: Path, page: Page) -> list[Path]:
    """Draw the tables of a folder."""
    from pairsim.questions.train.picture import draw_train

    return draw_train(folder, out, page)


def _in_sweeps(case: TrainCase) -> tuple[str, ...]:
    """The columns of results.csv, whose values are those of train.csv."""
    place = (D, D_ERROR) if case.train.transition else ()
    found = (VERDICT, GROWTH, GROWTH_ERROR, DIFFUSION, DIFFUSION_ERROR, TUBE, TUBE_LEAST, TUBE_MOST)
    return tuple(column.name for column in (*place, *found))


QUESTION = Question(
    __name__,
    model=TrainCase,
    check=check,
    estimate=estimate,
    solve=solve,
    tables={
        "train": TRAIN,
        "spectrum": SPECTRUM,
        "row": ROW,
        "propagator": Columns(BY_DISTANCE),
        NAME: TABLE,
    },
    shared=True,
    result=TrainResult,
    entries=(SIZE, SENTENCES),
    draw=draw,
    captions={
        "train": "Growth rates and frequencies of disturbances over their wavenumber",
        "row": "Distances of a row of beads along the tube, and those at the inlet and at the outlet",
        "kymograph": "Positions of the beads of a row relative to its middle, on their way along the tube",
    },
    in_sweeps=InSweeps(_in_sweeps),
    examples="Examples: pairsim train configs/train.yaml | pairsim train case.yaml -o out --set d=0.2",
)
