"""The answer of a master curve in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from pairsim.cases.inputs import Input
from pairsim.cases.physical import DIFFERENCE
from pairsim.computing.question import shapes_in
from pairsim.quantities.kinds import FORCE, LENGTH, TIME, VELOCITY, Kind
from pairsim.quantities.scales import Scales
from pairsim.quantities.text import in_unit
from pairsim.results import curve_table as in_tables
from pairsim.results.columns import suffixes_in
from pairsim.results.curve_table import forgotten_at, held_regions, peak_of, regions_of
from pairsim.results.inputs import COVERED, DrawnRange, change_by, half_widths_by
from pairsim.results.scales import scales_in
from pairsim.runtime.arrays import Array
from pairsim.solvers.curves.interpolant import Region

SLIGHT = 1e-3  # difference of two diameters, over their mean, that no camera sees
FAR = 1.2  # ratio of distances from which on it is told where a start is forgotten; chosen


def answer_of_curve(
    table: Mapping[str, Array], zeros: Sequence[in_tables.Zero], record: Mapping[str, Any]
) -> list[str]:
    """The answer of a master curve: of curve.csv, zeros of dU in ascending distance, and run.json."""
    gaps, scales = suffixes_in(table, "dU"), scales_in(record)
    if not gaps:
        found = []
        for name, unit in (("U", VELOCITY), ("F", FORCE)):
            for each in suffixes_in(table, name):
                given = name == "U" and f"F{each}" in table  # the velocity of a moved particle
                error = None if given else table[f"{name}_error{each}"][0]
                found.append(f"{name}{each} = {in_unit(scales, unit, table[name + each][0], error)}")
        return [f"{', '.join(found)}.", *shapes_in(table, 0, "")]
    lines = []
    if "dU" in table:
        regions = regions_of(table, [zero.d for zero in zeros])
        met = {a.stop for a, b in pairwise(regions) if a.sign * b.sign < 0}
        zeros = [zero for zero in zeros if zero.d in met]
        held = held_regions(table, regions)
        lines.append(_motion_over_d([each for each in regions if each not in held], zeros, scales, held))
        if "dU_held" in table:
            lines += [*_starts(table, scales), *_held(table, scales), *_with_inputs(table, zeros, record)]
            lines += _of_unequal(table, record)
    if "after" in record:
        lines += [_settling(table, gap, 4 * record["after"], scales) for gap in gaps]
    for gap in gaps:
        name, peak = f"dU{gap}", peak_of(table, gap)
        if not (peak.dU or peak.error):  # exactly zero everywhere, as of rigid particles in an atlas
            continue
        value = in_unit(scales, VELOCITY, peak.dU, peak.error, "+")
        d, place = in_tables.over(table, gap), in_unit(scales, LENGTH, peak.d, peak.d_error)
        ends, d = table.get(d, np.zeros(1))[[0, -1]], "d" if d == f"d{gap}" else d
        if not math.isfinite(peak.error):
            lines.append(f"Largest |{name}| of two points: {value} at {d} = {place}; what lies between is not known.")
            continue
        at_end = ends[0] < ends[1] and peak.d in ends and abs(peak.dU) > peak.error
        beyond = f", the end of this curve; beyond it |{name}| may be larger" if at_end else ""
        lines.append(f"Largest |{name}|: {value} at {d} = {place}{beyond}.")
    shapes = {f"D{each}": table[f"D{each}"] for each in suffixes_in(table, "D")}
    both = {name: (f"{values.min():.3g}", f"{values.max():.3g}") for name, values in shapes.items()}
    ranges = [f"{name} {f'from {a} to {b}' if a != b else f'= {a}'}" for name, (a, b) in both.items()]
    return [*lines, f"Taylor parameters: {', '.join(ranges)}."] if ranges else lines


def _settling(table: Mapping[str, Array], gap: str, end: float, scales: Scales | None) -> str:
    """Which dU of a curve from rest still change by more than their half-widths."""
    change = np.abs(table[f"dU{gap}"] - table[f"dU_half{gap}"])
    places = [in_unit(scales, LENGTH, d) for d in table[f"d{gap}"][change > table[f"dU_error{gap}"]]]
    where = f"at d = {', '.join(places)}: not settled there" if places else "nowhere"
    now, before = (in_unit(scales, TIME, each) for each in (end, end / 2))
    return (
        f"dU{gap} is that from rest at held distances at t = {now}; since t = {before} it has changed by up to "
        f"{in_unit(scales, VELOCITY, float(change.max()))}, by more than its half-width {where}."
    )


def _motion_over_d(
    regions: Sequence[Region], zeros: Sequence[in_tables.Zero], scales: Scales | None, held: Sequence[Region]
) -> str:
    """Where a pair separates, comes closer, keeps its distance, or is held together, and where none is certain."""

    def where(region: Region) -> str:
        start, stop = (in_unit(scales, LENGTH, d) for d in (region.start, region.stop))
        return f"between d = {start} and {stop}" if region.stop > region.start else f"at d = {start}"

    if not regions and not held:
        return "The pair keeps its distance: dU vanishes at every d."
    moves = [f"{'separates' if each.sign > 0 else 'comes closer'} {where(each)}" for each in regions if each.sign]
    sentences = [f"The pair {', '.join(moves)}."] if moves else []
    if held:
        sentences.append(
            f"Unyielded liquid holds it together {', '.join(map(where, held))}: dU vanishes there as 1/m, it is creep "
            "of the regularisation."
        )
    if open_ones := [where(each) for each in regions if not each.sign]:
        sentences.append(f"Not decided {', '.join(open_ones)}: the interval of dU holds both signs.")
    if zeros:
        places = [f"{in_unit(scales, LENGTH, zero.d, zero.error)} ({zero.kind})" for zero in zeros]
        sentences.append(f"It keeps its distance at d = {', '.join(places)}.")
    return " ".join(sentences)


def _with_inputs(table: Mapping[str, Array], zeros: Sequence[in_tables.Zero], record: Mapping[str, Any]) -> list[str]:
    """What the half-widths of the inputs do to dU and its zeros, and the sensitivities at the largest |dU|."""
    scales, inputs = scales_in(record), [Input(**each) for each in record.get("inputs", ())]
    if scales is None or "by_beta" not in table or not table["dU"].any():
        return []
    x, peak, drawn = np.log(table["d"]), peak_of(table), DrawnRange.of(record)
    ranges = _in_draws(drawn, peak.d, zeros, scales) if drawn is not None else []
    changes = [(one, change_by(table, scales, one)) for one in inputs]
    known = [(one, float(np.interp(np.log(peak.d), x, each)) / one.size) for one, each in changes if each is not None]
    each = ", ".join(f"{by:+.3g} per {one.unit} of {one.key}" for one, by in known)
    added = _to_first_order(table, zeros, scales, inputs, drawn)
    return [*ranges, *added, f"At the largest |dU|, dU [{VELOCITY.physical}] changes by {each}."]


def _of_unequal(table: Mapping[str, Array], record: Mapping[str, Any]) -> list[str]:
    """What a difference of the diameters does to dU, where the case says nothing of it."""
    inputs = {each["key"]: each["half_width"] for each in record.get("inputs", ())}
    if "by_difference" not in table or DIFFERENCE.key in inputs:
        return []
    d, scales = peak_of(table).d, scales_in(record)
    change = 0.01 * float(np.interp(np.log(d), np.log(table["d"]), table["by_difference"]))
    key = f" ({DIFFERENCE.key}: 0 +- 1 % puts what is not known of it into the answer)" if scales is not None else ""
    common = ", and the half-width of particle is common to both" if inputs.get("particle") else ""
    return [
        f"The beads are taken to be equally large{common}: for each per cent by which the leading one is larger, dU at "
        f"d = {in_unit(scales, LENGTH, d)} changes by {in_unit(scales, VELOCITY, change, sign='+', digits=3)}{key}."
        f"{_decided_by(table, scales)}"
    ]


def _decided_by(table: Mapping[str, Array], scales: Scales | None) -> str:
    """From which distance on a small difference of the diameters decides whether a pair separates."""
    decides = np.abs(table["dU"]) < SLIGHT * np.abs(table["by_difference"])
    if not decides[-1]:
        return ""
    if decides.all():
        return f" A difference of {100 * SLIGHT:g} % decides at every d whether they separate."
    d = in_unit(scales, LENGTH, float(table["d"][np.flatnonzero(~decides)[-1] + 1]))
    return f" From d = {d} on a difference of {100 * SLIGHT:g} % decides whether they separate."


def _in_draws(drawn: DrawnRange, d: float, zeros: Sequence[in_tables.Zero], scales: Scales) -> list[str]:
    """Where dU at a distance and its zeros are in most draws of the inputs."""
    said = [f"dU at d = {in_unit(scales, LENGTH, d)} is {drawn.words(d)}"]
    for zero in zeros:
        ends = (in_unit(scales, LENGTH, end) for end in drawn.around(zero.d))
        said.append(f"the zero at d = {in_unit(scales, LENGTH, zero.d)} is between {' and '.join(ends)}")
    lines = [f"In {100 * COVERED:g} % of draws of the inputs, {', '.join(said)}."]
    outside = drawn.outside_at(d)
    return [*lines, f"{outside}."] if outside else lines


def _to_first_order(
    table: Mapping[str, Array],
    zeros: Sequence[in_tables.Zero],
    scales: Scales,
    inputs: list[Input],
    drawn: DrawnRange | None,
) -> list[str]:
    """What each half-width of the inputs adds to first order; with draws, of dU alone, to tell the inputs apart."""
    parts, x, peak = half_widths_by(table, scales, inputs), np.log(table["d"]), peak_of(table)
    unknown = " and ".join(key for key, part in parts.items() if not np.isfinite(part).all())
    parts = {key: part for key, part in parts.items() if np.isfinite(part).all()}

    def added(d: float, unit: Kind, steepness: float) -> str:
        """The parts of the inputs at a distance, the largest first, over the steepness of dU."""
        here = {key: float(np.interp(np.log(d), x, part)) / steepness for key, part in parts.items()}
        each = ", ".join(f"{key} {half:.2g}" for key, half in sorted(here.items(), key=lambda item: -item[1]))
        return f"+- {math.hypot(*here.values()):.2g} {unit.physical} ({each})"

    lines = []
    if parts and drawn is None:
        said = [f"{added(peak.d, VELOCITY, 1.0)} to the largest |dU|"]
        for zero in zeros:
            slope = abs(float(np.interp(np.log(zero.d), x, table["slope"]))) * VELOCITY.factor(scales)
            at_zero = added(zero.d, LENGTH, slope / LENGTH.factor(scales))
            said.append(f"{at_zero} to the zero at d = {in_unit(scales, LENGTH, zero.d)}")
        lines.append(f"The half-widths of the inputs add, to first order, {', '.join(said)}.")
    elif len(parts) > 1:
        lines.append(f"To first order, they add {added(peak.d, VELOCITY, 1.0)} there.")
    if unknown and drawn is None:
        lines.append(f"What the half-width of {unknown} adds is not known: the curve has no derivatives for it.")
    elif drawn is not None and drawn.missing:
        lines.append(f"What {unknown} changes by {drawn.missing} is not in it: the atlas has one {drawn.missing}.")
    return lines


def _held(table: Mapping[str, Array], scales: Scales | None) -> list[str]:
    """What dU at held distances is for, where it differs from dU by more than its half-width."""
    apart = np.abs(table["dU_held"] - table["dU"])
    if not len(far := np.flatnonzero(apart > table["dU_error"])):
        return []
    at = far[np.argmax(apart[far])]
    error = table["dU_error"][at]
    both = [in_unit(scales, VELOCITY, table[name][at], error, "+") for name in ("dU", "dU_held")]
    place = in_unit(scales, LENGTH, table["d"][at])
    return [
        f"At d = {place} a pair that moves freely has dU = {both[0]}; while its distance is held, as where a run with "
        f"start: steady begins, it is dU_held = {both[1]}."
    ]


def _starts(table: Mapping[str, Array], scales: Scales | None) -> list[str]:
    """From where on pairs that start at an end of the curve and move along it are on the curve, if that is far."""
    lines = []
    for end, sign in ((0, 1), (-1, -1)):
        d, dU, held = (float(table[name][end]) for name in ("d", "dU", "dU_held"))
        there = forgotten_at(table, d) if dU * sign > 0 else None
        if there is None or 1 / FAR < there / d < FAR:
            continue
        far = in_unit(scales, LENGTH, there, digits=3)
        known = f"follows this curve from d = {far} on" if math.isfinite(there) else "does not follow this curve"
        change = f"{100 * abs(held / dU - 1):.2g} % {'more' if held / dU > 1 else 'less'}"
        shapes = f" (with the shapes of a held distance: dU_held, {change})" if held != dU else ""  # as of an atlas
        lines.append(
            f"A pair that starts at d = {in_unit(scales, LENGTH, d)} {known}, when it has forgotten its start; at "
            f"first, dU depends on that{shapes}."
        )
    return lines
