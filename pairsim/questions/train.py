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
from pairsim.results.units import LENGTH, POSITION, RATE, VELOCITY, Unit
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
SHORT_ROWS = 1000  # beads of a cell whose response takes about as long as the short rows; from processor times
LONG = 50.0  # length of the tube of short rows over the diameter of a bead, as of other cases
LEAST = 0.04  # smallest distance at which short rows are solved [D_c]; chosen
MOST_PROPAGATED = 50  # beads of a row whose changes are followed
PLACES = 101  # rows of row.csv

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
VERDICT = "orders: all waves decay; clusters: some grow; neither: all keep their size; undecided: not certain"
TRAIN = (
    Column("spacing", "s", "distance between the centres of neighbours", LENGTH),
    "d",
    "d_error",
    Column("velocity", "U", "velocity of the beads", VELOCITY),
    Column("velocity_error", r"\epsilon_U", "half-width of its interval", VELOCITY),
    Column("verdict", "", VERDICT),
    *WAVE,
    Column("diffusion", "C", "long waves grow at -C k^2", RATE),
    Column("diffusion_error", r"\epsilon_C", "half-width of the interval of C", RATE),
    Column("tube", "L", "length of tube for a tenfold smaller (clusters: larger) spread", LENGTH, unknown=True),
    Column("tube_least", r"L_\mathrm{min}", "the least by the intervals of the rates", LENGTH, unknown=True),
    Column("tube_most", r"L_\mathrm{max}", "the largest by them", LENGTH, unknown=True),
    "t_relax",
)
"""The columns of train.csv, which has one row."""
POSITION_OF_ROW = Column("position", "z", "how far the row has moved along the tube on average", POSITION)
BY_FIRST = Column("by_d_1", "", "derivative of a distance at the outlet, one a row, by the first one at the inlet")

BEADS = "Beads {spacing} apart from centre to centre, {d} from surface to surface, move at U = {velocity}."
VERDICTS = {
    "orders": "The train orders: every wave decays, {wave} fastest: at {growth}, by a factor e within {within}.",
    "clusters": "The train clusters: {wave} grows fastest: at {growth}, by a factor e within {within}.",
    "neither": "The train neither orders nor clusters: waves travel along it and keep their size.",
    "undecided": "Whether the train orders is not certain: {wave} has the largest growth rate, {growth}.",
}
LONG_WAVES = "Long waves {long}: at -C k^2 with C = {diffusion}, k the phase between beads."
CHANGES = {"orders": (1 / 10, "of 20 % becomes one of 2 %"), "clusters": (10.0, "of 2 % becomes one of 20 %")}
SPREAD = (
    "A spread {change} within {tube} of tube ({tube_least} to {tube_most}), where distances are independent at first "
    "and disturbances small."
)
TRANSITION = "Trains with distances of less than {at} {nearer}, and those with more {farther}."
MOTION = (
    "Spread of {count} distances within {way} of tube: from {spreads[0]:.3g} % to {spreads[1]:.3g} % of their mean, "
    "which goes from {means[0]} to {means[1]}."
)
CONTACT = (
    "Gap {gap} closes first, after {place}. In all {closed} close, and {last} stay closed; beads that touch are "
    "assumed to travel on as doublets, held by equal and opposite forces until these would have to pull."
)
AUDIT = (
    "Model against {rows} solved rows of {beads}: dU within {dU:.2g} % of the largest |dU| of each, slopes within "
    "{slopes:.2g} %; against the train: growth rates within {growth:.2g} % of the largest."
)
PROPAGATED = (
    "Small changes of the first distances become {least:.3g} to {most:.3g} times as large, by which of them change."
)
REMEMBERS = (
    "disturbances change by a part of {part:.2g} while shapes and stresses relax: the last term of the series for that "
    "changes the rates by {change:.2g} %, which is in their errors; modes that do not follow the distances are not "
    "looked for"
)


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
    spectrum, sentences = found.spectrum, list[str]()
    row = (
        vars(found)
        | dict(spectrum.fastest)
        | {"verdict": verdict, "velocity": found.U, "velocity_error": found.U_error}
    )
    row["diffusion"], row["diffusion_error"] = spectrum.everywhere.loc[0, ["scaled", "scaled_error"]] * [-1, 1]
    if verdict in CHANGES:
        times = zip(("tube", "tube_least", "tube_most"), spectrum.time_to(CHANGES[verdict][0]), strict=True)
        row |= {name: found.U * time for name, time in times if isfinite(time)}
    if place is not None:
        row["d_error"] = spectrum.least_stable[["scaled", "scaled_error"]].abs().sum() / abs(slope)
        nearer, farther = ("cluster", "order") if slope < 0 else ("order", "cluster")
        at = in_unit(case.scales, LENGTH, found.d, row["d_error"])
        sentences.append(TRANSITION.format(at=at, nearer=nearer, farther=farther))
    yield events.Table("train", _names(TRAIN))
    yield events.Row("train", dict.fromkeys(_names(TRAIN)) | row)  # the result that is waited for
    yield _table("spectrum", _names(SPECTRUM), spectrum.of_cell[_names(SPECTRUM)].to_numpy())
    if (gaps := case.first_gaps(found.d)) is not None:
        sentences += yield from _follow(case, problem, start, gaps, found)
    yield events.Summary({"unknowns": found.unknowns, "sentences": sentences}, _warnings(case, found))
    return events.Outcome("finished", "end", f"verdict: {verdict}")


