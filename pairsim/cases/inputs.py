"""The quantities that a case is given by, with half-widths, and what its numbers change by with each of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from pairsim.cases.case import SceneCase
from pairsim.cases.physical import DIFFERENCE, EXPERIMENT, QUANTITIES, numbers_from, values_in
from pairsim.cases.quantities import as_given, measured, percentage, rounded
from pairsim.quantities.scales import Scales

STEP = 1e-6  # of logarithms, for derivatives of products of powers; chosen
DISTANCES = {each.key for each in EXPERIMENT if not each.uncertain}  # and times, which change no other number


class Input(NamedTuple):
    """A quantity that a case is given by, the same for all particles.

    Changes are derivatives by its logarithm, or of a percentage by itself: of the numbers of the case (of Ca_e and beta
    of the largest value), and of the logarithms of the scales, "length" and "velocity".
    """

    key: str  # in the `physical` block
    value: float  # in the unit in which it was given
    half_width: float  # of its interval of 95 % in this unit, 0 if none was given
    unit: str
    changes: Mapping[str, float]

    @property
    def size(self) -> float:
        """What changes are to be divided by for those by the quantity in its unit."""
        return 1.0 if self.unit == DIFFERENCE.unit else self.value


def inputs_of(case: SceneCase) -> list[Input]:
    """The quantities of a valid case that may have half-widths; none without a `physical` block."""
    if case.physical is None:
        return []
    keys, block = dict(case), dict(case.physical)
    values = {key: value for key, value in values_in(block, keys, []).items() if key not in DISTANCES}
    found = []
    for key, value in values.items():
        if key == DIFFERENCE.key:
            size, half_width = (100 * each for each in percentage(block[key]))
            found.append(Input(key, size, half_width, DIFFERENCE.unit, {"difference": 0.01}))
            continue
        if isinstance(value, tuple) or not QUANTITIES[key].uncertain:
            continue
        ends = [_logarithms(values | {key: value * (1 + step)}, keys) for step in (STEP, -STEP)]
        changes = {name: round((ends[0][name] - ends[1][name]) / (2 * STEP), 8) for name in ends[0]}
        _, half_width = measured(block[key], QUANTITIES[key].dimension)
        given, unit = as_given(block[key])
        found.append(Input(key, given, rounded(given * half_width / value), unit, changes))
    return found


def drawn(case: SceneCase, count: int) -> tuple[Scales, dict[str, Any]]:
    """Scales and numbers of a case with a `physical` block for `count` draws of its uncertain inputs.

    These are normal, independent, and the same at each call; what is uncertain has the shape (count,). Beside the
    numbers of the case there is "difference", that of the diameters over their mean, where it has a half-width.
    """
    values, random = values_in(dict(case.physical or {}), dict(case), []), np.random.default_rng(0)
    difference = {}
    for each in inputs_of(case):
        if not each.half_width:
            continue
        draws = each.half_width / 2 * random.standard_normal(count)
        if each.key == DIFFERENCE.key:
            difference["difference"] = (each.value + draws) / 100
        else:
            values[each.key] = values[each.key] * (1 + draws / each.value)
    scales, numbers = numbers_from(values, dict(case))
    return scales, numbers | difference


def units_of(case: SceneCase) -> dict[str, Any]:
    """What run.json has of the quantities of a case: scales and inputs; nothing without a `physical` block."""
    if (scales := case.scales) is None:
        return {}
    sizes = {name: getattr(scales, name) for name in ("length", "time", "velocity", "stress")}
    return {"scales": sizes | {"units": "m, s, m/s, Pa"}, "inputs": [each._asdict() for each in inputs_of(case)]}


def _logarithms(values: Mapping[str, Any], keys: Mapping[str, Any]) -> dict[str, float]:
    """The numbers of a case, and the logarithms of its scales."""
    scales, numbers = numbers_from(values, keys)
    largest = {name: float(max(each)) if isinstance(each, tuple) else float(each) for name, each in numbers.items()}
    return largest | {"length": math.log(scales.length), "velocity": math.log(scales.velocity)}
