"""The computation of streams: short rows, the motion of streams by the model fitted to them, and its statistics."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace
from math import inf
from typing import Self

import numpy as np

from pairsim.analysis.arrivals import Arrivals
from pairsim.analysis.drops import poisson
from pairsim.computing import events
from pairsim.computing.kept_rows import KNOWN, KeptRows
from pairsim.computing.problems import steady_problem
from pairsim.computing.solved_rows import known_rows
from pairsim.computing.spread_entry import spread_entry
from pairsim.computing.warnings import beyond_checked, coarse_mesh
from pairsim.computing.workers import ALONE, Workers
from pairsim.questions.stream import (
    DISTANCES,
    KYMOGRAPH,
    LARGEST,
    LEAST,
    MEAN_D,
    PART,
    POISSON,
    POSITION_OF_STREAM,
    SENTENCES,
    STATISTICS,
    STREAM,
    StreamCase,
    spacing_of,
    work,
)
from pairsim.questions.stream.answer import sentences
from pairsim.questions.stream.found import Found
from pairsim.questions.stream.statistics import Way
from pairsim.record.column import table_row
from pairsim.record.columns import T, Z
from pairsim.record.run_entries import POINTS
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import BranchEnd
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.goals import U
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.rows.model import Row, RowModel, Waves, fitted
from pairsim.solvers.rows.short_rows import LEAST as LEAST_SOLVED
from pairsim.solvers.rows.short_rows import TRAINS, short_rows, unequal_rows
from pairsim.solvers.rows.stream_motion import follow

PLACES = 51  # lengths of tube at which statistics of streams are taken
BINS = 60  # bins of histograms; chosen
FARTHEST = 4.0  # largest distance in histograms, over the mean distance; chosen


def computation(case: StreamCase, monitor: Monitor, workers: Workers) -> events.Events:
    """Solve short rows, draw streams, and follow them along the tube."""
    rows_done, of_motion = work.of_rows(case), work.of_motion(case)
    goal = f"{case.stream.streams} streams of {case.beads} beads"
    yield events.Begin(goal, rows_done + 3 * of_motion)
    try:
        model, number = yield from _model(case, monitor, workers)
    except BranchEnd as end:
        yield events.Summary({})
        return events.Outcome("finished", end.reason, end.message)
    monitor.has_result()  # even if all rows were known already: from here on progress shows how long it will take
    yield events.Progress(rows_done + of_motion, "the model of rows is fitted", number)
    follower, ways = _Follower.of(case, model, monitor), list[Way]()
    for i in range(case.stream.streams):
        ways.append(follower.way(model, i))
        yield events.Progress(rows_done + (1 + (i + 1) / case.stream.streams) * of_motion, f"stream {i + 1}", number)
    by_model = follower.half_widths(ways[0])
    found = Found(ways, by_model, follower.edges)
    yield from _tables(case, found)
    entries = {POINTS: number, **spread_entry(case), SENTENCES: sentences(case, found)}
    yield events.Summary(entries, [*beyond_checked(case), *coarse_mesh(case, U.name)])
    return events.Outcome("finished", "end", f"{goal}, by {number} short rows")


def model_of(case: StreamCase, monitor: Monitor, workers: Workers = ALONE) -> RowModel:
    """The model that gives the velocities in the streams of a case.

    Raises:
        NoSteadyState: There is no quasi-steady state of a short row, or it was not found.
        MeshFailure: A mesh could not be generated.
    """
    solving = _model(case, monitor, workers)
    while True:
        try:
            next(solving)
        except StopIteration as end:
            return end.value[0]


def _model(case: StreamCase, monitor: Monitor, workers: Workers) -> Generator[events.Event, None, tuple[RowModel, int]]:
    """The model, and the number of the short rows that it is fitted to."""
    problem = replace(steady_problem(case, inf, monitor), volume_modulus=False)
    rows, waves = yield from _rows(case, problem, Parameters((), case.solid_models, case.liquid_model), workers)
    return fitted(rows, waves), len(rows)


def _rows(
    case: StreamCase, problem: SteadyProblem, alone: Parameters, workers: Workers
) -> Generator[events.Event, None, tuple[list[Row], list[Waves]]]:
    """The short rows of the case, and the waves of trains if the model is fitted to those, too."""
    most, by_particle = case.stream.neighbours, bool(case.spread)
    kept = KeptRows.of(case, problem, alone, most=most, by_particle=by_particle, least=LEAST_SOLVED)
    unequal = unequal_rows(any(case.Ca_es), LEAST_SOLVED) if by_particle else ()
    chains = [*short_rows(LEAST_SOLVED, most, by_particle), *unequal]
    solving = known_rows(kept, problem, alone, chains, TRAINS if work.with_trains(case) else (), workers)
    done, rows, trains, total = 0.0, 0, 0, work.short_rows(case)
    while True:
        try:
            each = next(solving)
        except StopIteration as end:
            if not rows:
                yield events.Progress(work.of_rows(case), KNOWN, len(end.value[0]))
            return end.value
        if isinstance(each, Row):
            rows += 1
            problem.monitor.has_result()  # rows can be solved, and progress shows how many are left
            done += work.of_row(case, len(each.values))
            yield events.Progress(done, f"short row {rows} of {total}", rows)
        else:
            trains += 1
            done += work.TRAIN
            yield events.Progress(done, f"train {trains}", rows + trains)


@dataclass(frozen=True)
class _Follower:
    """Follows the streams of a case along the tube.

    Attributes:
        case: The case.
        model: The model of rows, which also gives the length of a bead.
        arrivals: How beads arrive.
        mean: Mean distance between facing surfaces [D_c].
        monitor: Ends the computation.
    """

    case: StreamCase
    model: RowModel
    arrivals: Arrivals
    mean: float
    monitor: Monitor

    @classmethod
    def of(cls, case: StreamCase, model: RowModel, monitor: Monitor) -> Self:
        """The follower of a case."""
        stream, length, velocity = case.stream, float(model.alone[1]), float(model.alone[0] + model.alone[2])
        sizes = case.spread.diameter, case.spread.modulus
        arrivals = Arrivals(stream.arrivals, stream.jitter, length, stream.min_gap, *sizes)
        if isinstance(stream.positions, tuple):
            mean = float(np.diff(stream.positions).mean()) - length
        else:
            mean = case.d if case.d is not None else spacing_of(case, velocity) - length
        return cls(case, model, arrivals, mean, monitor)

    def way(self, model: RowModel, i: int) -> Way:
        """The way of stream `i` by a model; each stream has its own random numbers, whatever the model."""
        case, random = self.case, np.random.default_rng([self.case.stream.seed, i])
        if isinstance(known := case.stream.positions, tuple):
            parts = self.arrivals.parts(random, case.beads)
            gaps = self.arrivals.between(np.array(known), parts)
        else:
            gaps, parts = self.arrivals.draw(random, self.mean, case.beads)
        places = np.linspace(0.0, case.stream.tube, PLACES).tolist()
        on_the_way = follow(model, gaps, parts if case.spread else None, case.stream.min_gap, places, self.monitor)
        return Way.of(on_the_way, self.arrivals.length * (1 + parts[:, 0]), case.stream.drop, self.edges)

    @property
    def edges(self) -> Array:
        """Edges of the bins of histograms [D_c]."""
        return np.linspace(0.0, FARTHEST * self.mean, BINS + 1)

    def half_widths(self, first: Way) -> Array:
        """Half-widths of the statistics due to the model, shape (PLACES, statistics).

        They are the root-sum-square of the changes in the first stream, given as `first`, with the other models in
        `RowModel.variants`.
        """
        changes = [self.way(other, 0).counted - first.counted for other in self.model.variants]
        return np.linalg.norm(changes, axis=0)


def _tables(case: StreamCase, found: Found) -> Generator[events.Event]:
    """The tables of a stream."""
    yield events.Table("stream", STREAM.named(1))
    ways, first = found.ways, found.ways[0]
    per_drop = found.per_drop(case)
    independent = np.full(len(POISSON), np.nan) if per_drop is None else poisson(per_drop)
    every = zip(found.means, found.half_widths, found.by_model, strict=True)
    for i, (means, errors, models) in enumerate(every):
        along = {POSITION_OF_STREAM: "position", T: "time", MEAN_D: "mean"}
        row = {column.name: float(np.mean([getattr(way, name)[i] for way in ways])) for column, name in along.items()}
        for each, mean, error, model in zip(STATISTICS, means, errors, models, strict=True):
            row |= {each.name: float(mean), f"{each.name}_error": float(error), f"{each.name}_model": float(model)}
        yield events.Row("stream", row | {c.name: float(p) for c, p in zip(POISSON.values(), independent, strict=True)})
    yield events.Table("distances", DISTANCES.named(1), list(_histograms(found)))
    n = first.middle.shape[1]
    moments = zip(first.position, first.time, first.middle, strict=True)
    rows = [table_row(n, {POSITION_OF_STREAM: z, T: t, Z: places}) for z, t, places in moments]
    yield events.Table("kymograph", KYMOGRAPH.named(n), rows)


def _histograms(found: Found) -> Generator[dict[str, float]]:
    """The rows of distances.csv, at the inlet, half way and at the outlet."""
    parts = np.mean([way.histograms for way in found.ways], axis=0)
    for i in (0, PLACES // 2, PLACES - 1):
        position = float(np.mean([way.position[i] for way in found.ways]))
        for least, largest, part in zip(found.edges[:-1], found.edges[1:], parts[i], strict=True):
            yield table_row(1, {POSITION_OF_STREAM: position, LEAST: least, LARGEST: largest, PART: part})