def _names(columns: Sequence[str | Column]) -> list[str]:
    return [each if isinstance(each, str) else each.name for each in columns]


def _table(name: str, columns: Sequence[str], rows: Array) -> events.Table:
    return events.Table(name, columns, [dict(zip(columns, row, strict=True)) for row in rows.tolist()])


def _follow(
    case: TrainCase, problem: SteadyProblem, start: Parameters, gaps: Array, train: Train
) -> Generator[events.Event, None, list[str]]:
    """Follow a row from its first distances along the tube; returns what it says."""
    import numpy as np

    from pairsim.solvers.rows.motion import move
    from pairsim.solvers.rows.short_rows import EqualRow, cut_rows, models

    options, n = case.row, len(gaps) + 1
    problem = replace(problem, length=LONG * problem.betas[0], closed=False, volume_modulus=False)
    equal, least = EqualRow(problem, start), min(LEAST, gaps.mean() / 2, *(case.d if isinstance(case.d, tuple) else ()))
    for done, total, model in models(equal, least):  # noqa: B007
        yield events.Progress(1.0, f"{done} of {total} short rows", done)
    assert model is not None
    motion = move(model, gaps, options.min_gap, options.tube, problem.monitor)
    times = np.linspace(0.0, motion.t[-1], PLACES)
    states = np.array([motion.gaps(t) for t in times])
    names = [POSITION_OF_ROW.name, *names_of(n, "t", "d")]
    rows = np.column_stack([[motion.way(t).mean() for t in times], times, states])
    yield _table("row", names, rows)
    sentences = list(_of_motion(motion, case.scales))
    if places := cut_rows(states, 6, options.audited, least):
        dU, slopes = 100 * np.max([model.misses(solved) for solved in equal.solved(places)], axis=0)
        k, rates = train.spectrum.waves
        growth = 100 * abs(model.growth(train.d, k) - rates).max() / abs(rates).max()
        beads = len(places[0]) + 1
        sentences.append(AUDIT.format(rows=len(places), beads=beads, dU=dU, slopes=slopes, growth=growth))
    if n <= MOST_PROPAGATED and not motion.touching.any():
        propagator = motion.propagator()
        yield _table("propagator", [f"by_d_{i}" for i in range(1, n)], propagator)
        singular = np.linalg.svd(propagator, compute_uv=False)
        sentences.append(PROPAGATED.format(least=singular[-1], most=singular[0]))
    return sentences


def _of_motion(motion: RowMotion, scales: Scales | None) -> Iterator[str]:
    """What has become of the distances of a row."""
    import numpy as np

    ends, way, touching = [motion.gaps(t) for t in motion.t[[0, -1]]], motion.way(motion.t[-1]), motion.touching
    spreads, means = [100 * d.std() / d.mean() for d in ends], [_length(scales, d.mean(), LENGTH, "") for d in ends]
    yield MOTION.format(count=len(ends[0]), way=_length(scales, way.min()), spreads=spreads, means=means)
    if touching.any():
        step, gap = np.argwhere(touching.T)[0]
        place = _length(scales, motion.way(motion.t[step])[gap : gap + 2].mean())
        closed, last = touching.any(axis=1).sum(), touching[:, -1].sum()
        yield CONTACT.format(gap=gap + 1, place=place, closed=closed, last=last)


