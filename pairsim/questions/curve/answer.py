"""The answer of a master curve in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from pairsim.computing.answer import shapes_in
from pairsim.results import curve_table as in_tables
from pairsim.results.columns import (
    suffixes_in,
)
from pairsim.results.curve_table import forgotten_at, peak_of, regions_of
from pairsim.results.units import LENGTH, VELOCITY, in_unit, scales_in, with_error
from pairsim.runtime.arrays import Array
from pairsim.solvers.curves.interpolant import Region

FAR = 1.2  # ratio of distances from which on it is told where a start is forgotten; chosen


def answer_of_curve(
    table: Mapping[str, Array], zeros: Sequence[in_tables.Zero], record: Mapping[str, Any]
) -> list[str]:
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
        if not math.isfinite(peak.error):
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


def _motion_over_d(regions: Sequence[Region], zeros: Sequence[in_tables.Zero]) -> str:
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


def _starts(table: Mapping[str, Array]) -> list[str]:
    """From where on pairs that start at an end of the curve and move along it are on the curve, if that is far."""
    lines = []
    for end, sign in ((0, 1), (-1, -1)):
        d, dU, held = (float(table[name][end]) for name in ("d", "dU", "dU_held"))
        there = forgotten_at(table, d) if dU * sign > 0 else None
        if there is None or 1 / FAR < there / d < FAR:
            continue
        known = f"follows this curve from d = {there:.3g} on" if math.isfinite(there) else "does not follow this curve"
        change = f"{100 * abs(held / dU - 1):.2g} % {'more' if held / dU > 1 else 'less'}"
        lines.append(
            f"A pair that starts at d = {d:.4g} {known}, when it has forgotten its start; at first, dU depends on that "
            f"(with the shapes of a held distance: {change})."
        )
    return lines
