"""The answer of a run in words: what a pair does once the start-up has decayed, and whether it has."""

from __future__ import annotations

import numpy as np

from pairsim.analysis.quasi_steady_limit import NOTHING, Settled
from pairsim.analysis.taylor_parameters import shapes_in
from pairsim.analysis.time_series import Series
from pairsim.quantities.kinds import LENGTH, POSITION, TIME, VELOCITY
from pairsim.quantities.text import in_unit, with_name
from pairsim.questions.run.cycles_answer import answer_of_cycles
from pairsim.record.columns import DP, U

MOST_GAPS = 3  # largest number of gaps that have a sentence each


def answer_of_run(series: Series) -> list[str]:
    """The answer of a run in time."""
    if series.gaps and (cycles := series.cycles) is not None:
        return answer_of_cycles(series, cycles)
    gaps, scales = series.gaps, series.scales
    at_end = [*_bridges(series), *shapes_in(series.table, -1, "at the end")]
    if gaps and series.held:
        return [*(_train(series) if len(gaps) > MOST_GAPS else []), *_held(series), *at_end]
    if len(gaps) > MOST_GAPS:
        lines = _train(series)
    else:
        lines = [f"{'The pair' if len(gaps) == 1 else f'Gap {i + 1}'} {_motion(series, i)}" for i in range(len(gaps))]
    if gaps and (message := series.why_not_settled):
        lines.append(f"Whether the start is forgotten is not known: {message}.")
    if not gaps:
        table, unit = series.table, U.unit if series.table.suffixes(U) else DP.unit
        values = table.each(U) or {DP.name: table[DP]}
        said = (f"{name} = {in_unit(scales, unit, each[-1], digits=6)}" for name, each in values.items())
        lines.append(f"At t = {in_unit(scales, TIME, series.t[-1])}: {', '.join(said)}.")
    return [*lines, *at_end]


def _held(series: Series) -> list[str]:
    """The velocities of particles whose distances are held."""
    scales, lines = series.scales, []
    now = in_unit(scales, TIME, series.t[-1])
    for gap in series.gaps:
        held = in_unit(scales, LENGTH, series.d(gap)[0], digits=4)
        velocity = in_unit(scales, VELOCITY, *series.last_dU(gap, None), "+")
        lines.append(f"With d{gap} = {held} held, dU{gap} is {velocity} at t = {now}.")
    return lines


def _bridges(series: Series) -> list[str]:
    """Where the liquid between particles does not yield at the end."""
    return [
        f"At the end no liquid yields along d{gap} within {in_unit(series.scales, LENGTH, radius, digits=2)} of the "
        "axis."
        for gap, radius in series.bridges.items()
        if radius
    ]


