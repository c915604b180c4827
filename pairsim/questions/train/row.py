"""A row of beads that is followed along the tube, and what becomes of it."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from pairsim.computing import events
from pairsim.quantities.kinds import LENGTH, POSITION, VELOCITY
from pairsim.quantities.text import in_unit, with_name
from pairsim.questions.train import BY_DISTANCE, ROW, TrainCase, work
from pairsim.record.column import table_row
from pairsim.runtime.arrays import Array
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.rows.model import Row, fitted
from pairsim.solvers.rows.row_motion import TOLERANCE, move, propagator
from pairsim.solvers.rows.short_rows import MOST, TRAINS, places_of, short_rows, solved, trains
from pairsim.solvers.trains.train import Train

LONG = 50.0  # length of the tube of short rows over the diameter of a bead, as of other cases
LEAST = 0.04  # smallest distance at which short rows are solved [D_c]; chosen
PLACES = 101  # rows of row.csv


def first_gaps(case: TrainCase, d: float) -> Array:
    """The first distances of the row in a train with distance d [D_c], shape (N-1,); none if no row is followed.

    Those at random have a gamma distribution beyond `min_gap`.
    """
    row = case.row
    if row.beads is None:
        return np.array(case.listed)
    scale = (row.spread * d) ** 2 / (d - row.min_gap)
    random = np.random.default_rng(row.seed).gamma((d - row.min_gap) / scale, scale, row.beads - 1)
    return np.asarray(row.min_gap + random)


def follow(
    case: TrainCase, problem: SteadyProblem, alone: Parameters, gaps: Array, train: Train, done: float, unneeded: float
) -> Generator[events.Event, None, list[str]]:
    """Follow a row from its first distances [D_c], (N-1,), along the tube; returns what it says.

    Problem and parameters are those of a bead alone in the train. So much work is done, and of that of the case so much
    was not needed.
    """
    of_needed = work.of_case(case) / (work.of_case(case) - unneeded)  # what is left goes on evenly
    problem, n, rows = replace(problem, length=LONG * problem.betas[0], closed=False), len(gaps) + 1, list[Row]()
    least = min(LEAST, gaps.min() if case.listed else gaps.mean() / 2)
    total = sum(len(places_of(count, least)) for count in range(1, MOST + 1))
    for row in short_rows(problem, alone, least):
        rows.append(row)
        done += work.of_short_row(len(row.values))
        yield events.Progress(of_needed * done, f"short row {len(rows)} of {total}", len(rows))
    waves = []
    for wave in trains(problem, alone):
        waves.append(wave)
        done += work.TRAIN
        yield events.Progress(of_needed * done, f"train {len(waves)} of {len(TRAINS)}", len(rows) + len(waves))
    model = fitted(rows, waves)
    t, places = move(model, gaps, case.row.min_gap, case.row.tube, problem.monitor)
    times = np.linspace(0.0, t[-1], PLACES)
    way, states = places(times) - places(0.0)[:, None], np.diff(places(times), axis=0).T
    touching = case.row.min_gap + TOLERANCE >= np.diff(places(t), axis=0).T
    dU, errors = np.array([model.row(d).dU for d in states]), np.array([model.dU_errors(d) for d in states])
    done += work.of_motion(n)
    yield events.Progress(of_needed * done, f"the row of {n} has moved", len(rows) + len(waves) + 1)
    z = (places(times) + problem.betas[0] * np.arange(n)[:, None]).T
    values = zip(way.mean(axis=0), times, z, states, dU, errors, strict=True)
    moments = [table_row(n, dict(zip(ROW, moment, strict=True))) for moment in values]
    yield events.Table("row", ROW.named(n), moments)
    spreads = " to ".join(f"{100 * d.std() / d.mean():.3g} %" for d in states[[0, -1]])
    means = " to ".join(in_unit(case.scales, LENGTH, d.mean()) for d in states[[0, -1]])
    tube = with_name(case.scales, POSITION, way[:, -1].min())
    sentences = [
        f"Spread of {n - 1} distances within {tube} of tube: from {spreads} of their mean, which goes from {means}.",
        f"Half-widths of dU along the tube: half of them at most {in_unit(case.scales, VELOCITY, np.median(errors))}, "
        f"all at most {in_unit(case.scales, VELOCITY, errors.max())}; the largest |dU| is "
        f"{in_unit(case.scales, VELOCITY, np.abs(dU).max())}.",
    ]
    if touching.any():
        step, gap = np.argwhere(touching)[0]
        place = with_name(case.scales, POSITION, (places(t[step]) - places(0.0))[gap : gap + 2].mean())
        sentences.append(
            f"Gap {gap + 1} closes first, after {place}. In all {touching.any(axis=0).sum()} close, and "
            f"{touching[-1].sum()} stay closed; beads that touch are assumed to travel on as doublets, held by equal "
            "and opposite forces until these would have to pull."
        )
    neighbours = sliding_window_view(states, min(n, work.AUDITED) - 1, axis=1).reshape(-1, min(n, work.AUDITED) - 1)
    if len(neighbours := neighbours[neighbours.min(axis=1) >= least]):
        widest, narrowest = neighbours[neighbours.mean(axis=1).argsort()[[-1, 0]]].tolist()
        audits = [*solved(problem, alone, [tuple(widest), tuple(narrowest)])]
        done += work.of_audits(n)
        solved_ones = f"rows of {min(n, work.AUDITED)} are solved"
        yield events.Progress(of_needed * done, solved_ones, len(rows) + len(waves) + 2)
        off = 100 * max(abs(model.row(row.gaps).dU - row.dU).max() / abs(row.dU).max() for row in audits)
        k, rates = train.spectrum.waves
        growth = 100 * abs(model.growth(train.d, k) - rates).max() / abs(rates).max()
        sentences.append(
            f"By how much the model of the row is off: dU of the narrowest and the widest {min(n, work.AUDITED)} "
            f"neighbours along the tube, which were solved in full, by {off:.2g} % of their largest |dU| at most; "
            f"growth rates of the train by {growth:.2g} % of the largest."
        )
    if n <= work.MOST_PROPAGATED and not touching.any():
        changes = propagator(model, places, t[-1])
        yield _table("propagator", [f"{BY_DISTANCE.name}_{i}" for i in range(1, n)], changes)
        singular = np.linalg.svd(changes, compute_uv=False)
        sentences.append(
            f"Small changes of the first distances become {singular[-1]:.3g} to {singular[0]:.3g} times as large, by "
            "which of them change."
        )
    return sentences


def _table(name: str, columns: list[str], rows: Array) -> events.Table:
    return events.Table(name, columns, [dict(zip(columns, row, strict=True)) for row in rows.tolist()])
