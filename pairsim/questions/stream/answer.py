"""The answer of a stream in words."""

from __future__ import annotations

import numpy as np

from pairsim.analysis.drops import KINDS, poisson
from pairsim.quantities.kinds import LENGTH, LIQUID_VOLUME, POSITION, VELOCITY
from pairsim.quantities.scales import cross_section
from pairsim.quantities.text import in_unit, with_error, with_name
from pairsim.questions.stream import StreamCase
from pairsim.questions.stream.found import Found
from pairsim.runtime.arrays import Array

ARRIVALS = {"random": "independently of each other, without overlap", "regular": "at even distances"}


def sentences(case: StreamCase, found: Found) -> list[str]:
    """The sentences of the answer, once all streams have moved along the tube."""
    scales, spacing, velocity = case.scales, found.spacing, found.velocity
    how = "as listed" if case.stream.positions is not None else ARRIVALS[case.stream.arrivals]
    differ = {"diameter": case.spread.diameter, "modulus": case.spread.modulus}
    parts = ", ".join(f"{name} {100 * part:.3g} %" for name, part in differ.items() if part)
    lines = [
        f"Beads arrive {how}, their centres {with_name(scales, LENGTH, spacing)} apart on average, and move at U = "
        f"{in_unit(scales, VELOCITY, velocity)}; {f'standard deviations: {parts}' if parts else 'all are equal'}."
    ]
    tube = with_name(scales, POSITION, case.stream.tube)
    inlet, outlet, by_model = found.means[0], found.means[-1], found.by_model[-1]
    half = np.hypot(found.half_widths[-1], by_model)
    per_drop = found.per_drop(case)
    if case.stream.drop is not None and per_drop is not None:
        drop = with_name(scales, LENGTH, case.stream.drop)
        of = [_percent(outlet[2 + i], half[2 + i]) for i in range(KINDS)]
        on_arrival, independent = _list(inlet[2:]), _list(poisson(per_drop))
        lines.append(
            f"After {tube} of tube {of[1]} of the drops have one bead, {of[2]} two, {of[3]} more and {of[0]} none. On "
            f"arrival they would have one in {on_arrival}, by Poisson in {independent}. A drop takes the liquid of "
            f"{drop} of tube{_volume(case)}, with {per_drop:.3g} beads on average."
        )
    lines.append(
        f"After {tube} of tube {_percent(outlet[1], half[1])} of the beads touch another one (on arrival "
        f"{100 * inlet[1]:.2g} %), and the standard deviation of the distances is {_percent(outlet[0], half[0])} of "
        f"their mean (on arrival {100 * inlet[0]:.3g} %)."
    )
    model = 100 * float(np.nanmax(by_model))
    lines.append(
        f"Half-widths are due to the finite number of beads ({case.stream.streams} streams of {case.beads}) and to the "
        f"model of rows of up to {case.stream.neighbours} beads, which alone would give {model:.1g} % at most."
    )
    return lines


def _volume(case: StreamCase) -> str:
    """The volume of a drop in brackets, in an experiment."""
    if case.scales is None or case.stream.drop is None:
        return ""
    return f" ({in_unit(case.scales, LIQUID_VOLUME, cross_section(1.0) * case.stream.drop)})"


def _percent(part: float, half_width: float) -> str:
    text = with_error(100 * part, 100 * half_width, digits=3)
    return f"({text}) %" if "+-" in text else f"{text} %"


def _list(shares: Array) -> str:
    none, one, two, more = (f"{100 * part:.2g}" for part in shares)
    return f"{one} % (two {two}, more {more}, none {none})"
