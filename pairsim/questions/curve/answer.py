"""The answer of a master curve in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from pairsim.analysis.input_parts import together, unknown_in_words
from pairsim.analysis.input_ranges import COVERED, FINE, DrawnRange
from pairsim.analysis.master_curve import Curve
from pairsim.analysis.taylor_parameters import ranges_of_shapes, shapes_in
from pairsim.analysis.unequal_pairs import Spread
from pairsim.analysis.zeros import Zero
from pairsim.cases.physical import DIFFERENCE
from pairsim.quantities.kinds import LENGTH, TIME, VELOCITY, Kind
from pairsim.quantities.scales import Scales
from pairsim.quantities.text import as_known, in_unit
from pairsim.questions.curve import AFTER
from pairsim.record.columns import (
    BY_BETA,
    DISTANCE,
    DU,
    DU_ERROR,
    DU_HALF,
    DU_HELD,
    F_ERROR,
    SLOPE,
    U_ERROR,
    F,
    U,
)
from pairsim.runtime.arrays import Array
from pairsim.solvers.curves.interpolant import Region

SLIGHT = 1e-3  # difference of two diameters, over their mean, that no camera sees
FLAT = 0.5  # relative half-width of the d of the largest |dU| above which this d hardly means anything; chosen
FAR = 1.2  # ratio of the d at which a start is forgotten to the d of the start, above which it is mentioned; chosen


def answer_of_curve(curve: Curve, difference: str = "") -> list[str]:
    """The answer of a master curve with at least one point.

    `difference` says by how much the beads of a pair differ; "" if they do not.
    """
    if not curve.gaps:
        return _of_one_particle(curve)
    if curve.table.suffixes(F):
        return [*_forces(curve), *ranges_of_shapes(curve.table)]
    lines = []
    if curve.table.has(DU):
        lines += _of_pair(curve, difference)
    if (after := AFTER.of(curve.record)) is not None:
        lines += [_settling(curve, gap, 4 * after) for gap in curve.gaps]
    lines += [line for gap in curve.gaps for line in _largest(curve, gap)]
    return [*lines, *ranges_of_shapes(curve.table)]


def _of_one_particle(curve: Curve) -> list[str]:
    """The velocity of a particle on its own, and the force that moves it if there is one."""
    table, scales, found = curve.table, curve.scales, list[str]()
    for column, half_width in ((U, U_ERROR), (F, F_ERROR)):
        for suffix in table.suffixes(column):
            given = column is U and table.known(F, suffix) is not None  # the velocity of a moved particle
            error = None if given else table.of(half_width, suffix)[0]
            value = in_unit(scales, column.unit, table.of(column, suffix)[0], error)
            found.append(f"{column.name}{suffix} = {value}")
    return [f"{', '.join(found)}.", *shapes_in(table, 0, "")]


def _forces(curve: Curve) -> list[str]:
    """The least and the largest force on each of several moved particles, whose dU is prescribed."""
    table, scales, lines = curve.table, curve.scales, list[str]()
    for suffix in table.suffixes(F):
        forces, errors = table.of(F, suffix), table.of(F_ERROR, suffix)
        found = []
        for i in sorted({int(forces.argmin()), int(forces.argmax())}, key=lambda i: float(forces[i])):
            d = ", ".join(in_unit(scales, LENGTH, table.of(DISTANCE, gap)[i]) for gap in curve.gaps)
            found.append(f"{in_unit(scales, F.unit, forces[i], errors[i])} at d = {d}")
        lines.append(f"{F.name}{suffix} {'from ' if len(found) > 1 else '= '}{' to '.join(found)}.")
    return lines


def _of_pair(curve: Curve, difference: str) -> list[str]:
    """Where a pair separates and comes closer, and how its start, the inputs and differing beads change this."""
    regions, held = curve.regions, curve.arrested
    met = {a.stop for a, b in pairwise(regions) if a.sign * b.sign < 0}
    zeros = [zero for zero in curve.zeros if zero.d in met]
    lines = [_motion_over_d([each for each in regions if each not in held], zeros, curve.scales, held)]
    if curve.steady:
        lines += [*_starts(curve), *_held(curve), *_with_inputs(curve, zeros)]
        lines += _of_differing(curve, difference) if difference else _of_unequal(curve)
        lines += _of_spread(curve)
    return lines


def _largest(curve: Curve, gap: str) -> list[str]:
    """The largest |dU| of a gap; nothing where dU is exactly zero everywhere, as of rigid particles in an atlas."""
    scales, name, peak = curve.scales, f"{DU.name}{gap}", curve.peak_of(gap)
    if not (peak.dU or peak.error):
        return []
    value = in_unit(scales, VELOCITY, peak.dU, peak.error, "+")
    over, place = curve.table.varied(gap), in_unit(scales, LENGTH, peak.d, peak.d_error)
    ends = curve.table.get(over.name, np.zeros(1))[[0, -1]]
    d = DISTANCE.name if over.name == DISTANCE.name + gap else over.name
    if not math.isfinite(peak.error):
        return [f"Largest |{name}| of two points: {value} at {d} = {place}; what lies between is not known."]
    at_end = ends[0] < ends[1] and peak.d in ends and abs(peak.dU) > peak.error
    beyond = f", the end of this curve; beyond it |{name}| may be larger" if at_end else ""
    if not at_end and peak.d_error > FLAT * peak.d:
        place = in_unit(scales, LENGTH, peak.d, digits=2)
        beyond = " or elsewhere, which the half-width leaves open"
    return [f"Largest |{name}|: {value} at {d} = {place}{beyond}."]


def _settling(curve: Curve, gap: str, end: float) -> str:
    """Which dU of a curve from rest still change by more than their half-widths."""
    table, scales = curve.table, curve.scales
    change = np.abs(table.of(DU, gap) - table.of(DU_HALF, gap))
    places = [in_unit(scales, LENGTH, d) for d in table.of(DISTANCE, gap)[change > table.of(DU_ERROR, gap)]]
    where = f"at d = {', '.join(places)}: not settled there" if places else "nowhere"
    now, before = (in_unit(scales, TIME, each) for each in (end, end / 2))
    return (
        f"dU{gap} is taken at t = {now} after a start from rest, with the distances held; since t = {before} it has "
        f"changed by up to {in_unit(scales, VELOCITY, float(change.max()))}, by more than its half-width {where}."
    )


def _motion_over_d(
    regions: Sequence[Region], zeros: Sequence[Zero], scales: Scales | None, held: Sequence[Region]
) -> str:
    """Where a pair separates, comes closer, keeps its distance, or is held together, and where none is certain."""

    errors = {zero.d: zero.error for zero in zeros}

    def where(region: Region) -> str:
        start, stop = (as_known(scales, LENGTH, d, errors.get(d)) for d in (region.start, region.stop))
        return f"between d = {start} and {stop}" if region.stop > region.start else f"at d = {start}"

    if not regions and not held:
        return "The pair keeps its distance: dU vanishes at every d."
    moves = [f"{'separates' if each.sign > 0 else 'comes closer'} {where(each)}" for each in regions if each.sign]
    sentences = [f"The pair {', '.join(moves)}."] if moves else []
    if held:
        sentences.append(
            f"Unyielded liquid holds it together {', '.join(map(where, held))}: dU there is mere creep due to the "
            "regularisation, which vanishes as 1/m."
        )
    if open_ones := [where(each) for each in regions if not each.sign]:
        sentences.append(f"Not decided {', '.join(open_ones)}: the interval of dU contains both signs.")
    if zeros:
        places = [f"{in_unit(scales, LENGTH, zero.d, zero.error)} ({zero.kind})" for zero in zeros]
        sentences.append(f"It keeps its distance at d = {', '.join(places)}.")
    return " ".join(sentences)


def _with_inputs(curve: Curve, zeros: Sequence[Zero]) -> list[str]:
    """How the half-widths of the inputs change dU and its zeros, and the sensitivities at the largest |dU|."""
    scales, inputs = curve.scales, curve.record.inputs
    if scales is None or not curve.table.has(BY_BETA) or not curve.table[DU].any():
        return []
    d, drawn = curve.peak.d, curve.drawn
    ranges = _in_draws(drawn, d, zeros, scales) if drawn is not None else []
    changes = [(one, curve.change_by(one)) for one in inputs]
    known = [(one, curve.interpolated(each, d) / one.size) for one, each in changes if each is not None]
    each = ", ".join(f"{by:+.3g} per {one.unit} of {one.key}" for one, by in known)
    added = [*_to_first_order(curve, zeros, scales), *_left_open(curve, zeros, scales)]
    return [*ranges, *added, f"At the largest |dU|, dU [{VELOCITY.physical}] changes by {each}."]


def _of_unequal(curve: Curve) -> list[str]:
    """How a difference of the diameters would change dU, if the case does not specify this difference."""
    inputs = {each.key: each.half_width for each in curve.record.inputs}
    if curve.by_difference is None or DIFFERENCE.key in inputs or curve.unequal is not None:
        return []
    d, scales = curve.peak.d, curve.scales
    change = 0.01 * curve.interpolated(curve.by_difference, d)
    key = f" ({DIFFERENCE.key}: 0 +- 1 % would include this uncertainty in the answer)" if scales is not None else ""
    common = ", and the half-width of particle is common to both" if inputs.get("particle") else ""
    return [
        f"The beads are taken to be of equal size{common}: for each per cent by which the leading one is larger, dU at "
        f"d = {in_unit(scales, LENGTH, d)} changes by {in_unit(scales, VELOCITY, change, sign='+', digits=3)}{key}."
        f"{_decided_by(curve, curve.by_difference)}"
    ]


def _of_differing(curve: Curve, difference: str) -> list[str]:
    """By how much two beads differ, and how a further difference of the diameters would change dU."""
    if curve.by_difference is None:
        return [f"{difference}."]
    d, scales = curve.peak.d, curve.scales
    change = in_unit(scales, VELOCITY, 0.01 * curve.interpolated(curve.by_difference, d), sign="+", digits=3)
    place = in_unit(scales, LENGTH, d)
    larger = "for each further per cent of its diameter"
    return [f"{difference}; {larger}, dU at d = {place} changes by {change}."]


def _of_spread(curve: Curve) -> list[str]:
    """The effect of a spread of the particles: on dU of pairs, on the fraction that meets, and what decides this."""
    unequal, scales = curve.unequal, curve.scales
    spread = Spread.of(curve.record)
    if spread is None:
        return []
    unknown = spread.sizes if unequal is None else unequal.unknown
    lines = [
        f"The effect of the spread of the {name} is not known: there are no derivatives for it." for name in unknown
    ]
    if unequal is None:
        return lines
    peak, (least, largest) = curve.peak, curve.of().ends
    lines.append(
        f"Beads differ (standard deviations: {unequal.spread.words}): at d = {in_unit(scales, LENGTH, peak.d)} dU is "
        f"{in_unit(scales, VELOCITY, peak.dU, sign='+')} on average, with {unequal.words_at(peak.d, scales)}."
    )
    if (meeting := curve.travel_of_pairs(largest, least)) is not None:
        text = str(meeting)
        lines.append(f"{text[0].upper()}{text[1:]}.")
    for name, part in unequal.decisive.items():
        lines.append(
            f"If the {name} of two beads differs by more than {100 * part:.3g} %, whether they separate depends at "
            "every d of this curve on which of them leads, and no longer on their interaction."
        )
    return lines


def _decided_by(curve: Curve, by_difference: Array) -> str:
    """A sentence on the distances at which an invisible difference of the diameters decides what the pair does."""
    decides = np.abs(curve.table[DU]) < SLIGHT * np.abs(by_difference)
    if not decides[-1]:
        return ""
    if decides.all():
        return f" A difference of {100 * SLIGHT:g} % decides at every d whether they separate."
    d = in_unit(curve.scales, LENGTH, float(curve.table[DISTANCE][np.flatnonzero(~decides)[-1] + 1]))
    return f" From d = {d} on a difference of {100 * SLIGHT:g} % decides whether they separate."


def _in_draws(drawn: DrawnRange, d: float, zeros: Sequence[Zero], scales: Scales) -> list[str]:
    """Where dU at a distance and its zeros are in most draws of the inputs."""
    said = [f"dU at d = {in_unit(scales, LENGTH, d)} is {drawn.words(d)}"]
    for zero in zeros:
        ends = (in_unit(scales, LENGTH, end) for end in drawn.around(zero.d))
        said.append(f"the zero at d = {in_unit(scales, LENGTH, zero.d)} is between {' and '.join(ends)}")
    lines = [f"In {100 * COVERED:g} % of random draws of the inputs, {', '.join(said)}."]
    outside = drawn.outside_at(d)
    return [*lines, f"{outside}."] if outside else lines


def _to_first_order(curve: Curve, zeros: Sequence[Zero], scales: Scales) -> list[str]:
    """What the half-width of each input adds to the half-widths of dU and its zeros, to first order.

    If there are draws of the inputs, these give the total, and only the contributions to dU are listed.
    """
    inputs, peak, drawn = curve.by_inputs, curve.peak, curve.drawn

    def added(d: float, unit: Kind, per_dU: float) -> str:
        """The contributions of the inputs at a distance, the largest first; those to dU are multiplied by `per_dU`."""
        here = {key: abs(float(change)) * per_dU for key, change in inputs.dU_at(d).items()}
        each = ", ".join(f"{key} {half:.2g}" for key, half in sorted(here.items(), key=lambda item: -item[1]))
        return f"+- {together(here.values()):.2g} {unit.physical} ({each})"

    lines, velocity = [], VELOCITY.factor(scales)
    if inputs.dU and drawn is None:
        said = [f"{added(peak.d, VELOCITY, velocity)} to the largest |dU|"]
        for zero in zeros:
            slope = abs(curve.interpolated(curve.table[SLOPE], zero.d))
            at_zero = added(zero.d, LENGTH, LENGTH.factor(scales) / slope)
            said.append(f"{at_zero} to the zero at d = {in_unit(scales, LENGTH, zero.d)}")
        lines.append(f"The half-widths of the inputs add, to first order, {', '.join(said)}.")
    elif len(inputs.dU) > 1:
        lines.append(f"To first order, they add {added(peak.d, VELOCITY, velocity)} there.")
    if inputs.unknown and drawn is None:
        unknown = unknown_in_words(inputs.unknown)
        lines.append(f"{unknown[0].upper()}{unknown[1:]}.")
    elif drawn is not None and drawn.missing:
        unknown = " and ".join(inputs.unknown)
        lines.append(f"The effect of {unknown} on {drawn.missing} is not included: the atlas has one {drawn.missing}.")
    return lines


def _left_open(curve: Curve, zeros: Sequence[Zero], scales: Scales) -> list[str]:
    """Where, away from zeros, dU exceeds its own half-width but not that due to the inputs."""
    regions = [region for region in curve.regions if region.sign and region.stop > region.start]
    if not (curve.by_inputs.known or curve.drawn) or not regions:
        return []
    least, largest = curve.of().ends if curve.drawn is None else curve.drawn.d[[0, -1]]
    d = np.geomspace(least, largest, FINE)[1:-1]
    if curve.drawn is None:
        unsure = np.abs(curve(d)[0]) <= curve.inputs_half_width(d)
    else:
        unsure = curve.drawn.holds_both_signs(d)
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], unsure, [False]]).astype(int))).reshape(-1, 2)
    places = []
    for first, last in bounds:
        start, stop = float(d[first]) if first else least, float(d[last - 1]) if last < len(d) else largest
        decided = any(region.start < stop and start < region.stop for region in regions)
        if decided and not any(start < zero.d < stop for zero in zeros):
            ends = [in_unit(scales, LENGTH, each, digits=3) for each in (start, stop)]
            places.append(f"between d = {ends[0]} and {ends[1]}")
    if not places:
        return []
    where = ", ".join(places)
    return [f"The uncertainty of the inputs leaves open whether the pair separates or comes closer {where}."]


def _held(curve: Curve) -> list[str]:
    """What dU_held means, if it differs from dU by more than the half-width at any distance."""
    table, scales = curve.table, curve.scales
    apart = np.abs(table[DU_HELD] - table[DU])
    if not len(far := np.flatnonzero(apart > table[DU_ERROR])):
        return []
    at = far[np.argmax(apart[far])]
    error = table[DU_ERROR][at]
    both = [in_unit(scales, VELOCITY, table[column][at], error, "+") for column in (DU, DU_HELD)]
    place = in_unit(scales, LENGTH, table[DISTANCE][at])
    return [
        f"At d = {place} a pair that moves freely has dU = {both[0]}; one whose distance is held, as at the beginning "
        f"of a run with start: steady, has dU_held = {both[1]}."
    ]


def _starts(curve: Curve) -> list[str]:
    """From which distance on pairs that start at an end of the curve follow it, if this is far from the end."""
    lines, scales = [], curve.scales
    for end, sign in ((0, 1), (-1, -1)):
        d, dU, held = (float(curve.table[column][end]) for column in (DISTANCE, DU, DU_HELD))
        there = curve.forgotten(d) if dU * sign > 0 else None
        if there is None or 1 / FAR < there / d < FAR:
            continue
        far = in_unit(scales, LENGTH, there, digits=3)
        known = f"follows this curve from d = {far} on, when it has forgotten its start; until then dU depends on it"
        known = known if math.isfinite(there) else "does not forget its start on this curve: dU depends on it"
        change = f"{100 * abs(held / dU - 1):.2g} % {'more' if held / dU > 1 else 'less'}"
        shapes = f" (with the shapes of a held distance: dU_held, {change})" if held != dU else ""  # as of an atlas
        lines.append(f"A pair that starts at d = {in_unit(scales, LENGTH, d)} {known}{shapes}.")
    return lines