def _warnings(case: TrainCase, found: Train) -> list[str]:
    """Warnings of errors larger than wanted, and of beads that move while they remember."""
    from pairsim.computing.warnings import beyond_checked, coarse_mesh

    warnings, part = [*beyond_checked(case), *coarse_mesh(case)], abs(found.spectrum.rates).max() * found.t_relax
    if found.error > case.error_wanted and found.spectrum.verdict != "neither":
        off = f"growth rates are within {100 * found.error:.2g} % of the largest"
        warnings.append(f"accuracy: {case.accuracy} was not kept: {off}")
    if part > FAST:
        warnings.append(REMEMBERS.format(part=part, change=100 * found.series_error))
    return warnings


def draw(directory: Path, out: Path, page: Page) -> list[Path]:
    """Growth rates and frequencies over the wave number; distances of a row over its position, and at both ends."""
    import numpy as np

    from pairsim.plots.chart import POINT, Panel, Series, draw_chart
    from pairsim.plots.labels import case_parts, read_case
    from pairsim.plots.lines import told_apart
    from pairsim.plots.style import COLOURS, LINES, printing
    from pairsim.plots.units import Units
    from pairsim.results.table_files import read_table

    units = Units.of(directory, page.physical)
    waves, row = (units.table(read_table(directory / f"{n}.csv", missing_ok=True)) for n in ("spectrum", "row"))
    parts = case_parts(read_case(directory / "case.yaml"), {"particles"}, units.scales is not None)
    panels = {n: Panel(units.axis_label(["k"]), units.axis_label([n])) for n in ("growth", "frequency")}
    charts = {"train": (panels, [Series(n, waves["k"], waves[n], waves[f"{n}_error"], mark=POINT) for n in panels])}
    if row:
        z, gaps = POSITION_OF_ROW.name, [name for name in row if name not in (POSITION_OF_ROW.name, "t")]
        ends = [np.array([row[name][at] for name in gaps]) for at in (0, -1)]
        bins, label = np.histogram_bin_edges(ends, "auto"), units.axis_label(gaps)
        lines = told_apart([Series("on the way", row[z], row[name], columns=(z, name)) for name in gaps])
        for name, d, colour, dashes in zip(("inlet", "outlet"), ends, COLOURS, LINES, strict=False):
            look = {"drawstyle": "steps-post", "color": colour, "linestyle": dashes}
            counts = np.pad(np.histogram(d, bins)[0], (0, 1))
            lines.append(Series("at the ends", bins, counts, label=name, look=look))
        shown = {"on the way": Panel(units.axis_label([z]), label), "at the ends": Panel(label, "distances")}
        charts["row"] = shown, lines
    with printing():
        return [path for n, chart in charts.items() for path in page.save(draw_chart(page, *chart, parts)[0], out, n)]


def _length(scales: Scales | None, length: float, unit: Unit = POSITION, name: str = " D_c") -> str:
    """A length in words, with the name of its unit where there are no scales."""
    from pairsim.results.units import in_unit

    return in_unit(scales, unit, length) + ("" if scales else name)


class TrainResult(Result):
    """An infinite train. `table` is train.csv, with one row; `frame("spectrum")` has a row for each wave."""

    def findings(self) -> list[str]:
        """Whether the train orders or clusters, and within which length of tube."""
        from pairsim.results.units import in_unit, scales_in

        if not rows_in(self.columns):
            return ["No train was found."]
        scales, row = scales_in(self.record), {name: column[0].item() for name, column in self.columns.items()}
        said = {name: _length(scales, row[name], LENGTH) for name in ("spacing", "d")}
        said |= {each: _length(scales, row[each]) for each in ("tube", "tube_least", "tube_most")}
        for name, unit in {"velocity": VELOCITY, "growth": RATE, "diffusion": RATE}.items():
            said[name] = in_unit(scales, unit, row[name], row[f"{name}_error"])
        if not isfinite(row["tube_most"]):
            said["tube_most"] = "never"
        C, off, verdict = row["diffusion"], row["diffusion_error"], row["verdict"]
        said["long"] = "decay" if off < C else "grow" if -off > C else "may decay or grow"
        said["wave"] = f"a wave of {2 * pi / row['k']:.3g} beads"
        said["within"] = _length(scales, row["velocity"] / abs(row["growth"] or nan))
        said["change"] = CHANGES.get(verdict, (nan, ""))[1]
        sentences = [BEADS, VERDICTS[verdict], LONG_WAVES, *([SPREAD] if isfinite(row["tube"]) else [])]
        return [*(each.format(**said) for each in sentences), *self.record.get("sentences", [])]


QUESTION = Question(
    model=TrainCase,
    check=check,
    estimate=estimate,
    solve=solve,
    tables={"train": TRAIN, "spectrum": SPECTRUM, "row": (POSITION_OF_ROW, "t", "d_1"), "propagator": (BY_FIRST,)},
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
