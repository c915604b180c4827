"""The quantities by which a case is given, with half-widths, and the derivatives of its numbers by each of them."""

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
STEP = 1e-6  # step of central differences, in the logarithm of a quantity or in a percentage as a fraction; chosen


class UnitSizes(TypedDict):
    """The entry `scales` of run.json: the units of the case in SI units, which `units` names."""

    length: float
    time: float
    velocity: float
    stress: float
    units: str


class WrittenInput(TypedDict):
    """An `Input` in the entry `inputs` of run.json."""

    key: str
    value: float
    half_width: float
    unit: str
    changes: Mapping[str, float]


class InUnits(TypedDict, total=False):
    """The entries of run.json on the quantities of a case."""

    scales: UnitSizes
    inputs: list[WrittenInput]


class Input(NamedTuple):
    """A quantity by which a case is given, the same for all particles.

    `changes` are derivatives by its logarithm, or by itself if it is a percentage: those of the numbers of the case (of
    Ca_e and beta that of the largest value), and of the logarithms of the scales, "length" and "velocity".
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
        """The input as it is written into run.json."""
        return WrittenInput(
            key=self.key, value=self.value, half_width=self.half_width, unit=self.unit, changes=self.changes
        )


def inputs_of(case: SceneCase) -> list[Input]:
    """The quantities of the `physical` block of a valid case that can be uncertain; empty without the block."""
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
    """The derivatives in `Input.changes` by one quantity; `values` are all quantities in SI units."""
    if of.by:
        return {of.by: 1 / of.kind.per_si}
    value, unit = one(values, of.key), of.kind.per_si if of.kind.signed else 1.0
    moved = [value + step if of.kind.signed else value * (1 + step) for step in (STEP, -STEP)]
    ends = [_logarithms(experiment, {**values, of.key: each}) for each in moved]
    return {name: round((ends[0][name] - ends[1][name]) / (2 * STEP) / unit, 8) for name in ends[0]}


def drawn(case: SceneCase, count: int) -> tuple[Scales, dict[str, Array]]:
    """Scales and numbers of a case with a `physical` block for `count` draws of its uncertain inputs.

    Draws are normal and independent, and the same at each call. What depends on them has the shape (count,), or
    (particles, count) if particles differ. Beside the numbers of the case there are those that occur only as parameters
    of derivatives, such as "difference", if they have a half-width.
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
    """The entries of run.json on the quantities of a case: scales and inputs; empty without a `physical` block."""
    if (scales := case.scales) is None:
        return {}
    sizes = UnitSizes(
        length=scales.length, time=scales.time, velocity=scales.velocity, stress=scales.stress, units="m, s, m/s, Pa"
    )
    return {"scales": sizes, "inputs": [each.written for each in inputs_of(case)]}


def _logarithms(experiment: Experiment, values: Amounts) -> dict[str, float]:
    """The numbers of a case, of beta and Ca_e the largest, and the logarithms of its scales."""
    scales, numbers = experiment.with_values(values)
    largest = {name: float(max(np.atleast_1d(np.asarray(each)))) for name, each in numbers.items()}
    return largest | {"length": math.log(scales.length), "velocity": math.log(scales.velocity)}
