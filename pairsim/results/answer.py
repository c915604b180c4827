"""The answer of a folder of results in words: do the particles separate, collide or rest, how fast, and what next."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.results.columns import error_column, relative_velocities
from pairsim.runtime.arrays import Array
from pairsim.runtime.duration import duration

Table = Mapping[str, Array]


@dataclass(frozen=True)
class Zero:
    """A distance at which dU vanishes, with its error where it is known, and whether it is stable."""

    d: float
    stable: bool
    error: float | None = None

    def __str__(self) -> str:
        kind = "stable" if self.stable else "unstable"
        return f"{with_error(self.d, self.error)} ({kind})"


def with_error(value: float, error: float | None, sign: str = "") -> str:
    """A number with its error: (1.567 +- 0.004)e-3.

    Args:
        value: The number.
        error: Half-width of its interval, shown to one digit (two where it begins with 1). None: the number is shown to
            four digits.
        sign: "+" shows the sign of positive numbers, too.
    """
    if error is None or not np.isfinite(error) or error <= 0:
        return f"{value:{sign}.4g}"
    exponent = int(np.floor(np.log10(max(abs(value), error))))
    scale = 1.0 if -2 <= exponent < 4 else 10.0**exponent
    digits = -int(np.floor(np.log10(error / scale)))
    digits += round(error / scale * 10.0**digits) == 1  # two digits of an error that begins with 1
    digits = max(digits, 0)
    text = f"{value / scale:{sign}.{digits}f} +- {error / scale:.{digits}f}"
    return text if scale == 1.0 else f"({text})e{exponent}"


def answer_of_run(series: Table, record: Mapping[str, Any]) -> list[str]:
    """The answer of a run in time.

    Args:
        series: Columns of series.csv.
        record: run.json.
    """
    gaps = [name for name in series if name == "d" or name.startswith("d_")]
    lines = []
    for name in gaps:
        ending = name.removeprefix("d")
        d, dU = series[name], series[f"dU{ending}"]
        column = error_column(series, ending)
        error = float(series[column][-1]) if column is not None else None
        who = "The pair" if len(gaps) == 1 else f"Gap {ending.removeprefix('_')}"
        way = f"from d = {d[0]:.5g} at t = {series['t'][0]:.3g} to d = {d[-1]:.5g} at t = {series['t'][-1]:.4g}"
        lines.append(f"{who} {_motion(d, dU, error, record)}: {way}, dU = {with_error(dU[-1], error, '+')} at the end.")
        if (scales := _Scales.of(record)) is not None:
            way = f"from d = {scales.um(d[0]):.5g} um to {scales.um(d[-1]):.5g} um in {scales.s(series['t'][-1]):.4g} s"
            lines.append(f"In physical units: {way}, dU = {scales.um_per_s(dU[-1], error)} um/s at the end.")
    if not gaps:
        velocities = ", ".join(f"{name} = {series[name][-1]:.6g}" for name in series if name.startswith("U_"))
        lines.append(f"At t = {series['t'][-1]:.4g}: {velocities or f'dp = {series["dp"][-1]:.6g}'}.")
    return [*lines, *_shapes(series, -1, "at the end")]


@dataclass(frozen=True)
class _Scales:
    """The scales of a case with a `physical` block, which convert to the units of the answer.

    Attributes:
        length: D_c [m].
        velocity: U_av [m/s].
        time: D_c/U_av [s].
    """

    length: float
    velocity: float
    time: float

    @classmethod
    def of(cls, record: Mapping[str, Any]) -> _Scales | None:
        """The scales in run.json, None if the case has no `physical` block."""
        scales = record.get("scales")
        return cls(scales["length"], scales["velocity"], scales["time"]) if scales is not None else None

    def um(self, d: float) -> float:
        """A length in micrometres."""
        return 1e6 * self.length * d

    def s(self, t: float) -> float:
        """A time in seconds."""
        return self.time * t

    def um_per_s(self, U: float, error: float | None) -> str:
        """A velocity with its error in micrometres per second."""
        scale = 1e6 * self.velocity
        return with_error(scale * U, None if error is None else scale * error, "+")

    def zero(self, zero: Zero) -> str:
        """A zero of dU with its error in micrometres."""
        return with_error(self.um(zero.d), None if zero.error is None else self.um(zero.error))


def _motion(d: Array, dU: Array, error: float | None, record: Mapping[str, Any]) -> str:
    """What a pair does, in a word or two."""
    if record.get("reason") == "contact":
        return "collides"
    if abs(dU[-1]) <= max(error or 0.0, 1e-9):
        return "rests: dU vanishes within its error"
    now = "separates" if dU[-1] > 0 else "comes closer"
    turned = len(dU) > 1 and np.sign(d[-1] - d[0]) != np.sign(dU[-1])
    return f"{now} in the end, after moving the other way" if turned else now


def answer_of_curve(table: Table, zeros: Sequence[Zero], record: Mapping[str, Any]) -> list[str]:
    """The answer of a master curve.

    Args:
        table: Columns of curve.csv.
        zeros: Zeros of dU, in ascending distance.
        record: run.json.
    """
    gaps = [name for name in table if name == "d" or name.startswith("d_")]
    if not gaps:
        velocities = ", ".join(f"{name} = {table[name][0]:.6g}" for name in table if re.fullmatch(r"U_\d+", name))
        forces = [name for name in table if re.fullmatch(r"F_\d+", name)]
        moved = [f"{name} = {with_error(table[name][0], table[f'F_error{name[1:]}'][0])}" for name in forces]
        return [f"{', '.join([velocities, *moved])}.", *_shapes(table, 0, "")]
    lines = []
    scales = _Scales.of(record)
    if "dU" in table:
        lines.append(_regions(table["d"], table["dU"], zeros))
        if scales is not None and zeros:
            lines.append(f"In physical units: it keeps its distance at d = {', '.join(map(scales.zero, zeros))} um.")
    for name in relative_velocities(table):
        ending = name.removeprefix("dU")
        largest = int(np.argmax(np.abs(table[name])))
        column = error_column(table, ending)
        error = float(table[column][largest]) if column is not None else None
        place = table.get(f"d{ending}", table[gaps[0]])[largest]
        lines.append(f"Largest |dU{ending}|: {with_error(table[name][largest], error, '+')} at d = {place:.4g}.")
        if scales is not None:
            velocity = scales.um_per_s(table[name][largest], error)
            lines.append(f"In physical units: {velocity} um/s at d = {scales.um(place):.4g} um.")
    shapes = [name for name in table if name.startswith("D_")]
    ranges = ", ".join(f"{name} from {table[name].min():.3g} to {table[name].max():.3g}" for name in shapes)
    return [*lines, f"Taylor parameters: {ranges}."] if ranges else lines


def _regions(d: Array, dU: Array, zeros: Sequence[Zero]) -> str:
    """Where a pair separates and where it comes closer."""
    places = [d[0], *(zero.d for zero in zeros), d[-1]]
    if np.abs(dU).max() < 1e-9:
        return f"The pair keeps its distance: dU vanishes between d = {d[0]:.4g} and {d[-1]:.4g}."
    parts = []
    for i, (start, stop) in enumerate(pairwise(places)):
        inside = dU[(d >= start) & (d <= stop)]
        if i < len(zeros):
            rising = not zeros[i].stable
            separates = not rising
        else:
            separates = not zeros[-1].stable if zeros else bool(inside[np.argmax(np.abs(inside))] > 0)
        parts.append(f"{'separates' if separates else 'comes closer'} between d = {start:.4g} and {stop:.4g}")
    text = f"The pair {', '.join(parts)}."
    return f"{text} It keeps its distance at d = {', '.join(map(str, zeros))}." if zeros else text


def answer_of_critical(zeros: Sequence[Zero], record: Mapping[str, Any]) -> list[str]:
    """The answer of a search for critical distances."""
    if not zeros:
        return ["No critical distance was found in the given range: dU keeps its sign."]
    lines = []
    scales = _Scales.of(record)
    for stable, meaning in ((False, "closer pairs come together, wider ones separate"), (True, "pairs come to rest")):
        found = [zero.d for zero in zeros if zero.stable == stable]
        if found:
            kind = "stable" if stable else "unstable"
            where = f"d = {min(found):.4g} to {max(found):.4g}" if len(found) > 1 else f"d = {found[0]:.4g}"
            if scales is not None:
                extent = dict.fromkeys(f"{scales.um(d):.4g}" for d in (min(found), max(found)))
                where += f" ({' to '.join(extent)} um)"
            lines.append(f"{len(found)} {kind} critical distance{'s' * (len(found) > 1)}, {where}: {meaning}.")
    ends = [str(end["message"]) for end in record.get("ends", ()) if end.get("message")]
    return [*lines, *(f"A branch ends: {message}." for message in ends)]


def _shapes(table: Table, row: int, when: str) -> list[str]:
    """The Taylor parameters in a row."""
    shapes = ", ".join(f"{name} = {table[name][row]:.3g}" for name in table if name.startswith("D_"))
    return [f"Taylor parameters{f' {when}' if when else ''}: {shapes}."] if shapes else []


def cost_line(record: Mapping[str, Any]) -> str:
    """Wall time and work of a command."""
    parts = [f"{record[key]} {what}" for key, what in (("steps", "steps"), ("points", "points")) if key in record]
    parts += [f"{record['unknowns']:,} unknowns"] if "unknowns" in record else []
    return f"Took {duration(float(record.get('wall_time', 0.0)))}" + (f" ({', '.join(parts)})." if parts else ".")


CASE_NOT_AT_FAULT = ("interrupted", "write_failed", "environment")  # reasons for which the same command may succeed
LIMITS = ("wall_time", "max_steps")  # reasons that are keys of `limits` as well


def advice(kind: str, status: str, reason: str, message: str, directory: Path, pair: bool) -> str:
    """What to do next.

    Args:
        kind: The command: run, curve or critical.
        status: How it ended, as in run.json.
        reason: Why.
        message: The same in words, with what a failure advises to try.
        directory: The folder of its results.
        pair: Whether the result tells how fast a pair moves apart.
    """
    if status == "finished":
        more = {
            "run": f"pairsim plot {directory} draws it; pairsim run --resume {directory} --set time.end=... continues",
            "curve": f"pairsim travel {directory} --from D --to D gives the time and tube that a pair needs"
            if pair
            else f"pairsim plot {directory} draws it again",
            "critical": f"pairsim plot {directory} draws it again",
        }
        return f"Next: {more[kind]}."
    if reason in LIMITS:
        return f"Next: pairsim run --resume {directory} --set limits.{reason}=... continues from the last checkpoint."
    if reason not in CASE_NOT_AT_FAULT:
        _, found, remedy = message.rpartition("; try ")
        change = f"try {remedy}; " if found else ""
        return f"Next: {change}unchanged, the case fails in the same way. What was written stands."
    if kind == "run":
        return f"Next: pairsim run --resume {directory} continues from the last checkpoint."
    return "Next: the same command with --overwrite computes it again; what was written stands until then."
