"""The quantities that a case is given by: what they change of its curve, to first order, and their values on axes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from pairsim.cases.inputs import Input
from pairsim.cases.physical import BLOCK, stands_for
from pairsim.cases.quantities import as_given, unit_in
from pairsim.physics.scales import Scales
from pairsim.results.units import VELOCITY
from pairsim.runtime.arrays import Array


def quantity_for(case: Mapping[str, Any], name: str, scales: Scales) -> tuple[str, str, Callable[[Any], Any]]:
    """The quantity that De or Ca_e of a case follows from: its key, its unit as given, and its value by the number."""
    block = case[BLOCK]
    of = min((each for key, each in stands_for(case) if key == name), key=lambda each: each.key not in block)
    given = block.get(of.key, of.example)
    unit = as_given(given[0] if isinstance(given, list) else given)[1]
    one, two = (of.number(number * unit_in(of.unit, unit), scales) for number in (1.0, 2.0))
    return of.key, unit, lambda values: (values / one) ** (1.0 if two > one else -1.0)  # De rises with it, Ca_e falls


def change_by(table: Mapping[str, Array], scales: Scales, one: Input) -> Array | None:
    """Derivative of dU at constant distance in units by an input's logarithm, or by a percentage [um/s], (points,).

    The curve is that of a pair with sensitivities; None where the input changes numbers by which there are none.
    """
    numbers = {name: change for name, change in one.changes.items() if change and name not in ("length", "velocity")}
    if any(f"by_{name}" not in table for name in numbers):
        return None
    dU = table["dU"] * one.changes["velocity"] - table["d"] * table["slope"] * one.changes["length"]
    return VELOCITY.factor(scales) * (dU + sum(change * table[f"by_{name}"] for name, change in numbers.items()))


def half_widths_by(table: Mapping[str, Array], scales: Scales, inputs: list[Input]) -> dict[str, Array]:
    """The part of each input in the half-width of dU, as of `change_by`; infinite where it is not known.

    Quantities are independent, so that squares add up.
    """
    found = {}
    for one in inputs:
        if one.half_width:
            change = change_by(table, scales, one)
            unknown = np.full_like(table["dU"], np.inf)
            found[one.key] = unknown if change is None else np.abs(change) * one.half_width / one.size
    return found