def _train(series: Series) -> list[str]:
    """How the gaps of many particles change: how many separate and come closer, their mean, and the extreme ones."""
    signs, gaps, scales = [], series.gaps, series.scales
    for i, gap in enumerate(gaps):
        settled = series.settled(i)
        signs.append(_sign(settled.dU, settled.error) if settled else _sign(*series.last_dU(gap, None)))
    moment = f"at t = {in_unit(scales, TIME, series.t[-1])}"
    when = moment + _tube(series, len(gaps) // 2)
    if series.settled(0) is not None:
        when = f"at the distances of {when.removeprefix('at ')}, once the start is forgotten"
    elif series.starting_up:
        when = f"{when}, before the start is known to be forgotten"
    words = {1: "separating", -1: "coming closer", 0: "not decided (their intervals of dU contain both signs)"}
    counted = ", ".join(f"{signs.count(sign)} {what}" for sign, what in words.items() if sign in signs)
    first, last = (series.distances_at(row) for row in (0, -1))
    low, high = int(np.argmin(last)), int(np.argmax(last))

    def said(d: float) -> str:
        return in_unit(scales, LENGTH, d, digits=5)

    closes = [f"Gap {low + 1} collides {moment}{_tube(series, low)}."] if series.closed is not None else []
    return [
        *closes,
        f"Of {len(gaps)} gaps {when}: {counted}.",
        f"Their mean went from {said(first.mean())} to {said(last.mean())}, their standard deviation from "
        f"{said(first.std())} to {said(last.std())}; the smallest is gap {low + 1}, {said(last[low])}, the largest gap "
        f"{high + 1}, {said(last[high])}.",
    ]


def _tube(series: Series, gap: int) -> str:
    """The length of tube that the middle of a gap has moved by, after a comma; empty where it is not known."""
    moved = series.moved(gap)
    return "" if moved is None else f", {with_name(series.scales, POSITION, moved)} of tube later"


def _motion(series: Series, i: int) -> str:
    """How gap `i`, counted from 0, changes, and from where to where: a sentence or two without their subject."""
    scales, gap, settled, t = series.scales, series.gaps[i], series.settled(i), series.t
    d, (dU, error) = series.d(gap), series.last_dU(gap, settled)
    tube = _tube(series, i)

    def velocity(value: float, half_width: float | None) -> str:
        return in_unit(scales, VELOCITY, value, half_width, "+")

    places = [f"d = {in_unit(scales, LENGTH, d[i], digits=5)} at t = {in_unit(scales, TIME, t[i])}" for i in (0, -1)]
    way, now = f"from {places[0]} to {places[1]}{tube}", f"dU = {velocity(dU, error)} at the end"
    if series.closed == i:
        return f"collides: {way}, {now}."
    if settled is None:
        if series.starting_up:
            return f"moved {way}, {now}; what it does once its start is forgotten is not known yet."
        sign = _sign(dU, error)
        turned = sign != 0 and np.sign(d[-1] - d[0]) == -sign
        return f"{_moves(sign, dU)}{' in the end, after moving the other way' if turned else ''}: {way}, {now}."
    return _once_settled(series, settled, (dU, error), f"{way}, {now}", float(d[-1] - d[0]))


def _once_settled(series: Series, settled: Settled, last: tuple[float, float | None], moved: str, by: float) -> str:
    """How a gap changes whose quasi-steady motion is known: a sentence or two without their subject.

    Args:
        series: The run.
        settled: The quasi-steady solution at the last distances.
        last: dU at the end of the run and its half-width [U_av], None if that is not known.
        moved: From where to where the gap has moved, in words.
        by: The change of its distance [D_c].
    """
    scales, (dU, error), t = series.scales, last, float(series.t[-1])
    if settled.arrested:
        return f"comes to be held together by unyielded liquid: {moved}."
    sign, later = _sign(settled.dU, settled.error), in_unit(scales, VELOCITY, settled.dU, settled.error, "+")
    without_start = f"Without any memory of its start it would have dU = {later} there (a quasi-steady solution)"
    if settled.decayed(t, dU, error):
        sign = sign if sign * dU >= 0 else 0
        turned = sign != 0 and np.sign(by) == -sign
        other = f" During start-up it {'came closer' if sign > 0 else 'moved apart'}." if turned else ""
        steady = f" {without_start}." if abs(settled.dU) > NOTHING else ""
        return f"{_moves(sign, settled.dU)}: {moved}.{steady}{other}"
    if settled.creeps:
        return (
            f"moved {moved}; unyielded liquid remembers the start: this decays only by creep due to the regularisation "
            f"(t_relax = {in_unit(scales, TIME, settled.t_relax, digits=2)}, which grows as m)."
        )
    end = settled.end_needed(t, dU, error)
    enough = f"time.end = {end:g}" if scales is None else f"physical.end = {in_unit(scales, TIME, end)}"
    then = f"it then {_moves(sign, settled.dU)} ({enough} is enough)"
    return f"is still starting up: {moved}. {without_start}: {then}."


def _sign(dU: float, error: float | None) -> int:
    """Sign of a velocity, 0 where its interval holds both."""
    return 0 if abs(dU) <= max(error or 0.0, NOTHING) else int(np.sign(dU))


def _moves(sign: int, dU: float) -> str:
    """The verb for a sign of dU, which is 0 if it is not certain; particles with dU = 0 keep their distance."""
    undecided = "may separate or come closer (not decided: the interval of dU contains both signs)"
    return {1: "separates", -1: "comes closer"}.get(sign, undecided if abs(dU) > NOTHING else "keeps its distance")
