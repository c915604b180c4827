"""Time and length of tube in which a pair moves from one distance to another, from its master curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pairsim.analysis.input_parts import InputParts, together, unknown_in_words
from pairsim.analysis.pair_motion import Motion
from pairsim.analysis.unequal_pairs import Way
from pairsim.cases.quantity_text import A_LENGTH, si
from pairsim.cases.unit_registry import as_texts
from pairsim.quantities.kinds import LENGTH, POSITION, TIME
from pairsim.quantities.scales import Scales
from pairsim.quantities.text import in_unit, with_name
from pairsim.record.record import no_units
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import Argument, InputError
from pairsim.runtime.message import Message, Text, in_units
from pairsim.solvers.curves.interpolant import NEGLIGIBLE_DU, CurveInterpolant

NODES = 4  # of the quadrature between two samples of a curve, whose relative error is 1e-10 on smooth ones
SAME = 1e-9  # relative difference of a distance from an end of the curve that is due to rounding


@dataclass(frozen=True)
class Travel:
    """Time and length of tube for the motion of a pair between two distances, with half-widths of their intervals.

    Attributes:
        start: First distance [D_c].
        stop: Last distance [D_c].
        time: Integral of dz/dU over the distance z of the centres of volume [D_c/U_av].
        length: Integral of U/dU dz with the mean velocity U of the pair: how far it travels along the tube [D_c].
        time_error: Half-width of the time [D_c/U_av]: its change if dU is at one end of its interval everywhere.
        length_error: Half-width of the length [D_c], in the same way.
        forgotten: Distance from which a pair that starts at the first one follows the curve [D_c]; see `Memory`.
            None if it is not known.
        start_error: By how much a start from rest at the first distance may change the time [D_c/U_av]. It is no part
            of `time_error`, which is that of a pair that only passes there. None if the curve does not have it.
        scales: The units of the case, None without a `physical` block.
        by_inputs: What the half-width of each input contributes to those of time [D_c/U_av] and length [D_c], by its
            key, to first order.
        unknown: The keys of inputs of which this is not known.
    """

    start: float
    stop: float
    time: float
    length: float
    time_error: float
    length_error: float
    forgotten: float | None
    start_error: float | None
    scales: Scales | None = None
    by_inputs: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    unknown: Sequence[str] = ()

    @property
    def time_inputs(self) -> float | None:
        """Half-width of the time due to those of the inputs, at fixed physical distances; no part of `time_error`.

        None if inputs have none, or if the part of one is not known.
        """
        return self._by_all(0)

    @property
    def length_inputs(self) -> float | None:
        """Half-width of the length due to those of the inputs [D_c], as `time_inputs`; no part of `length_error`."""
        return self._by_all(1)

    def _by_all(self, which: int) -> float | None:
        parts = [each[which] for each in self.by_inputs.values()]
        return None if self.unknown or not parts else float(together(parts))

    def __str__(self) -> str:
        """The answer of `pairsim travel`."""
        scales, velocity = self.scales, self.length / self.time
        start, stop = (in_unit(scales, LENGTH, d, digits=6) for d in (self.start, self.stop))
        time = with_name(scales, TIME, self.time, self.time_error)
        tube = with_name(scales, POSITION, self.length, self.length_error)
        mean = f"{velocity:.4g} U_av" if scales is None else f"{1e3 * scales.velocity * velocity:.4g} mm/s"
        lines = [f"from d = {start} to {stop}: {time} and {tube} of tube (mean velocity {mean})"]
        if self.forgotten is not None:
            there = in_unit(scales, LENGTH, self.forgotten, digits=3)
            known = f"has forgotten its start by d = {there}"
            known = known if self.forgotten < np.inf else "does not forget its start on this curve"
            lines.append(f"this holds for a pair that passes d = {start}; one that starts there {known}")
            if self.start_error is not None:
                changed = with_name(scales, TIME, self.start_error, digits=2)
                lines[-1] += f", and takes up to about {changed} more or less if it starts from rest"
        return "\n".join([*lines, *self._inputs_in_words()])

    def _inputs_in_words(self) -> list[str]:
        """Sentences on what the inputs add, the largest part first, and on the inputs of which this is not known."""
        lines, parts = [], sorted(self.by_inputs.items(), key=lambda each: -each[1][0])
        if parts:
            said = []
            for which, unit in enumerate((TIME, POSITION)):
                own = {key: part[which] * unit.factor(self.scales) for key, part in parts}
                each = ", ".join(f"{key} {part:.2g}" for key, part in own.items())
                said.append(f"+- {together(own.values()):.2g} {unit.physical} ({each})")
            lines.append(f"the half-widths of the inputs add, to first order, {' and '.join(said)} of tube")
        return lines + ([unknown_in_words(self.unknown)] if self.unknown else [])


def travel(
    motion: Motion, start: float | str, stop: float | str, source: str, scales: Scales | None, inputs: InputParts
) -> Travel:
    """Integrate the motion of a pair from one distance to another, see `Curve.travel`.

    Raises:
        InputError: A distance is outside the curve, there is a zero of dU between the distances or there may be one, or
            the pair moves in the other direction. Messages name `source`.
    """
    curve = motion.curve
    begin, end = (distance_on(curve, d, name, scales, source) for name, d in (("start", start), ("stop", stop)))
    if why := _obstacle(curve, begin, end):
        raise _refusal(source, "stop", stop, why, scales)
    d, way, velocities = way_between(motion, begin, end)
    speed, error = np.abs(curve.values(d)), curve.half_widths(d)

    def with_half_width(velocity: Array | float) -> tuple[float, float]:
        """The integral of velocity/|dU| over the distance of the centres, and its half-width due to that of dU."""
        value, least, most = (float((way * velocity / (speed + part * error)).sum()) for part in (0, 1, -1))
        return value, max(value - least, most - value)

    (time, time_error), (length, length_error) = with_half_width(1.0), with_half_width(velocities)
    memory = motion.memory(begin)
    forgotten = memory.forgotten if memory is not None else None
    behind = motion.from_rest(begin) if motion.from_rest is not None else None
    start_error = None if behind is None else float(behind / abs(curve.values(begin)))
    errors = time_error, length_error, forgotten, start_error
    return Travel(begin, end, time, length, *errors, scales, _by_inputs(motion, inputs, d, way), inputs.unknown)


def way_between(motion: Motion, begin: float, end: float) -> Way:
    """Distances from one to another [D_c], with the weights of a quadrature and the velocities of the pair."""
    low, high = sorted((begin, end))
    samples = motion.curve.samples[0]
    places = np.log([low, *samples[(low < samples) & (samples < high)], high])
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    half = np.diff(places)[:, None] / 2
    d = np.exp(places[:-1, None] + half * (1 + nodes))
    return Way(d, half * weights * d * motion.stretch(d), np.asarray(motion.velocity(d)))


def _by_inputs(motion: Motion, inputs: InputParts, d: Array, way: Array) -> dict[str, tuple[float, float]]:
    """The changes of time [D_c/U_av] and length [D_c] by the half-width of each input, by its key.

    Args:
        motion: The motion of the pair.
        inputs: The parts of the inputs.
        d: Distances [D_c], of any shape.
        way: Weights of a quadrature over the distance of the centres [D_c], of the same shape.
    """
    dU, velocity, found = motion.curve.values(d), motion.velocity(d), dict[str, tuple[float, float]]()
    changes, of_velocity = inputs.dU_at(d), inputs.velocity_at(d)
    for key, change in changes.items():
        slower = way * change / dU**2
        length = (velocity * slower - way * of_velocity[key] / dU).sum()
        found[key] = abs(float(slower.sum())), abs(float(length))
    return found


def distance_on(curve: CurveInterpolant, given: Any, argument: str, scales: Scales | None, source: str) -> float:
    """A distance on a curve [D_c]; one that differs from an end of the curve by rounding alone is set to that end.

    It is given as a number [D_c], as a length with its unit, or as a quantity of pint. Messages name `source` and the
    argument.

    Raises:
        InputError: It is neither a number nor a length, the case has no units, or it is outside the curve.
    """
    given = as_texts(given)
    try:
        d = float(given)
    except (TypeError, ValueError):
        try:
            length = si(str(given), A_LENGTH)
        except ValueError as error:
            raise InputError(source, Argument(argument), given, f"{error}, or a number of tube diameters") from None
        if scales is None:
            raise no_units(source) from None
        d = length / scales.length
    least, largest = curve.ends
    d = next((end for end in (least, largest) if abs(d - end) < SAME * end), d)
    if not least <= d <= largest:
        ends = LENGTH(least, "g"), LENGTH(largest, "g")
        allowed = Message("must be between d = {} and d = {}, the ends of the curve", *ends)
        raise _refusal(source, argument, given, allowed, scales)
    return d


def _refusal(source: str, argument: str, given: float | str, allowed: Text, scales: Scales | None) -> InputError:
    """The error that names distances in the units in which the wrong one was given."""
    try:
        return InputError(source, Argument(argument), float(given), str(allowed))
    except ValueError:
        return InputError(source, Argument(argument), given, in_units(allowed, scales))


def _obstacle(curve: CurveInterpolant, start: float, stop: float) -> Text:
    """Why a pair does not move from one distance to another; empty where it does."""
    low, high = sorted((start, stop))
    if start == stop:
        return "must differ from `start`"
    if abs(curve.peak.dU) < NEGLIGIBLE_DU:
        return "must be left out: dU = 0 at every distance, so that the pair never moves to another one"
    if zeros := [zero for zero in curve.zeros if low <= zero <= high]:
        side = "must be on the same side of the zeros of dU as d = {}: dU = 0 at d = {}"
        return Message(side, LENGTH(start, "g"), LENGTH(zeros))
    if (curve.values(np.sqrt(low * high)) > 0) != (stop > start):
        side, motion = ("above", "separates") if stop < start else ("below", "approaches")
        return Message("must be {} d = {}: the pair {} there", side, LENGTH(start, "g"), motion)
    samples = curve.samples[0]
    inside = np.array([low, *samples[(low < samples) & (samples < high)], high])
    unsure = inside[np.abs(curve.values(inside)) <= curve.half_widths(inside)]
    if not unsure.size:
        return ""
    return Message("must be such that dU certainly does not vanish on the way, as it may at d = {}", LENGTH(unsure[0]))
