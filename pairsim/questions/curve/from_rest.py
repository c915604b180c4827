"""A curve from rest: dU at held distances after a time, and after twice and four times that."""

from __future__ import annotations

from typing import Any

import numpy as np

from pairsim.cases.estimate import Estimate
from pairsim.cases.run_case import Case
from pairsim.computing import events
from pairsim.quantities.kinds import TIME
from pairsim.questions.curve import CurveCase
from pairsim.questions.run import estimate
from pairsim.results.columns import names_of
from pairsim.results.curve_table import zeros_of
from pairsim.runtime.message import Message
from pairsim.runtime.monitor import Monitor
from pairsim.runtime.text import counted

EARLIER = {"dU_quarter": 0.25, "dU_half": 0.5}  # the columns of dU at parts of the time


def run_at(case: CurveCase, place: tuple[float, ...]) -> Case:
    """The run from rest in which the particles are held at one of the distances of a curve."""
    assert case.after is not None
    shared = {key: getattr(case, key) for key in case.model_fields_set & Case.model_fields.keys()}
    end = 4 * case.after
    output = {"times": [part * end for part in EARLIER.values()], "fields": False}
    own = {"d0": place, "start": "rest", "hold": True, "dU_error": True, "time": {"end": end}, "output": output}
    return Case.model_validate(shared | own)


def estimate_from_rest(case: CurveCase, points: int) -> Estimate:
    """Size and duration of a curve from rest with some points."""
    return estimate(run_at(case, case.places[0]), points)


def from_rest(case: CurveCase, monitor: Monitor) -> events.Events:
    """Compute a curve from rest."""
    from pairsim.questions.run.computation import Run

    places, rows, summaries = case.in_order, list[dict[str, float]](), list[events.Summary]()
    distances, end = counted(len(places), "distance"), TIME(4 * (case.after or 0), "g")
    yield events.Begin(Message("{}, at each from rest to t = {}", distances, end), len(places))
    yield events.Table("curve", names_of(case.n, "d", "dU", "dU_error", *EARLIER, "U", "D"), ascending=True)
    try:
        for count, place in enumerate(places):
            run, series = run_at(case, place), list[Any]()
            for event in Run(run, monitor, None).computation():
                match event:
                    case events.Row(_, values):
                        monitor.has_result()
                        series.append(values)
                    case events.Progress(t, text, steps):
                        yield events.Progress(count + t / run.time.end, text, steps)
                    case events.Summary():
                        summaries.append(event)
            rows.append(_row(series, case.n) | dict(zip(names_of(case.n, "d"), place, strict=True)))
            yield events.Row("curve", rows[-1])
        return events.Outcome("finished", "end", counted(len(rows), "point"))
    finally:
        if case.n == 2 and len(rows) > 1:
            table = {name: np.array([row[name] for row in reversed(rows)]) for name in rows[0]}
            zeros = zeros_of(table)
            found = [dict(zip(zeros, row, strict=True)) for row in zip(*zeros.values(), strict=True)]
            yield events.Table("equilibria", list(zeros), found)
        entries: dict[str, Any] = {"points": len(rows), "after": case.after}
        costs = {name: [each.entries.get(name, 0) for each in summaries] for name in ("steps", "unknowns")}
        entries |= {"steps": sum(costs["steps"]), "unknowns": max(costs["unknowns"], default=0)}  # none without a mesh
        yield events.Summary(entries, [*dict.fromkeys(text for each in summaries for text in each.warnings)])


def _row(series: list[dict[str, float]], n: int) -> dict[str, float]:
    """The last row of a run of n particles, and dU at parts of its time."""
    row, times = {**series[-1]}, np.array([each["t"] for each in series])
    for name, part in EARLIER.items():
        for own, dU in zip(names_of(n, name), names_of(n, "dU"), strict=True):
            row[own] = float(np.interp(part * times[-1], times, [each[dU] for each in series]))
    return row
