"""The answer of a stream in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pairsim.analysis.drops import KINDS, poisson
from pairsim.quantities.kinds import LENGTH, POSITION, VELOCITY
from pairsim.quantities.text import in_unit, with_error, with_name
from pairsim.questions.stream import StreamCase
from pairsim.questions.stream.statistics import places_of
from pairsim.runtime.arrays import Array

if TYPE_CHECKING:
    from pairsim.questions.stream.computation import Moved

ARRIVALS = {"random": "independently of each other, without overlap", "regular": "at even distances"}


def sentences(case: StreamCase, moved: Moved, by_model: Array) -> list[str]:
    """What is said of streams that have moved; `by_model` are the half-widths by the model at each length of tube."""
    first, last = moved.on_the_way[0], moved.on_the_way[-1]
    rows = places_of(first.gaps, moved.lengths)
    spacing = float((rows[:, -1] - rows[:, 0]).mean()) / (rows.shape[1] - 1)
    scales, velocity = case.scales, float(first.velocities.mean())
    how = "as listed" if case.stream.positions is not None else ARRIVALS[case.stream.arrivals]
    differ = {"diameter": case.spread.diameter, "modulus": case.spread.modulus}
    parts = ", ".join(f"{name} {100 * part:.3g} %" for name, part in differ.items() if part)
    lines = [
        f"Beads arrive {how}, their centres {in_unit(scales, LENGTH, spacing)} apart on average, and move at U = "
        f"{in_unit(scales, VELOCITY, velocity)}; {f'standard deviations: {parts}' if parts else 'all are equal'}."
    ]
    tube = with_name(scales, POSITION, float(last.way.mean()))
    inlet, outlet = moved.counted[0].means, moved.counted[-1].means
    half = np.hypot(moved.counted[-1].half_widths, by_model[-1])
    if case.stream.drop is not None:
        per_drop = case.stream.drop * velocity / spacing
        of = [_percent(outlet[2 + i], half[2 + i]) for i in range(KINDS)]
        on_arrival, independent = _list(inlet[2:]), _list(poisson(per_drop))
        lines.append(
            f"After {tube} of tube {of[1]} of the drops have one bead, {of[2]} two, {of[3]} more and {of[0]} none. On "
            f"arrival they would have one in {on_arrival}, by Poisson in {independent}. A drop takes the liquid of "
            f"{in_unit(scales, LENGTH, case.stream.drop)} of tube, with {per_drop:.3g} beads on average."
        )
    lines.append(
        f"After {tube} of tube {_percent(outlet[1], half[1])} of the beads touch another one (on arrival "
        f"{100 * inlet[1]:.2g} %), and the spread of the distances is {_percent(outlet[0], half[0])} of their mean (on "
        f"arrival {100 * inlet[0]:.3g} %)."
    )
    model = 100 * float(np.nanmax(by_model[-1]))
    lines.append(
        f"Half-widths are by {case.stream.streams} streams of {case.beads} beads and by what a model of rows of up to "
        f"{case.stream.neighbours} beads leaves open, which alone would be {model:.1g} % at most."
    )
    return lines


def _percent(part: float, half_width: float) -> str:
    text = with_error(100 * part, 100 * half_width, digits=3)
    return f"({text}) %" if "+-" in text else f"{text} %"


def _list(shares: Array) -> str:
    none, one, two, more = (f"{100 * part:.2g}" for part in shares)
    return f"{one} % (two {two}, more {more}, none {none})"
