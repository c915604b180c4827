"""A curve from rest: dU at held distances after a time, and after twice and four times that."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from pairsim.analysis.master_curve import Curve
from pairsim.cases.estimate import Estimate
from pairsim.cases.run_case import Case
from pairsim.computing import events
from pairsim.computing.workers import Desk, Workers, found_in_parts
from pairsim.quantities.kinds import TIME
from pairsim.questions.curve import AFTER, CurveCase
from pairsim.questions.run import estimate
from pairsim.record.column import names_of
from pairsim.record.columns import DISTANCE, DU, DU_ERROR, DU_HALF, DU_QUARTER, TAYLOR, T, U
from pairsim.record.run_entries import POINTS, SIZE, TIME_STEPS, Entries
from pairsim.record.table import Table
from pairsim.runtime.message import Message
from pairsim.runtime.monitor import Monitor
from pairsim.runtime.text import counted

EARLIER = {DU_QUARTER: 0.25, DU_HALF: 0.5}  # the columns of dU at these fractions of the end time


def run_at(case: CurveCase, place: tuple[float, ...]) -> Case:
    """The run from rest in which the particles are held at one place of a curve: its distances [D_c], N-1 values."""
    assert case.after is not None
    shared = {key: getattr(case, key) for key in case.model_fields_set & Case.model_fields.keys()}
    end = 4 * case.after
    output = {"times": [part * end for part in EARLIER.values()], "fields": False}
    own = {"d0": place, "start": "rest", "hold": True, "dU_error": True, "time": {"end": end}, "output": output}
    return Case.model_validate(shared | own)


def estimate_from_rest(case: CurveCase, points: int) -> Estimate:
    """Size and duration of a curve from rest with this number of points."""
    return estimate(run_at(case, case.places[0]), points)


def from_rest(case: CurveCase, monitor: Monitor, workers: Workers) -> events.Events:
    """Compute a curve from rest; each distance is computed on its own, by any of the workers."""
    places, found, summaries = case.in_order, dict[int, dict[str, Any]](), list[events.Summary]()
    distances, end = counted(len(places), "distance"), TIME(4 * (case.after or 0), "g")
    yield events.Begin(Message("{}, at each from rest to t = {}", distances, end), len(places))
    yield events.Table("curve", names_of(case.n, DISTANCE, DU, DU_ERROR, *EARLIER, U, TAYLOR), ascending=True)
    try:
        for i, each in found_in_parts(workers, monitor, [partial(_solve_at, case, place) for place in places]):
            match each:
                case events.Progress(part, text, steps):
                    yield events.Progress(len(found) + part, text, steps)
                case events.Summary():
                    summaries.append(each)
                case events.Row(table, values):
                    found[i] = {**values}
                    yield events.Row(table, values)
        return events.Outcome("finished", "end", counted(len(found), "point"))
    finally:
        rows = [found[i] for i in sorted(found)]
        if case.n == 2 and len(rows) > 1:
            zeros = Curve(Table.of_rows(reversed(rows))).equilibria
            yield events.Table("equilibria", list(zeros), zeros.records())
        taken, sizes = ([each.entries.get(entry, 0) for each in summaries] for entry in (TIME_STEPS, SIZE))
        entries: Entries = {POINTS: len(rows), AFTER: case.after, TIME_STEPS: sum(taken), SIZE: max(sizes, default=0)}
        yield events.Summary(entries, [*dict.fromkeys(text for each in summaries for text in each.warnings)])


def _solve_at(
    case: CurveCase, place: tuple[float, ...], desk: Desk
) -> Iterator[events.Progress | events.Summary | events.Row]:
    """Solve at one place; yields the progress of its run from 0 to 1, its summary, and last the row of the curve."""
    from pairsim.questions.run.computation import Run

    run, series = run_at(case, place), list[Any]()
    for event in Run(run, desk.monitor, None).computation():
        match event:
            case events.Row(_, values):
                desk.monitor.has_result()
                series.append(values)
            case events.Progress(t, text, steps):
                yield events.Progress(t / run.time.end, text, steps)
            case events.Summary():
                yield event
    yield events.Row("curve", _row(series, case.n) | dict(zip(DISTANCE.named(case.n), place, strict=True)))


def _row(series: list[dict[str, float]], n: int) -> dict[str, float]:
    """The last row of a run of n particles, with the columns in `EARLIER`, whose values are interpolated in time."""
    row, times = {**series[-1]}, np.array([each[T.name] for each in series])
    for column, part in EARLIER.items():
        for own, dU in zip(column.named(n), DU.named(n), strict=True):
            row[own] = float(np.interp(part * times[-1], times, [each[dU] for each in series]))
    return row
