"""Compute whether an infinite train of equal beads orders or clusters.

The case file has d (between facing surfaces) or train: {spacing: ...} (from
centre to centre), in tube diameters D_c. Writes train.csv (velocity, whether
distances become equal, length of tube), spectrum.csv (growth rate of every
disturbance with its error), train.png, case.yaml and run.json; with row: {beads:
...} or a list of distances it follows a row of beads: row.csv, row.png.

Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
system at fault (pairsim doctor), 5 no steady state there, 130 interrupted.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from math import inf, isfinite, nan, pi
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from pairsim.api.compute import Computation
from pairsim.api.results import Result
from pairsim.cases import values
from pairsim.cases.case import Keys, SceneCase
from pairsim.cases.checks import check_scene
from pairsim.cases.estimate import Estimate, steady_estimate
from pairsim.cases.mistakes import Mistake, broken, missing
from pairsim.cli.compute import app_of
from pairsim.computing import events
from pairsim.computing.question import InSweeps, Question, rows_in
from pairsim.results.columns import Column, names_of
from pairsim.results.units import LENGTH, POSITION, RATE, VELOCITY
from pairsim.runtime.errors import BranchEnd

if TYPE_CHECKING:
    from pairsim.physics.scales import Scales
    from pairsim.plots.style import Page
    from pairsim.runtime.arrays import Array
    from pairsim.runtime.monitor import Monitor
    from pairsim.solvers.parameters import Parameters
    from pairsim.solvers.problems import SteadyProblem
    from pairsim.solvers.rows.motion import RowMotion
    from pairsim.solvers.trains.train import Train

FAST = 0.3  # rate times t_relax from which on an answer says that beads move while they remember; chosen
MOST_REFINED = 3  # meshes, each with smaller cells, until the errors are as small as wanted; chosen
MESHES = 2.5  # factor of the time for two meshes and the response of the cell; measured

WAVE = (
    Column("k", "k", "phase between neighbours in a wave of 2 pi/k beads"),
    Column("growth", r"\mathrm{Re}\,\lambda", "growth rate of the wave; negative: it decays", RATE),
    Column("growth_error", r"\epsilon_\mathrm{Re}", "half-width of its interval: mesh, and rest of the series", RATE),
)
SPECTRUM = (
    *WAVE,
    Column("frequency", r"\mathrm{Im}\,\lambda", "angular frequency; positive: upstream past the beads", RATE),
    Column("frequency_error", r"\epsilon_\mathrm{Im}", "half-width of its interval", RATE),
)
TRAIN = (
    Column("spacing", "s", "distance between the centres of neighbours", LENGTH),
    "d",
    "d_error",
    Column("velocity", "U", "velocity of the beads", VELOCITY),
    Column("velocity_error", r"\epsilon_U", "half-width of its interval", VELOCITY),
    Column(
        "verdict",
        "",
        "orders: all waves decay; clusters: some grow; neither: all keep their size; undecided: not certain",
    ),
    *WAVE,
    Column("diffusion", "C", "long waves grow at -C k^2", RATE),
    Column("diffusion_error", r"\epsilon_C", "half-width of the interval of C", RATE),
    Column("tube", "L", "length of tube for a tenfold smaller (clusters: larger) spread", LENGTH, unknown=True),
    Column("tube_least", r"L_\mathrm{min}", "the least by the intervals of the rates", LENGTH, unknown=True),
    Column("tube_most", r"L_\mathrm{max}", "the largest by them", LENGTH, unknown=True),
    "t_relax",
)
"""The columns of train.csv, which has one row."""


ROW = (Column("position", "z", "how far the row has moved along the tube on average", POSITION),)
"""The first column of row.csv, before time and distances."""
PROPAGATOR = (Column("by_d_1", "", "derivative of a distance at the outlet, one a row, by the first one at the inlet"),)
MOST_PROPAGATED = 50  # beads of a row whose changes are followed
PLACES = 101  # rows of row.csv
SHORT_ROWS = 1000  # beads of a cell whose response takes about as long as the short rows; from processor times
LONG = 50.0  # length of the tube of short rows over the diameter of a bead, as of other cases
LEAST = 0.04  # smallest distance at which short rows are solved [D_c]; chosen
VERDICTS = {
    "orders": "The train orders: every wave decays, {wave} fastest: at {rate}, by a factor e within {tube}.",
    "clusters": "The train clusters: {wave} grows fastest: at {rate}, by a factor e within {tube}.",
    "neither": "The train neither orders nor clusters: waves travel along it and keep their size.",
    "undecided": "Whether the train orders is not certain: {wave} has the largest growth rate, {rate}.",
}
CHANGES = {"orders": (1 / 10, "of 20 % becomes one of 2 %"), "clusters": (10.0, "of 2 % becomes one of 20 %")}
"""Of spreads of distances, by verdict."""


class RowOptions(Keys):
    """A row of beads that is followed along the tube, with distances at random of mean d, or those listed in d."""

    beads: values.Whole | None = Field(
        None, ge=2, le=1000, description="number of beads; without it a row is followed where d is a list"
    )
    spread: values.Positive = Field(
        0.2, le=1, description="standard deviation of the distances at the inlet, as a part of their mean"
    )
    seed: values.Whole = Field(0, ge=0, description="seed of the random numbers")
    tube: values.Distance = Field(300.0, description="length of tube along which the row is followed [D_c]")
    min_gap: values.Distance = Field(0.002, description="distance at which beads touch [D_c]")
    audited: values.Whole = Field(
        2, ge=0, le=100, description="number of rows of six neighbours on the way that are solved, to know the error"
    )


class TrainOptions(Keys):
    """The train."""

    spacing: values.Distance | None = Field(
        None, description="distance between the centres of neighbours, in place of d [D_c]"
    )
    cell: values.Whole = Field(
        8, ge=4, le=64, description="even number of beads in the periodic cell, whose waves are computed"
    )
    transition: tuple[values.Distance, values.Distance] | None = Field(
        None,
        description="two distances between which trains change from clustering to ordering; the train is that where "
        "they do, in place of d [D_c]",
    )


class TrainCase(SceneCase):
    """An infinite train of equal beads."""

    kind: ClassVar[str] = "train"
    closed: ClassVar[bool] = True
    usual_distances: ClassVar[dict[str, Any]] = {"d": 0.1}

    particles: values.Whole = Field(1, ge=1, le=1, description="1: all beads of the train are equal")
    d: values.Distance | tuple[values.Distance, ...] | None = Field(
        None,
        description="distance between the facing surfaces of neighbours [D_c]; a list: the first distances of a row "
        "from upstream, whose mean is that of the train",
    )
    train: TrainOptions = TrainOptions()
    row: RowOptions = RowOptions()

    @property
    def gaps(self) -> tuple[float, ...]:
        """None: there is one bead in a period."""
        return ()

    @property
    def mean_d(self) -> float | None:
        """Distance of the train [D_c]; None if its spacing is given."""
        return sum(self.d) / len(self.d) if isinstance(self.d, tuple) else self.d

    @property
    def found(self) -> tuple[str, ...]:
        """What is not given, but found: the distance of a transition."""
        return () if self.train.transition is None else ("d", "d_error")

    def first_gaps(self, d: float) -> Array | None:
        """The first distances of the row in a train with distance d [D_c], shape (N-1,); None if none is followed.

        Those at random have a gamma distribution beyond `min_gap`.
        """
        import numpy as np

        row = self.row
        if row.beads is None:
            return np.array(self.d) if isinstance(self.d, tuple) else None
        scale = (row.spread * d) ** 2 / (d - row.min_gap)
        random = np.random.default_rng(row.seed).gamma((d - row.min_gap) / scale, scale, row.beads - 1)
        return np.asarray(row.min_gap + random)

    @property
    def range_of_d(self) -> tuple[float, float]:
        d = self.tube_length - max(self.betas)
        return d, d

    @property
    def tube_length(self) -> float:
        """Length of a period with undeformed beads [D_c]."""
        beta = max(self.betas, default=0.0)
        d = self.mean_d or max(self.train.transition or (0.0,))
        return beta + d if self.train.spacing is None else self.train.spacing

    def resolved(self) -> dict[str, Any]:
        """The case with every default filled in, without a length: it follows from the spacing."""
        return {key: value for key, value in super().resolved().items() if key != "length"}

    def _slug_parts(self) -> list[str]:
        distance = f"d{self.mean_d:g}" if self.mean_d is not None else f"spacing{self.tube_length:g}"
        return ["train", *(part for part in super()._slug_parts() if part != "n1"), distance]


def check(case: TrainCase) -> Iterator[Mistake]:
    """Check the keys against each other; yields mistakes."""
    spacing, transition = case.train.spacing, case.train.transition
    if case.d is None and spacing is None and transition is None:
        yield missing("d", "must be a number, the distance between facing surfaces, or train.spacing be given")
        return
    if transition is not None and (case.d is not None or spacing is not None or transition[0] >= transition[1]):
        allowed = "must be two distances in ascending order, in place of d and train.spacing"
        yield Mistake("train.transition", list(transition), allowed)
    if case.d is not None and spacing is not None:
        yield Mistake("train.spacing", spacing, "must be left out if d is given: beads deform, and one follows")
    elif spacing is not None and case.betas and spacing <= max(case.betas):
        yield Mistake("train.spacing", spacing, f"must be above beta = {max(case.betas):g}: it is that of the centres")
    why = "must be left out: a period of the train is as long as its spacing"
    listed = case.d if isinstance(case.d, tuple) else ()
    yield from broken(
        case,
        ("length", case.length is not None, why),
        ("ends", case.ends != "periodic", why),
        ("train.cell", case.train.cell % 2 == 1, "must be even"),
        ("row.min_gap", case.row.min_gap >= min(listed or (case.mean_d or inf,)), "must be below d"),
        ("row.beads", bool(listed) and case.row.beads is not None, "must be left out: d has the distances of the row"),
    )
    yield from check_scene(case)


def estimate(case: TrainCase) -> Estimate:
    """Size and duration: that of one bead on two meshes, and of the cell; and of the short rows for a long one."""
    follows = case.row.beads is not None or isinstance(case.d, tuple)
    return steady_estimate(case, case.train.cell + SHORT_ROWS * follows, MESHES)


def solve(case: TrainCase, *, monitor: Monitor) -> events.Events:
    """Compute the train and its growth rates on two meshes, and on finer ones while errors are larger than wanted."""
    from pairsim.computing.problems import steady_problem
    from pairsim.results.units import in_unit
    from pairsim.solvers.parameters import Parameters
    from pairsim.solvers.trains.train import on_meshes, transition

    yield events.Begin(f"the growth rates of {case.train.cell} beads", 1)
    problem, start = steady_problem(case, inf, monitor), Parameters((), case.solid_models, case.liquid_model)
    place, d, slope = case.train.transition, case.mean_d, nan
    try:
        if place is not None:
            d, slope = transition(problem, start, case.train.cell, place)
        meshes = islice(on_meshes(problem, start, case.train.cell, d), MOST_REFINED)
        for refined, found in enumerate(meshes, 1):
            errors = f"errors {100 * found.error:.2g} % of the largest rate"
            yield events.Progress(refined / MOST_REFINED, errors, refined)
            verdict = found.spectrum.verdict
            certain = verdict != "undecided" or place is not None
            if verdict == "neither" or case.held or (found.error <= case.error_wanted and certain):
                break
    except BranchEnd as end:
        yield events.Summary({})
        return events.Outcome("finished", end.reason, end.message)
    spectrum, waves, d_error = found.spectrum, found.spectrum.waves, None
    sentences = list[str]()
    if place is not None:
        d_error = sum(map(abs, spectrum.least_stable)) / abs(slope)
        nearer, farther = ("cluster", "order") if slope < 0 else ("order", "cluster")
        at = in_unit(case.scales, LENGTH, found.d, d_error)
        sentences.append(f"Trains with distances of less than {at} {nearer}, and those with more {farther}.")
    tubes = [found.U * time for time in spectrum.time_to(CHANGES[verdict][0])] if verdict in CHANGES else [inf] * 3
    values = [found.spacing, found.d, d_error, found.U, found.U_error, verdict, *spectrum.fastest, *spectrum.diffusion]
    values += [each if isfinite(each) else nan for each in (*tubes, found.t_relax)]
    train = _table("train", TRAIN, [values])
    yield replace(train, rows=())
    yield events.Row("train", train.rows[0])  # the result that is waited for
    rates = (*spectrum.growth(waves), *spectrum.frequency(waves))
    yield _table("spectrum", SPECTRUM, list(zip(waves, *rates, strict=True)))
    if (gaps := case.first_gaps(found.d)) is not None:
        sentences += yield from _follow(case, problem, start, gaps)
    yield events.Summary({"unknowns": found.unknowns, "sentences": sentences}, _warnings(case, found))
    return events.Outcome("finished", "end", f"verdict: {verdict}")


def _table(name: str, columns: Sequence[str | Column], rows: Sequence[Sequence[Any]]) -> events.Table:
    """A table with its rows, in the order of its columns."""
    names = [each if isinstance(each, str) else each.name for each in columns]
    return events.Table(name, names, [dict(zip(names, row, strict=True)) for row in rows])


def _follow(
    case: TrainCase, problem: SteadyProblem, start: Parameters, gaps: Array
) -> Generator[events.Event, None, list[str]]:
    """Follow a row from its first distances along the tube; returns what it says."""
    import numpy as np

    from pairsim.solvers.rows.motion import move
    from pairsim.solvers.rows.short_rows import EqualRow, audit, cut_rows, models

    options, n = case.row, len(gaps) + 1
    problem = replace(problem, length=LONG * problem.betas[0], closed=False, volume_modulus=False)
    equal, least = EqualRow(problem, start), min(LEAST, gaps.mean() / 2, *(case.d if isinstance(case.d, tuple) else ()))
    for done, total, model in models(equal, least):  # noqa: B007
        yield events.Progress(1.0, f"{done} of {total} short rows", done)
    motion = move(model, gaps, options.min_gap, options.tube, problem.monitor)
    times = np.linspace(0.0, motion.t[-1], PLACES)
    states = [motion.gaps(t) for t in times]
    ways = [motion.positions(t) - motion.positions(0.0) for t in times]
    rows = [(way.mean(), t, *d) for way, t, d in zip(ways, times, states, strict=True)]
    yield _table("row", [*ROW, *names_of(n, "t", "d")], rows)
    sentences = list(_of_motion(motion, case.scales))
    if places := cut_rows(states, 6, options.audited, least):
        off = 100 * audit(equal, model, places).max(axis=0)
        sentences.append(
            f"Model against {len(places)} solved rows of {len(places[0]) + 1}: dU within {off[0]:.2g} % of the largest "
            f"|dU| of each, slopes within {off[1]:.2g} %."
        )
    if n <= MOST_PROPAGATED and not motion.touching.any():
        propagator = motion.propagator()
        yield _table("propagator", [f"by_d_{i}" for i in range(1, n)], propagator.tolist())
        singular = np.linalg.svd(propagator, compute_uv=False)
        sentences.append(
            f"Small changes of the first distances become {singular[-1]:.3g} to {singular[0]:.3g} times as large, by "
            "which of them change."
        )
    return sentences


def _of_motion(motion: RowMotion, scales: Scales | None) -> Iterator[str]:
    """What has become of the distances of a row."""
    import numpy as np

    from pairsim.results.units import in_unit

    ends = motion.gaps(0.0), motion.gaps(motion.t[-1])
    spreads = " to ".join(f"{100 * np.std(d) / np.mean(d):.3g} %" for d in ends)
    means = " to ".join(in_unit(scales, LENGTH, float(np.mean(d))) for d in ends)
    way = motion.positions(motion.t[-1]) - motion.positions(0.0)
    yield (
        f"Spread of {len(way) - 1} distances within {_of_tube(scales, way.min())} of tube: from {spreads} of their "
        f"mean, which goes from {means}."
    )
    if (touching := motion.touching).any():
        step, gap = (int(each) for each in np.argwhere(touching.T)[0])
        place = (motion.positions(motion.t[step]) - motion.positions(0.0))[gap : gap + 2].mean()
        yield (
            f"Gap {gap + 1} closes first, after {_of_tube(scales, place)}. In all {touching.any(axis=1).sum()} close, "
            f"and {touching[:, -1].sum()} stay closed; beads that touch are assumed to travel on as doublets, held by "
            "equal and opposite forces until these would have to pull."
        )


def _warnings(case: TrainCase, found: Train) -> list[str]:
    """Warnings of errors larger than wanted, and of beads that move while they remember."""
    from pairsim.computing.warnings import beyond_checked, coarse_mesh

    warnings = [*beyond_checked(case), *coarse_mesh(case)]
    if found.error > case.error_wanted and found.spectrum.verdict != "neither":
        warnings.append(
            f"accuracy: {case.accuracy} was not kept: growth rates are within {100 * found.error:.2g} % of the largest"
        )
    covered = abs(found.spectrum.rates).max() * found.t_relax
    if covered > FAST:
        warnings.append(
            f"disturbances change by a part of {covered:.2g} while shapes and stresses relax: the last term of the "
            f"series for that changes the rates by {100 * found.series_error:.2g} %, which is in their errors; modes "
            "that do not follow the distances are not looked for"
        )
    return warnings


def draw(directory: Path, out: Path, page: Page) -> list[Path]:
    """Growth rates and frequencies over the wave number, and the distances of a row that is followed."""
    from pairsim.plots.chart import POINT, Panel, Series, draw_chart
    from pairsim.plots.labels import case_parts, read_case
    from pairsim.plots.long_rows import draw_long_row
    from pairsim.plots.style import printing
    from pairsim.plots.units import Units
    from pairsim.results.table_files import read_table

    units = Units.of(directory, page.physical)
    table = units.table(read_table(directory / "spectrum.csv"))
    panels = {n: Panel(units.axis_label(["k"]), units.axis_label([n])) for n in ("growth", "frequency")}
    series = [Series(n, table["k"], table[n], table[f"{n}_error"], mark=POINT) for n in panels]
    small_print = case_parts(read_case(directory / "case.yaml"), {"particles"}, units.scales is not None)
    with printing():
        figure, _ = draw_chart(page, panels, series, small_print)
        drawn = page.save(figure, out, "train")
    if row := units.table(read_table(directory / "row.csv", missing_ok=True)):
        drawn += draw_long_row(row, units, out, page)
    return drawn


def _of_tube(scales: Scales | None, length: float) -> str:
    """A length of tube in words."""
    from pairsim.results.units import in_unit

    return in_unit(scales, POSITION, length) + ("" if scales else " D_c")


class TrainResult(Result):
    """An infinite train. `table` is train.csv, with one row; `frame("spectrum")` has a row for each wave."""

    def findings(self) -> list[str]:
        """Whether the train orders or clusters, and within which length of tube."""
        from pairsim.results.units import in_unit, scales_in

        if not rows_in(self.columns):
            return ["No train was found."]
        scales, row = scales_in(self.record), {name: column[0].item() for name, column in self.columns.items()}
        spacing, d = (in_unit(scales, LENGTH, row[name]) for name in ("spacing", "d"))
        U = in_unit(scales, VELOCITY, row["velocity"], row["velocity_error"])
        unit, verdict = "" if scales else " D_c", row["verdict"]
        lines = [
            f"Beads {spacing}{unit} apart from centre to centre, {d}{unit} from surface to surface, move at U = {U}."
        ]
        within = _of_tube(scales, row["velocity"] / abs(row["growth"])) if row["growth"] else ""
        rate = in_unit(scales, RATE, row["growth"], row["growth_error"])
        lines.append(VERDICTS[verdict].format(wave=f"a wave of {2 * pi / row['k']:.3g} beads", rate=rate, tube=within))
        C, off = row["diffusion"], row["diffusion_error"]
        certain = "decay" if off < C else "grow" if -off > C else "may decay or grow"
        value = in_unit(scales, RATE, C, off)
        lines.append(f"Long waves {certain}: at -C k^2 with C = {value}, k the phase between beads.")
        tube, least, most = (_of_tube(scales, row[name]) for name in ("tube", "tube_least", "tube_most"))
        if isfinite(row["tube"]):
            lines.append(
                f"A spread {CHANGES[verdict][1]} within {tube} of tube ({least} to "
                f"{most if isfinite(row['tube_most']) else 'never'}), where distances are independent at first and "
                "disturbances small."
            )
        return [*lines, *self.record.get("sentences", [])]


QUESTION = Question(
    model=TrainCase,
    check=check,
    estimate=estimate,
    solve=solve,
    tables={"train": TRAIN, "spectrum": SPECTRUM, "row": (*ROW, "t", "d_1"), "propagator": PROPAGATOR},
    result=TrainResult,
    draw=draw,
    captions={
        "train": "Growth rates and frequencies of disturbances over their wave number",
        "row": "Distances of a row of beads along the tube, and those at the inlet and at the outlet",
    },
    in_sweeps=InSweeps(
        lambda case: (*case.found, "verdict", "growth", "growth_error", "diffusion", "diffusion_error", "tube")
    ),
)

train: Computation[TrainResult] = Computation(QUESTION, __doc__)
"""Compute whether an infinite train of equal beads orders or clusters, and within which length of tube."""
app = app_of(train, __doc__, "Examples: pairsim train configs/train.yaml | pairsim train case.yaml -o out --set d=0.2")
