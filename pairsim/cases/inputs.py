"""The quantities that a case is given by, with half-widths, and what its numbers change by with each of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple, TypedDict

import numpy as np

from pairsim.cases.case import SceneCase
from pairsim.cases.experiment import Amounts, Experiment, changes_no_other, one
from pairsim.cases.physical import DEVIATIONS, QUANTITIES
from pairsim.cases.quantity_text import as_given, measured, rounded
from pairsim.quantities.kinds import PERCENTAGE
from pairsim.quantities.measurable import Measurable
from pairsim.quantities.scales import Scales
from pairsim.runtime.arrays import Array

OF_EACH = ("beta", "Ca_e")  # numbers that may differ between particles
STEP = 1e-6  # of logarithms, for derivatives of products of powers, and of percentages as parts; chosen


class UnitSizes(TypedDict):
    """The entry `scales` of run.json: the units of the case in SI units, which `units` names."""

    length: float
    time: float
    velocity: float
    stress: float
    units: str


class WrittenInput(TypedDict):
    """One of the entry `inputs`: an `Input`."""

    key: str
    value: float
    half_width: float
    unit: str
    changes: Mapping[str, float]


class InUnits(TypedDict, total=False):
    """What run.json has of the quantities of a case."""

    scales: UnitSizes
    inputs: list[WrittenInput]


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
        """Divisor that turns a derivative by the logarithm of the quantity into one by the quantity in its unit."""
        return 1.0 if self.unit == PERCENTAGE.physical else self.value

    @property
    def written(self) -> WrittenInput:
        """It as an entry of run.json."""
        return WrittenInput(
            key=self.key, value=self.value, half_width=self.half_width, unit=self.unit, changes=self.changes
        )


def inputs_of(case: SceneCase) -> list[Input]:
    """The quantities of the `physical` block of a valid case that can be uncertain; none without the block."""
    experiment = case.experiment
    if experiment is None:
        return []
    values = {
        key: value for key, value in experiment.values.items() if not changes_no_other(key) and key not in DEVIATIONS
    }
    found = []
    for key, value in values.items():
        of, text = QUANTITIES[key], str(experiment.given[key])
        if not isinstance(value, float) or not of.uncertain:
            continue
        _, half_width = measured(text, of)
        if of.kind.signed:
            size, unit = of.kind.per_si * value, of.kind.physical
            half_width *= of.kind.per_si
        else:
            size, unit = as_given(text)
            half_width = rounded(size * half_width / value)
        found.append(Input(key, size, half_width, unit, _changes(experiment, of, values)))
    return found


def _changes(experiment: Experiment, of: Measurable, values: Amounts) -> dict[str, float]:
    """What the numbers of a case change by with a quantity, of which there are values in SI units."""
    if of.by:
        return {of.by: 1 / of.kind.per_si}
    value, unit = one(values, of.key), of.kind.per_si if of.kind.signed else 1.0
    moved = [value + step if of.kind.signed else value * (1 + step) for step in (STEP, -STEP)]
    ends = [_logarithms(experiment, {**values, of.key: each}) for each in moved]
    return {name: round((ends[0][name] - ends[1][name]) / (2 * STEP) / unit, 8) for name in ends[0]}


def drawn(case: SceneCase, count: int) -> tuple[Scales, dict[str, Array]]:
    """Scales and numbers of a case with a `physical` block for `count` draws of its uncertain inputs.

    These are normal, independent, and the same at each call; what is uncertain has the shape (count,), of particles
    that differ (particles, count). Beside those of the case there are those that derivatives alone know, such as
    "difference", where they have a half-width.
    """
    experiment, random = case.experiment, np.random.default_rng(0)
    assert experiment is not None
    values, others = experiment.values, dict[str, Array]()
    for each in inputs_of(case):
        if not each.half_width:
            continue
        draws, of = each.half_width / 2 * random.standard_normal(count), QUANTITIES[each.key]
        if of.by:
            others[of.by] = (each.value + draws) / of.kind.per_si
        elif of.kind.signed:
            values[each.key] = (each.value + draws) / of.kind.per_si
        else:
            values[each.key] = one(values, each.key) * (1 + draws / each.value)
    scales, numbers = experiment.with_values(values)
    alike = {name: np.asarray(each) for name, each in numbers.items() if not isinstance(each, tuple)}
    stacked = {
        name: np.stack([np.broadcast_to(np.asarray(amount), count) for amount in amounts])
        for name in OF_EACH
        if isinstance(amounts := numbers.get(name), tuple)
    }
    return scales, alike | stacked | others


def units_of(case: SceneCase) -> InUnits:
    """What run.json has of the quantities of a case: scales and inputs; nothing without a `physical` block."""
    if (scales := case.scales) is None:
        return {}
    sizes = UnitSizes(
        length=scales.length, time=scales.time, velocity=scales.velocity, stress=scales.stress, units="m, s, m/s, Pa"
    )
    return {"scales": sizes, "inputs": [each.written for each in inputs_of(case)]}


def _logarithms(experiment: Experiment, values: Amounts) -> dict[str, float]:
    """The numbers of a case, and the logarithms of its scales."""
    scales, numbers = experiment.with_values(values)
    largest = {name: float(max(np.atleast_1d(np.asarray(each)))) for name, each in numbers.items()}
    return largest | {"length": math.log(scales.length), "velocity": math.log(scales.velocity)}
