"""What the half-widths of the inputs of an experiment contribute to those of a master curve, to first order."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from pairsim.cases.inputs import Input
from pairsim.physics.sphere_in_tube import velocity_by_size
from pairsim.record.columns import DISTANCE, DU, SENSITIVITIES, SLOPE, U
from pairsim.record.table import Table
from pairsim.runtime.arrays import Array
from pairsim.solvers.curves.interpolant import slopes_of

SCALES = ("length", "velocity")
"""What an input changes beside dimensionless numbers: the logarithms of the units of length and velocity."""


@dataclass(frozen=True)
class InputParts:
    """The changes of a pair's curve by the half-width of each input, its *parts*, at fixed physical distances.

    Inputs are independent, so that the squares of their parts add up. Velocities are in the unit of dU of the curve.

    Attributes:
        d: Distances of the points, ascending, shape (points,).
        dU: Changes of dU by the half-width of each input whose part is known, by its key, shape (points,) each.
        velocity: The same for the mean velocity of the pair; see `velocity_by`.
        unknown: The keys of the inputs whose part is not known, as the curve has no derivatives for it.
    """

    d: Array
    dU: Mapping[str, Array] = field(default_factory=dict)
    velocity: Mapping[str, Array] = field(default_factory=dict)
    unknown: Sequence[str] = ()

    @classmethod
    def of(cls, table: Table, inputs: Sequence[Input]) -> Self:
        """The parts of those inputs that have half-widths, from the table of a curve; unknown unless of a pair."""
        uncertain = {one.key: one for one in inputs if one.half_width}
        dU, velocity = dict[str, Array](), dict[str, Array]()
        for key, one in uncertain.items():
            if (change := dU_by(table, one)) is not None:
                size = one.half_width / one.size
                dU[key], velocity[key] = change * size, velocity_by(table, one) * size
        return cls(table[DISTANCE] if dU else np.ones(1), dU, velocity, [key for key in uncertain if key not in dU])

    def __bool__(self) -> bool:
        """Whether there is an input with a half-width."""
        return bool(self.dU or self.unknown)

    @property
    def known(self) -> bool:
        """Whether there are inputs with half-widths, and the parts of all are known."""
        return bool(self.dU) and not self.unknown

    def dU_at(self, d: Array | float) -> dict[str, Array]:
        """The known changes of dU at distances between the points, of their shape, by input: linear in log d."""
        return self._at(self.dU, d)

    def velocity_at(self, d: Array | float) -> dict[str, Array]:
        """The known changes of the mean velocity at distances between the points, of their shape, by input."""
        return self._at(self.velocity, d)

    def _at(self, changes: Mapping[str, Array], d: Array | float) -> dict[str, Array]:
        x, at = np.log(self.d), np.log(d)
        return {key: np.asarray(np.interp(at, x, values)) for key, values in changes.items()}

    def half_widths(self, d: Array | float) -> Array:
        """The half-width of dU due to all inputs at distances, of their shape; infinite if a part is not known."""
        found = np.full(np.shape(d), np.inf if self.unknown else 0.0)
        return found if self.unknown or not self.dU else together(self.dU_at(d).values())


def unknown_in_words(keys: Sequence[str]) -> str:
    """A sentence on inputs, by their keys, whose parts are not known."""
    return f"how much the half-width of {' and '.join(keys)} adds is not known: the curve has no derivatives for it"


def together(parts: Iterable[Array | float]) -> Array:
    """The half-width due to independent parts: the root of the sum of their squares."""
    return np.sqrt(np.sum(np.square(np.array(list(parts))), axis=0))


def dU_by(table: Table, one: Input) -> Array | None:
    """Derivative of dU of a pair by the logarithm of an input, or by an input that is a percentage, (points,).

    It is taken at fixed physical distances, and is in the unit of dU. None if the input changes numbers for which the
    table has no derivatives.
    """
    numbers = {name: change for name, change in one.changes.items() if change and name not in SCALES}
    columns = {name: SENSITIVITIES.get(name) for name in numbers}
    length, velocity = (one.changes.get(name, 0.0) for name in SCALES)
    needed = [*columns.values(), DU, *([SLOPE] if length else [])]
    if any(column is None or not table.has(column) for column in needed):
        return None
    by_units = table[DU] * velocity - (table[DISTANCE] * table[SLOPE] * length if length else 0.0)
    by_numbers = (numbers[name] * table[column] for name, column in columns.items() if column is not None)
    return np.asarray(by_units + sum(by_numbers))


def velocity_by(table: Table, one: Input) -> Array:
    """Derivative of the mean velocity of a pair by the logarithm of an input, or by a percentage, (points,).

    The derivative by the size of the particles is that of a sphere alone in a Newtonian liquid. De and Ca_e change the
    mean velocity by about as much as dU, which is a hundredth of it: this is left out.
    """
    leading, trailing = table.known(U, "_L"), table.known(U, "_T")
    if leading is None or trailing is None:
        return np.zeros_like(table[DU])
    mean = (leading + trailing) / 2
    length, velocity = (one.changes.get(name, 0.0) for name in SCALES)
    if by_beta := one.changes.get("beta", 0.0):  # derivative of beta by a logarithm: beta or, for the tube, -beta
        velocity += math.copysign(1.0, by_beta) * velocity_by_size(abs(by_beta))
    by_d = slopes_of(mean, np.log(table[DISTANCE])) if len(mean) > 1 else 0.0
    return np.asarray(mean * velocity - length * by_d)
