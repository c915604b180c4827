"""The answer of a run in words: what a pair does once the start-up has decayed, and whether it has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pairsim.computing.question import shapes_in
from pairsim.quantities.kinds import LENGTH, POSITION, TIME, VELOCITY
from pairsim.quantities.scales import Scales
from pairsim.quantities.text import in_unit, with_name
from pairsim.results.columns import column, error_of, suffixes_in
from pairsim.results.scales import scales_in
from pairsim.results.settled import NOTHING, SETTLED, Settled
from pairsim.runtime.arrays import Array

MOST_GAPS = 3  # that have a sentence each


def answer_of_run(series: Mapping[str, Array], record: Mapping[str, Any]) -> list[str]:
    """The answer of a run in time: of series.csv and run.json."""
    gaps = suffixes_in(series, "d")
    lines, scales = _train(series, gaps, record) if len(gaps) > MOST_GAPS else [], scales_in(record)
    least = int(np.argmin([series[f"d{gap}"][-1] for gap in gaps])) if gaps else 0
    closed = least if record.get("reason") == "contact" else None
    if gaps and record.get("hold"):
        now = in_unit(scales, TIME, series["t"][-1])
        for gap in gaps:
            held = in_unit(scales, LENGTH, series[f"d{gap}"][0], digits=4)
            velocity = in_unit(scales, VELOCITY, *_last_dU(series, gap, None), "+")
            lines.append(f"With d{gap} = {held} held, dU{gap} is {velocity} at t = {now}.")
        return [*lines, *_bridges(series, scales), *shapes_in(series, -1, "at the end")]
    for i, gap in enumerate(gaps if len(gaps) <= MOST_GAPS else []):
        who = "The pair" if len(gaps) == 1 else f"Gap {i + 1}"
        d, settled = series[f"d{gap}"], Settled.of(record, i)
        dU, error = _last_dU(series, gap, settled)
        way = _tube(series, i, scales)
        lines.append(f"{who} {_motion(series['t'], d, way, dU, error, settled, record, closed == i)}")
    if gaps and (message := record.get(SETTLED, {}).get("message")):
        lines.append(f"Whether the start is forgotten is not known: {message}.")
    if not gaps:
        names = [*(f"U{each}" for each in suffixes_in(series, "U"))] or ["dp"]
        values = (f"{name} = {in_unit(scales, column(name).unit, series[name][-1], digits=6)}" for name in names)
        lines.append(f"At t = {in_unit(scales, TIME, series['t'][-1])}: {', '.join(values)}.")
    return [*lines, *_bridges(series, scales), *shapes_in(series, -1, "at the end")]


def _bridges(series: Mapping[str, Array], scales: Scales | None) -> list[str]:
    """Where the liquid between particles does not yield at the end."""
    return [
        f"At the end nothing yields along d{gap} within {in_unit(scales, LENGTH, radius, digits=2)} of the axis."
        for gap in suffixes_in(series, "bridge")
        if (radius := float(series[f"bridge{gap}"][-1]))
    ]


def _train(series: Mapping[str, Array], gaps: Sequence[str], record: Mapping[str, Any]) -> list[str]:
    """What the gaps of many particles do: how many separate and come closer, their mean, and the extreme ones."""
    signs = []
    for i, gap in enumerate(gaps):
        settled = Settled.of(record, i)
        signs.append(_sign(settled.dU, settled.error) if settled else _sign(*_last_dU(series, gap, None)))
    scales = scales_in(record)
    moment = f"at t = {in_unit(scales, TIME, series['t'][-1])}"
    when = moment + _tube(series, len(gaps) // 2, scales)
    if Settled.of(record, 0) is not None:
        when = f"at the distances of {when.removeprefix('at ')}, once the start is forgotten"
    elif _starting_up(record):
        when = f"{when}, before the start is known to be forgotten"
    words = {1: "separating", -1: "coming closer", 0: "not decided (their intervals of dU hold both signs)"}
    counted = ", ".join(f"{signs.count(sign)} {what}" for sign, what in words.items() if sign in signs)
    first, last = (np.array([series[f"d{gap}"][at] for gap in gaps]) for at in (0, -1))
    low, high = int(np.argmin(last)), int(np.argmax(last))

    def said(d: float) -> str:
        return in_unit(scales, LENGTH, d, digits=5)

    return [
        *(
            [f"Gap {low + 1} collides {moment}{_tube(series, low, scales)}."]
            if record.get("reason") == "contact"
            else []
        ),
        f"Of {len(gaps)} gaps {when}: {counted}.",
        f"Their mean went from {said(first.mean())} to {said(last.mean())}, their standard deviation from "
        f"{said(first.std())} to {said(last.std())}; the smallest is gap {low + 1}, {said(last[low])}, the largest gap "
        f"{high + 1}, {said(last[high])}.",
    ]


def _tube(series: Mapping[str, Array], gap: int, scales: Scales | None) -> str:
    """The length of tube that the middle of a gap has moved by, after a comma; empty for tables without positions."""
    ends = suffixes_in(series, "z")[gap : gap + 2]
    if not ends:
        return ""
    z = np.mean([series[f"z{end}"] for end in ends], axis=0)
    return f", {with_name(scales, POSITION, float(z[-1] - z[0]))} of tube later"


def _last_dU(series: Mapping[str, Array], gap: str, settled: Settled | None) -> tuple[float, float | None]:
    """dU of a gap in the last row, and the half-width of its interval.

    Where the run has not estimated it, it is that of quasi-steady motion on the same cells, once the start-up has
    decayed; None before.
    """
    dU, errors = float(series[f"dU{gap}"][-1]), series.get(error_of(f"dU{gap}"))
    if errors is not None:
        return dU, float(errors[-1])
    known = settled is not None and abs(settled.dU) > NOTHING and settled.decayed(float(series["t"][-1]), dU, None)
    return dU, settled.own(None) if settled is not None and known else None


def _motion(
    t: Array,
    d: Array,
    tube: str,
    dU: float,
    error: float | None,
    settled: Settled | None,
    record: Mapping[str, Any],
    closed: bool,
) -> str:
    """What a gap does, and its way: a sentence or two without their subject."""
    scales = scales_in(record)

    def velocity(value: float, half_width: float | None) -> str:
        return in_unit(scales, VELOCITY, value, half_width, "+")

    places = [f"d = {in_unit(scales, LENGTH, d[i], digits=5)} at t = {in_unit(scales, TIME, t[i])}" for i in (0, -1)]
    way, now = f"from {places[0]} to {places[1]}{tube}", f"dU = {velocity(dU, error)} at the end"
    if closed:
        return f"collides: {way}, {now}."
    if settled is None:
        if _starting_up(record):
            return f"moved {way}, {now}; what it does once its start is forgotten is not known yet."
        sign = _sign(dU, error)
        turned = sign != 0 and np.sign(d[-1] - d[0]) == -sign
        return f"{_moves(sign, dU)}{' in the end, after moving the other way' if turned else ''}: {way}, {now}."
    if settled.held_together:
        return f"comes to be held together by unyielded liquid: {way}, {now}."
    sign, later = _sign(settled.dU, settled.error), velocity(settled.dU, settled.error)
    without_start = f"Without any memory of its start it would have dU = {later} there (a quasi-steady solution)"
    if settled.decayed(float(t[-1]), dU, error):
        sign = sign if sign * dU >= 0 else 0
        turned = sign != 0 and np.sign(d[-1] - d[0]) == -sign
        other = f" While it started up it {'came closer' if sign > 0 else 'moved apart'}." if turned else ""
        steady = f" {without_start}." if abs(settled.dU) > NOTHING else ""
        return f"{_moves(sign, settled.dU)}: {way}, {now}.{steady}{other}"
    if settled.creeps:
        return (
            f"moved {way}, {now}; unyielded liquid keeps its start: that would decay by creep of the regularisation "
            f"alone (t_relax = {in_unit(scales, TIME, settled.t_relax, digits=2)}, which grows as m)."
        )
    end = settled.end_needed(float(t[-1]), dU, error)
    enough = f"time.end = {end:g}" if scales is None else f"physical.end = {in_unit(scales, TIME, end)}"
    then = f"it then {_moves(sign, settled.dU)} ({enough} is enough)"
    return f"is still starting up: {way}, {now}. {without_start}: {then}."


def _starting_up(record: Mapping[str, Any]) -> bool:
    """Whether a run from rest ended before it was judged if its start-up has decayed."""
    return record.get("start") != "steady" and record.get("status") in ("running", "interrupted", "failed")


def _sign(dU: float, error: float | None) -> int:
    """Sign of a velocity, 0 where its interval holds both."""
    return 0 if abs(dU) <= max(error or 0.0, NOTHING) else int(np.sign(dU))


def _moves(sign: int, dU: float) -> str:
    """One of the three answers for a sign of dU; particles with dU = 0 keep their distance."""
    undecided = "may separate or come closer (not decided: the interval of dU holds both signs)"
    return {1: "separates", -1: "comes closer"}.get(sign, undecided if abs(dU) > NOTHING else "keeps its distance")
