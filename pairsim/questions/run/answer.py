"""The answer of a run in words: what a pair does once the start-up has decayed, and whether it has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pairsim.computing.answer import shapes_in
from pairsim.results.columns import error_of, suffixes_in
from pairsim.results.settled import NOTHING, SETTLED, Settled
from pairsim.results.units import LENGTH, TIME, VELOCITY, in_unit, scales_in, with_error
from pairsim.runtime.arrays import Array

MOST_GAPS = 3  # that have a sentence each


def answer_of_run(series: Mapping[str, Array], record: Mapping[str, Any]) -> list[str]:
    """The answer of a run in time.

    Args:
        series: Columns of series.csv.
        record: run.json.
    """
    gaps = suffixes_in(series, "d")
    lines, scales = _train(series, gaps, record) if len(gaps) > MOST_GAPS else [], scales_in(record)
    for i, gap in enumerate(gaps if len(gaps) <= MOST_GAPS else []):
        who = "The pair" if len(gaps) == 1 else f"Gap {i + 1}"
        d, (dU, error), settled = series[f"d{gap}"], _last_dU(series, gap), Settled.of(record, i)
        lines.append(f"{who} {_motion(series['t'], d, dU, error, settled, record)}")
        if scales is not None:
            first, last = (f"{each:.5g} um" for each in d[[0, -1]] * LENGTH.factor(scales))
            took, speed = (
                in_unit(scales, TIME, series["t"][-1] - series["t"][0]),
                in_unit(scales, VELOCITY, dU, error, "+"),
            )
            lines.append(f"In physical units: from d = {first} to {last} in {took}, dU = {speed} at the end.")
    if gaps and (message := record.get(SETTLED, {}).get("message")):
        lines.append(f"Whether the start-up has decayed is not known: {message}.")
    if not gaps:
        velocities = ", ".join(f"U{each} = {series[f'U{each}'][-1]:.6g}" for each in suffixes_in(series, "U"))
        lines.append(f"At t = {series['t'][-1]:.4g}: {velocities or f'dp = {series["dp"][-1]:.6g}'}.")
    return [*lines, *shapes_in(series, -1, "at the end")]


def _train(series: Mapping[str, Array], gaps: Sequence[str], record: Mapping[str, Any]) -> list[str]:
    """What the gaps of many particles do: how many separate and come closer, their mean, and the extreme ones."""
    signs = []
    for i, gap in enumerate(gaps):
        settled = Settled.of(record, i)
        signs.append(_sign(settled.dU, settled.error) if settled else _sign(*_last_dU(series, gap)))
    when = f"at t = {series['t'][-1]:.4g}"
    if Settled.of(record, 0) is not None:
        when = f"at the distances of t = {series['t'][-1]:.4g}, once the start-up has decayed"
    words = {1: "separating", -1: "coming closer", 0: "not decided (their intervals of dU hold both signs)"}
    counted = ", ".join(f"{signs.count(sign)} {what}" for sign, what in words.items() if sign in signs)
    first, last = (np.array([series[f"d{gap}"][at] for gap in gaps]) for at in (0, -1))
    scales, (low, high) = scales_in(record), (int(np.argmin(last)), int(np.argmax(last)))

    def said(d: float) -> str:
        return f"{d * LENGTH.factor(scales):.5g}{' um' if scales else ''}"

    return [
        *([f"Gap {low + 1} collides."] if record.get("reason") == "contact" else []),
        f"Of {len(gaps)} gaps {when}: {counted}.",
        f"Their mean went from {said(first.mean())} to {said(last.mean())}, their standard deviation from "
        f"{said(first.std())} to {said(last.std())}; the smallest is gap {low + 1}, {said(last[low])}, the largest gap "
        f"{high + 1}, {said(last[high])}.",
    ]


def _last_dU(series: Mapping[str, Array], gap: str) -> tuple[float, float | None]:
    """dU of a gap in the last row, and the half-width of its interval, None if it was not estimated."""
    error = series.get(error_of(f"dU{gap}"))
    return float(series[f"dU{gap}"][-1]), None if error is None else float(error[-1])


def _motion(
    t: Array, d: Array, dU: float, error: float | None, settled: Settled | None, record: Mapping[str, Any]
) -> str:
    """What a gap does, and its way: a sentence or two without their subject."""
    way = f"from d = {d[0]:.5g} at t = {t[0]:.3g} to d = {d[-1]:.5g} at t = {t[-1]:.4g}"
    now = f"dU = {with_error(dU, error, '+')} at the end"
    if record.get("reason") == "contact":
        return f"collides: {way}, {now}."
    if settled is None:
        sign = _sign(dU, error)
        turned = sign != 0 and np.sign(d[-1] - d[0]) == -sign
        return f"{_moves(sign, dU)}{' in the end, after moving the other way' if turned else ''}: {way}, {now}."
    sign, later = _sign(settled.dU, settled.error), with_error(settled.dU, settled.error, "+")
    if settled.decayed(float(t[-1]), dU, error):
        sign = sign if sign * dU >= 0 else 0
        turned = sign != 0 and np.sign(d[-1] - d[0]) == -sign
        other = f" While it started up it {'came closer' if sign > 0 else 'moved apart'}." if turned else ""
        steady = f", {later} in quasi-steady motion there" if abs(settled.dU) > NOTHING else ""
        return f"{_moves(sign, settled.dU)}: {way}, {now}{steady}.{other}"
    end = settled.end_needed(float(t[-1]), dU, error)
    then = f"{later} once the start-up has decayed: it then {_moves(sign, settled.dU)}"
    return f"is still starting up: {way}, {now}, {then} (time.end = {end:g} would do)."


def _sign(dU: float, error: float | None) -> int:
    """Sign of a velocity, 0 where its interval holds both."""
    return 0 if abs(dU) <= max(error or 0.0, NOTHING) else int(np.sign(dU))


def _moves(sign: int, dU: float) -> str:
    """One of the three answers for a sign of dU; particles with dU = 0 keep their distance."""
    undecided = "may separate or come closer (not decided: the interval of dU holds both signs)"
    return {1: "separates", -1: "comes closer"}.get(sign, undecided if abs(dU) > NOTHING else "keeps its distance")
