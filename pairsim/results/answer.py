"""The answer of a folder of results in words: do the particles separate, collide or rest, how fast, and what next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.results.columns import LENGTH, VELOCITY, suffixes_in
from pairsim.results.curve_table import peak_of, regions_of
from pairsim.results.memory import forgotten_at
from pairsim.results.output import WAY
from pairsim.results.units import in_unit, scales_in, with_error
from pairsim.runtime.arrays import Array
from pairsim.runtime.duration import duration
from pairsim.runtime.errors import BranchEnd
from pairsim.solvers.curves.interpolant import Region

Table = Mapping[str, Array]
MOST_SHAPES = 4  # that are all told
FAR = 1.2  # ratio of distances from which on it is told where a start is forgotten; chosen


@dataclass(frozen=True)
class Zero:
    """A distance at which dU vanishes, with its error where it is known, and whether it is stable."""

    d: float
    stable: bool
    error: float | None = None

    def __str__(self) -> str:
        kind = "stable" if self.stable else "unstable"
        return f"{with_error(self.d, self.error)} ({kind})"


def zeros_in(table: Table, name: str = "d") -> list[Zero]:
    """The zeros in a table, whose distances are in the column `name`."""
    errors = [float(each) if np.isfinite(each) else None for each in table.get("d_error", ())]
    found = table.get(name, ()), table.get("stable", ()), errors or [None] * len(table.get(name, ()))
    return [Zero(float(d), bool(stable), error) for d, stable, error in zip(*found, strict=True)]


def answer_of_curve(table: Table, zeros: Sequence[Zero], record: Mapping[str, Any]) -> list[str]:
    """The answer of a master curve.

    Args:
        table: Columns of curve.csv.
        zeros: Zeros of dU, in ascending distance.
        record: run.json.
    """
    gaps = suffixes_in(table, "dU")
    if not gaps:
        velocities = [f"U{each} = {table[f'U{each}'][0]:.6g}" for each in suffixes_in(table, "U")]
        forces = suffixes_in(table, "F")
        moved = [f"F{each} = {with_error(table[f'F{each}'][0], table[f'F_error{each}'][0])}" for each in forces]
        return [f"{', '.join([*velocities, *moved])}.", *shapes_in(table, 0, "")]
    lines = []
    scales = scales_in(record)
    if "dU" in table:
        regions = regions_of(table, [zero.d for zero in zeros])
        met = {a.stop for a, b in pairwise(regions) if a.sign * b.sign < 0}
        zeros = [zero for zero in zeros if zero.d in met]
        lines.append(_motion_over_d(regions, zeros))
        if scales is not None and zeros:
            places = ", ".join(in_unit(scales, LENGTH, zero.d, zero.error) for zero in zeros)
            lines.append(f"In physical units: it keeps its distance at d = {places}.")
        lines += _starts(table)
    for gap in gaps:
        name, peak = f"dU{gap}", peak_of(table, gap)
        value, place = with_error(peak.dU, peak.error, "+"), with_error(peak.d, peak.d_error)
        if not np.isfinite(peak.error):
            lines.append(f"Largest |{name}| of two points: {value} at d = {place}; what lies between is not known.")
            continue
        lines.append(f"Largest |{name}|: {value} at d = {place}.")
        if scales is not None:
            value, place = (
                in_unit(scales, VELOCITY, peak.dU, peak.error, "+"),
                in_unit(scales, LENGTH, peak.d, peak.d_error),
            )
            lines.append(f"In physical units: {value} at d = {place}.")
    shapes = {f"D{each}": table[f"D{each}"] for each in suffixes_in(table, "D")}
    ranges = ", ".join(f"{name} from {values.min():.3g} to {values.max():.3g}" for name, values in shapes.items())
    return [*lines, f"Taylor parameters: {ranges}."] if ranges else lines


def _motion_over_d(regions: Sequence[Region], zeros: Sequence[Zero]) -> str:
    """Where a pair separates, where it comes closer, where neither is certain, and where it keeps its distance."""

    def where(region: Region) -> str:
        far = region.stop > region.start
        return f"between d = {region.start:.4g} and {region.stop:.4g}" if far else f"at d = {region.start:.4g}"

    if not regions:
        return "The pair keeps its distance: dU vanishes at every d."
    moves = [f"{'separates' if each.sign > 0 else 'comes closer'} {where(each)}" for each in regions if each.sign]
    sentences = [f"The pair {', '.join(moves)}."] if moves else []
    if open_ones := [where(each) for each in regions if not each.sign]:
        sentences.append(f"Not decided {', '.join(open_ones)}: the interval of dU holds both signs.")
    if zeros:
        sentences.append(f"It keeps its distance at d = {', '.join(map(str, zeros))}.")
    return " ".join(sentences)


def _starts(table: Table) -> list[str]:
    """From where on pairs that start at an end of the curve and move along it are on the curve, if that is far."""
    lines = []
    for end, sign in ((0, 1), (-1, -1)):
        d, dU, held = (float(table[name][end]) for name in ("d", "dU", "dU_held"))
        there = forgotten_at(table, d) if dU * sign > 0 else None
        if there is None or 1 / FAR < there / d < FAR:
            continue
        known = f"follows this curve from d = {there:.3g} on" if np.isfinite(there) else "does not follow this curve"
        change = f"{100 * abs(held / dU - 1):.2g} % {'more' if held / dU > 1 else 'less'}"
        lines.append(
            f"A pair that starts at d = {d:.4g} {known}, when it has forgotten its start; at first, dU depends on that "
            f"(with the shapes of a held distance: {change})."
        )
    return lines


def answer_of_critical(zeros: Sequence[Zero], record: Mapping[str, Any]) -> list[str]:
    """The answer of a search that has found critical distances."""
    lines = []
    scales = scales_in(record)
    for stable, meaning in ((False, "closer pairs come together, wider ones separate"), (True, "pairs come to rest")):
        found = [zero.d for zero in zeros if zero.stable == stable]
        if found:
            kind = "stable" if stable else "unstable"
            where = f"d = {min(found):.4g} to {max(found):.4g}" if len(found) > 1 else f"d = {found[0]:.4g}"
            if scales is not None:
                where += (
                    f" ({' to '.join(dict.fromkeys(in_unit(scales, LENGTH, d) for d in (min(found), max(found))))})"
                )
            lines.append(f"{len(found)} {kind} critical distance{'s' * (len(found) > 1)}, {where}: {meaning}.")
    ends = [str(end["message"]) for end in record.get("ends", ()) if end.get("message")]
    return [*lines, *(f"A branch ends: {message}." for message in ends)]


def shapes_in(table: Table, row: int, when: str) -> list[str]:
    """The Taylor parameters in a row."""
    values = {f"D{each}": float(table[f"D{each}"][row]) for each in suffixes_in(table, "D")}
    said = [f"{name} = {values[name]:.3g}" for name in sorted(values, key=lambda name: values[name])]
    shapes = (
        f"from {said[0]} to {said[-1]}"
        if len(said) > MOST_SHAPES
        else ", ".join(f"{name} = {value:.3g}" for name, value in values.items())
    )
    return [f"Taylor parameters{f' {when}' if when else ''}: {shapes}."] if shapes else []


def cost_line(record: Mapping[str, Any]) -> str:
    """Wall time and work of a command."""
    parts = [f"{record[key]} {what}" for key, what in (("steps", "steps"), ("points", "points")) if key in record]
    parts += [f"{record['unknowns']:,} unknowns"] if "unknowns" in record else []
    return f"Took {duration(float(record.get('wall_time', 0.0)))}" + (f" ({', '.join(parts)})." if parts else ".")


CASE_NOT_AT_FAULT = ("interrupted", "write_failed", "environment")  # reasons for which the same command may succeed
LIMITS = ("wall_time", "max_steps")  # reasons that are keys of `limits` as well


def advice(afterwards: str, status: str, reason: str, message: str, directory: Path, resumable: bool) -> str:
    """What to do next.

    Args:
        afterwards: What may come next where it has finished.
        status: How it ended, as in run.json.
        reason: Why.
        message: The same in words, with what a failure advises to try.
        directory: The folder of its results.
        resumable: Whether the command goes on from a checkpoint.
    """
    if reason == BranchEnd.reason:
        way, drawn = directory / WAY, "and fields.png the last shapes" if (directory / "fields.png").exists() else ""
        known = f"; {way} has the steady states on the way {drawn}".rstrip() if way.exists() else ""
        return f"Next: a smaller Ca_e or De{known}."
    if status == "finished":
        return f"Next: {afterwards}."
    if reason in LIMITS:
        return f"Next: pairsim run --resume {directory} --set limits.{reason}=... continues from the last checkpoint."
    if reason not in CASE_NOT_AT_FAULT:
        _, found, remedy = message.rpartition("; try ")
        change = f"try {remedy}; " if found else ""
        return f"Next: {change}unchanged, the case fails in the same way. What was written stands."
    if resumable:
        return f"Next: pairsim run --resume {directory} continues from the last checkpoint."
    return "Next: the same command with --overwrite computes it again; what was written stands until then."
