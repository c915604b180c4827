"""Short rows, the streams that move by them, and what is counted of these."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from math import inf
from typing import Any, NamedTuple

import numpy as np

from pairsim.analysis.arrivals import Arrivals
from pairsim.analysis.drops import poisson
from pairsim.computing import events
from pairsim.computing.kept_rows import KeptRows
from pairsim.computing.problems import steady_problem
from pairsim.computing.spread_entry import spread_entry
from pairsim.computing.warnings import beyond_checked, coarse_mesh
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
from pairsim.questions.stream.statistics import Statistics, places_of
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
from pairsim.solvers.rows.short_rows import places_of as places_of_rows
from pairsim.solvers.rows.short_rows import short_rows, trains
from pairsim.solvers.rows.stream_motion import Stream, follow

PLACES = 51  # lengths of tube at which streams are looked at
SHOWN = 60  # beads of kymograph.csv at most, those in the middle of the first stream; chosen
BINS = 60  # of histograms; chosen
FARTHEST = 4.0  # distance at which they end over the mean distance; chosen


class Moved(NamedTuple):
    """Streams on their way, with what is counted of them at each length of tube."""

    on_the_way: list[Stream]
    counted: list[Statistics]
    lengths: Array  # of the beads [D_c], shape (streams, N)


def computation(case: StreamCase, monitor: Monitor) -> events.Events:
    """Solve short rows, draw streams, and let them move."""
    rows_done, of_motion = work.of_rows(case), work.of_motion(case)
    goal = f"{case.stream.streams} streams of {case.beads} beads"
    yield events.Begin(goal, rows_done + 3 * of_motion)
    problem = replace(steady_problem(case, inf, monitor), volume_modulus=False)
    alone = Parameters((), case.solid_models, case.liquid_model)
    try:
        rows, waves = yield from _rows(case, problem, alone)
    except BranchEnd as end:
        yield events.Summary({})
        return events.Outcome("finished", end.reason, end.message)
    model = fitted(rows, waves)
    yield events.Progress(rows_done + of_motion, "the model of rows is fitted", len(rows))
    first, parts = _arrivals(case, model)
    moved = _moved(case, model, first, parts, monitor)
    yield events.Progress(rows_done + 2 * of_motion, f"{goal} have moved", len(rows) + 1)
    by_model = _half_widths_of_model(case, model, first, parts, moved, monitor)
    yield from _tables(case, moved, by_model)
    entries = {POINTS: len(rows), **spread_entry(case), SENTENCES: sentences(case, moved, by_model)}
    yield events.Summary(entries, [*beyond_checked(case), *coarse_mesh(case, U.name)])
    return events.Outcome("finished", "end", f"{goal}, by {len(rows)} short rows")


def _rows(
    case: StreamCase, problem: SteadyProblem, alone: Parameters
) -> Generator[events.Event, None, tuple[list[Row], list[Waves]]]:
    """The short rows of the case, and the waves of trains if the model is fitted to these, too."""
    most, by_particle = case.stream.neighbours, bool(case.spread)
    kept = KeptRows.of(case, problem, alone, most=most, by_particle=by_particle, least=work.LEAST)
    with kept.sole_solver(problem.monitor):
        if (found := kept.read()) is not None:
            yield events.Progress(work.of_rows(case), "short rows are known from an earlier case", len(found[0]))
            return found
        rows, waves, done = list[Row](), list[Waves](), 0.0
        total = sum(len(places_of_rows(count, work.LEAST)) for count in range(1, most + 1))
        for row in short_rows(problem, alone, work.LEAST, most, by_particle):
            rows.append(row)
            done += work.of_row(case, len(row.values))
            yield events.Progress(done, f"short row {len(rows)} of {total}", len(rows))
        for wave in trains(problem, alone) if work.with_trains(case) else ():
            waves.append(wave)
            done += work.TRAIN
            yield events.Progress(done, f"train {len(waves)}", len(rows) + len(waves))
        kept.write(rows, waves)
        return rows, waves


def _arrivals(case: StreamCase, model: RowModel) -> tuple[Array, Array]:
    """First distances [D_c], (streams, N-1), and deviations of the beads, (streams, N, 2)."""
    stream, length = case.stream, float(model.alone[1])
    sizes = case.spread.diameter, case.spread.modulus
    arrivals = Arrivals(stream.arrivals, stream.jitter, length, stream.min_gap, *sizes)
    randoms = [np.random.default_rng([stream.seed, i]) for i in range(stream.streams)]
    if isinstance(stream.positions, tuple):
        every = [arrivals.parts(random, case.beads) for random in randoms]
        return np.array([arrivals.between(np.array(stream.positions), each) for each in every]), np.array(every)
    velocity = float(model.alone[0] + model.alone[2])
    mean = case.d if case.d is not None else spacing_of(case, velocity) - length
    drawn = [arrivals.draw(random, mean, case.beads) for random in randoms]
    return np.array([gaps for gaps, _ in drawn]), np.array([parts for _, parts in drawn])


def _moved(case: StreamCase, model: RowModel, first: Array, parts: Array, monitor: Monitor) -> Moved:
    """Let streams move from their first distances; beads of a case without a spread are equal."""
    lengths = float(model.alone[1]) * (1 + parts[..., 0])
    ways = np.linspace(0.0, case.stream.tube, PLACES).tolist()
    differ = parts if case.spread else None
    on_the_way = list(follow(model, first, differ, case.stream.min_gap, ways, monitor))
    return Moved(on_the_way, [Statistics.of(each, lengths, case.stream.drop) for each in on_the_way], lengths)


def _half_widths_of_model(
    case: StreamCase, model: RowModel, first: Array, parts: Array, moved: Moved, monitor: Monitor
) -> Array:
    """Half-widths by the model, shape (PLACES, statistics).

    They are by how much the statistics of the first stream change if short rows are left out, as those of velocities
    are (`RowModel.dU_errors`).
    """
    found = np.zeros((PLACES, len(STATISTICS)))
    for other in model.others:
        one = _moved(case, other, first[:1], parts[:1], monitor)
        for i, (mine, theirs) in enumerate(zip(moved.counted, one.counted, strict=True)):
            found[i] += (theirs.each[0] - mine.each[0]) ** 2
    return np.sqrt(found)


def _tables(case: StreamCase, moved: Moved, by_model: Array) -> Generator[events.Event]:
    """The tables of a stream."""
    names = STREAM.named(1)
    yield events.Table("stream", names)
    per_drop = _per_drop(case, moved)
    independent = np.full(len(POISSON), np.nan) if per_drop is None else poisson(per_drop)
    for stream, counted, model in zip(moved.on_the_way, moved.counted, by_model, strict=True):
        row: dict[str, Any] = {
            POSITION_OF_STREAM.name: stream.way.mean(),
            T.name: stream.time,
            MEAN_D.name: stream.gaps.mean(),
        }
        for each, mean, error, of_model in zip(STATISTICS, counted.means, counted.half_widths, model, strict=True):
            row |= {each.name: mean, f"{each.name}_error": error, f"{each.name}_model": of_model}
        row |= {column.name: part for column, part in zip(POISSON.values(), independent, strict=True)}
        yield events.Row("stream", {name: float(value) for name, value in row.items()})
    yield events.Table("distances", DISTANCES.named(1), list(_histograms(moved)))
    yield _kymograph(moved)


def _per_drop(case: StreamCase, moved: Moved) -> float | None:
    """Beads of a drop on average; None if drops are not counted."""
    if case.stream.drop is None:
        return None
    first = moved.on_the_way[0]
    rows = places_of(first.gaps, moved.lengths)
    spacing = float((rows[:, -1] - rows[:, 0]).mean()) / (rows.shape[1] - 1)
    return case.stream.drop * float(first.velocities.mean()) / spacing


def _histograms(moved: Moved) -> Generator[dict[str, float]]:
    """The rows of distances.csv, at the inlet, half way and at the outlet."""
    edges = np.linspace(0.0, FARTHEST * float(moved.on_the_way[0].gaps.mean()), BINS + 1)
    for stream in (moved.on_the_way[i] for i in (0, PLACES // 2, PLACES - 1)):
        parts = np.histogram(np.minimum(stream.gaps, edges[-1]), edges)[0] / stream.gaps.size
        for least, largest, part in zip(edges[:-1], edges[1:], parts, strict=True):
            values = {POSITION_OF_STREAM: stream.way.mean(), LEAST: least, LARGEST: largest, PART: part}
            yield table_row(1, values)


def _kymograph(moved: Moved) -> events.Table:
    """The beads in the middle of the first stream on their way."""
    count = moved.lengths.shape[1]
    begin = max((count - SHOWN) // 2, 0)
    shown = slice(begin, min(begin + SHOWN, count))
    lengths = moved.lengths[:1, shown]
    start = places_of(moved.on_the_way[0].gaps[:1, shown.start : shown.stop - 1], lengths)[0]
    rows, n = [], lengths.shape[1]
    for stream in moved.on_the_way:
        apart = places_of(stream.gaps[:1, shown.start : shown.stop - 1], lengths)[0]
        z = start[0] + stream.way[0, begin] + apart
        rows.append(table_row(n, {POSITION_OF_STREAM: stream.way[0, shown].mean(), T: stream.time, Z: z}))
    return events.Table("kymograph", KYMOGRAPH.named(n), rows)
