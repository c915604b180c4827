"""The motion of a row of beads along the tube, and what becomes of its distances."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from pairsim.cases.case import PERIODIC_LENGTH
from pairsim.computing import events
from pairsim.computing.kept_rows import KNOWN, KeptRows
from pairsim.computing.solved_rows import known_rows, solved_rows
from pairsim.computing.workers import Workers
from pairsim.quantities.kinds import LENGTH, POSITION, VELOCITY
from pairsim.quantities.text import in_unit, with_name
from pairsim.questions.train import BY_DISTANCE, ROW, TrainCase, work
from pairsim.record.column import table_row
from pairsim.runtime.arrays import Array, Flags
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.rows.model import Row, RowModel, fitted
from pairsim.solvers.rows.row_motion import TOLERANCE, Places, move, propagator
from pairsim.solvers.rows.short_rows import LEAST, MOST, TRAINS, Chain, short_rows
from pairsim.solvers.trains.train import Train

PLACES = 101  # number of rows of row.csv


def first_gaps(case: TrainCase, d: float) -> Array:
    """The first distances of a row with the mean distance d [D_c], shape (N-1,); empty if no row is followed.

    Random distances have a gamma distribution above `min_gap`.
    """
    row = case.row
    if row.beads is None:
        return np.array(case.listed)
    scale = (row.spread * d) ** 2 / (d - row.min_gap)
    random = np.random.default_rng(row.seed).gamma((d - row.min_gap) / scale, scale, row.beads - 1)
    return np.asarray(row.min_gap + random)


@dataclass
class Progress:
    """How far the computation is.

    Attributes:
        done: The work that is done.
        scale: Factor of it in the progress shown, since some of the estimated work was not needed; what is left then
            advances evenly.
        solutions: Number of solutions so far.
    """

    done: float
    scale: float
    solutions: int = 0

    def after(self, work: float, words: str) -> events.Progress:
        """The event after a solution that took this much work."""
        self.done += work
        self.solutions += 1
        return events.Progress(self.scale * self.done, words, self.solutions)


@dataclass(frozen=True)
class Motion:
    """How a row moves along the tube, at `PLACES` times [D_c/U_av].

    Attributes:
        model: The model that gives the velocities of the row.
        places: The places of the particles, as if they had no length [D_c], as a function of time.
        steps: The times of the steps [D_c/U_av], shape (m,).
        contact: Distance at which particles touch [D_c].
    """

    model: RowModel
    places: Places
    steps: Array
    contact: float

    @cached_property
    def times(self) -> Array:
        """The times [D_c/U_av], shape (PLACES,)."""
        return np.linspace(0.0, self.steps[-1], PLACES)

    @cached_property
    def way(self) -> Array:
        """How far each particle has moved at the times [D_c], shape (N, PLACES)."""
        return self.places(self.times) - self.places(0.0)[:, None]

    @cached_property
    def distances(self) -> Array:
        """The distances at the times [D_c], shape (PLACES, N-1)."""
        return np.diff(self.places(self.times), axis=0).T

    @cached_property
    def touching(self) -> Flags:
        """Which particles touch at the steps, shape (m, N-1)."""
        return self.contact + TOLERANCE >= np.diff(self.places(self.steps), axis=0).T

    @cached_property
    def dU(self) -> Array:
        """Relative velocities at the times [U_av], shape (PLACES, N-1)."""
        return np.array([self.model.row(d).dU for d in self.distances])

    @cached_property
    def dU_errors(self) -> Array:
        """Their half-widths [U_av], of the same shape."""
        return np.array([self.model.dU_errors(d) for d in self.distances])

    def rows(self, diameter: float) -> list[dict[str, float]]:
        """The rows of row.csv, of particles of a diameter [D_c]."""
        n = len(self.way)
        z = (self.places(self.times) + diameter * np.arange(n)[:, None]).T
        values = zip(self.way.mean(axis=0), self.times, z, self.distances, self.dU, self.dU_errors, strict=True)
        return [table_row(n, dict(zip(ROW, moment, strict=True))) for moment in values]

    def neighbours(self, count: int, least: float) -> Array:
        """Distances of all sets of `count` neighbours at all times, shape (sets, count - 1).

        Sets with a distance below `least` [D_c] are left out.
        """
        found = sliding_window_view(self.distances, count - 1, axis=1).reshape(-1, count - 1)
        return np.asarray(found[found.min(axis=1) >= least])


def follow(
    case: TrainCase,
    problem: SteadyProblem,
    alone: Parameters,
    gaps: Array,
    train: Train,
    done: float,
    unneeded: float,
    workers: Workers,
) -> Generator[events.Event, None, list[str]]:
    """Follow a row along the tube.

    Args:
        case: The case.
        problem: The problem of a single bead in the train.
        alone: The materials of a single bead.
        gaps: The first distances of the row [D_c], shape (N-1,).
        train: The train of the same mean distance, with which the model of the row is compared.
        done: The work that is done already, in the unit of `work.py`.
        unneeded: The part of the estimated work of the case that turned out not to be needed.
        workers: The processes that share the short rows.

    Returns:
        The sentences of the answer about the row.
    """
    progress = Progress(done, work.of_case(case) / (work.of_case(case) - unneeded))
    problem, n = replace(problem, length=PERIODIC_LENGTH * problem.betas[0], closed=False), len(gaps) + 1
    least = min(LEAST, gaps.min() if case.listed else gaps.mean() / 2)
    kept = KeptRows.of(case, problem, alone, most=MOST, by_particle=False, least=least)
    model = yield from _model(kept, problem, alone, least, progress, workers)
    steps, places = move(model, gaps, case.row.min_gap, case.row.tube, problem.monitor)
    motion = Motion(model, places, steps, case.row.min_gap)
    rows = motion.rows(problem.betas[0])
    yield progress.after(work.of_motion(n), f"the row of {n} has moved")
    yield events.Table("row", ROW.named(n), rows)
    sentences = list(_row_in_words(case, motion))
    count = min(n, work.AUDITED)
    if len(neighbours := motion.neighbours(count, least)):
        widest, narrowest = neighbours[neighbours.mean(axis=1).argsort()[[-1, 0]]].tolist()
        both = Chain([tuple(widest), tuple(narrowest)])
        chains = both.cut(1) if workers.count > 1 else [both]
        audits = [each for each in solved_rows(problem, alone, chains, (), workers) if isinstance(each, Row)]
        yield progress.after(work.of_audits(n), f"rows of {count} are solved")
        sentences.append(_audited(model, audits, train, count))
    if n <= work.MOST_PROPAGATED and not motion.touching.any():
        changes = propagator(model, places, steps[-1])
        yield _table("propagator", [f"{BY_DISTANCE.name}_{i}" for i in range(1, n)], changes)
        singular = np.linalg.svd(changes, compute_uv=False)
        sentences.append(
            f"Small changes of the first distances become {singular[-1]:.3g} to {singular[0]:.3g} times as large, "
            "depending on which of them change."
        )
    return sentences


def _model(
    kept: KeptRows, problem: SteadyProblem, alone: Parameters, least: float, progress: Progress, workers: Workers
) -> Generator[events.Event, None, RowModel]:
    """Solve short rows and trains, down to the distance `least` [D_c], and fit the model of long rows to them."""
    chains = [*short_rows(least)]
    total, rows, trains = sum(len(chain.places) for chain in chains), 0, 0
    solving = known_rows(kept, problem, alone, chains, TRAINS, workers)
    while True:
        try:
            each = next(solving)
        except StopIteration as end:
            if not rows:
                yield progress.after(work.of_rows(), KNOWN)
            return fitted(*end.value)
        if isinstance(each, Row):
            rows += 1
            yield progress.after(work.of_short_row(len(each.values)), f"short row {rows} of {total}")
        else:
            trains += 1
            yield progress.after(work.TRAIN, f"train {trains} of {len(TRAINS)}")


def _row_in_words(case: TrainCase, motion: Motion) -> Iterator[str]:
    """Yield what becomes of the distances of the row, and which gaps close, in words."""
    ends, count = motion.distances[[0, -1]], motion.distances.shape[1]
    spreads = " to ".join(f"{100 * d.std() / d.mean():.3g} %" for d in ends)
    means = " to ".join(in_unit(case.scales, LENGTH, d.mean()) for d in ends)
    tube = with_name(case.scales, POSITION, motion.way[:, -1].min())
    half, most, largest = (
        in_unit(case.scales, VELOCITY, each)
        for each in (np.median(motion.dU_errors), motion.dU_errors.max(), np.abs(motion.dU).max())
    )
    yield f"Spread of {count} distances within {tube} of tube: from {spreads} of their mean, which goes from {means}."
    yield (
        f"Half-widths of dU along the tube: half of them are at most {half}, all are at most {most}; the largest |dU| "
        f"is {largest}."
    )
    if motion.touching.any():
        step, gap = np.argwhere(motion.touching)[0]
        moved = motion.places(motion.steps[step]) - motion.places(0.0)
        place = with_name(case.scales, POSITION, moved[gap : gap + 2].mean())
        yield (
            f"Gap {gap + 1} closes first, after {place}. In all {motion.touching.any(axis=0).sum()} close, and "
            f"{motion.touching[-1].sum()} stay closed; beads that touch are assumed to travel on as doublets, held by "
            "equal and opposite forces until these would have to pull."
        )


def _audited(model: RowModel, audits: Sequence[Row], train: Train, count: int) -> str:
    """The errors of the model, in words: against `audits`, rows of `count` neighbours solved in full, and the train."""
    off = 100 * max(abs(model.row(row.gaps).dU - row.dU).max() / abs(row.dU).max() for row in audits)
    k, rates = train.spectrum.waves
    growth = 100 * abs(model.growth(train.d, k) - rates).max() / abs(rates).max()
    return (
        f"Error of the model of the row: dU of the narrowest and the widest {count} neighbours along the tube, which "
        f"were solved in full, is off by at most {off:.2g} % of their largest |dU|, growth rates of the train by "
        f"{growth:.2g} % of the largest."
    )


def _table(name: str, columns: list[str], rows: Array) -> events.Table:
    return events.Table(name, columns, [dict(zip(columns, row, strict=True)) for row in rows.tolist()])
