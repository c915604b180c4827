"""Velocities of beads on their own, whose difference is dU of a pair of unequal beads that are far apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Self

import numpy as np

from pairsim.atlas.atlas import PARAMETERS, scaled
from pairsim.atlas.kriging import Kriging
from pairsim.runtime.arrays import Array, Flags

COVERED = 0.95  # fraction of velocities that intervals hold
PREFIX = "single_"  # of names of arrays in the file of an atlas


@dataclass(frozen=True)
class SingleBeads:
    """Velocities of single beads, and of beads of pairs that are far apart, over the box of an atlas.

    Attributes:
        box: Least and largest values of the parameters.
        places: beta, De and Ca_e, shape (beads, 3).
        velocities: Their velocities [U_av], shape (beads,).
        by_beta: Derivatives by beta, nan where not known, shape (beads,).
        alone: Whether each was computed on its own, and not as one of a distant pair, shape (beads,).
        settings: Correlation lengths (3), errors of velocities and of derivatives, over the standard deviation of the
            velocities.
    """

    box: Mapping[str, Sequence[float]]
    places: Array
    velocities: Array
    by_beta: Array
    alone: Flags
    settings: Array

    @classmethod
    def of_file(cls, box: Mapping[str, Sequence[float]], arrays: dict[str, Any]) -> Self:
        """The single beads of a file of an atlas, whose arrays are removed from `arrays`."""
        return cls(box, *(arrays.pop(f"{PREFIX}{each.name}") for each in fields(cls)[1:]))

    @property
    def arrays(self) -> dict[str, Array]:
        """Its arrays by their names in a file."""
        return {f"{PREFIX}{each.name}": getattr(self, each.name) for each in fields(self)[1:]}

    @property
    def singles(self) -> tuple[Array, Array]:
        """Places and velocities of those that were computed on their own."""
        return self.places[self.alone], self.velocities[self.alone]

    @property
    def mean(self) -> float:
        """Mean of the velocities, about which the kriging interpolates."""
        return float(self.velocities.mean())

    @property
    def size(self) -> float:
        """Standard deviation of the velocities."""
        return float(self.velocities.std()) or 1.0

    def kriging_by(self, settings: Array) -> Kriging:
        """The kriging of the velocities less their mean, over their standard deviation."""
        x, slopes = scaled(self.box, self.places)
        data = np.full((1 + len(PARAMETERS), len(x), 1), np.nan)
        data[0, :, 0] = (self.velocities - self.mean) / self.size
        data[1, :, 0] = self.by_beta / slopes[:, 0] / self.size
        lengths, (of_values, of_slopes) = np.split(settings, [len(PARAMETERS)])
        errors = np.full(data.shape[:2], of_slopes)
        errors[0] = of_values
        return Kriging.of(x, data, errors, lengths, ())

    @cached_property
    def kriging(self) -> Kriging:
        """The kriging with the stored settings."""
        return self.kriging_by(self.settings)

    def __call__(self, places: Array) -> tuple[Array, Array]:
        """Velocities at places, (places,), and their derivatives by beta, De and Ca_e, (3, places)."""
        x, slopes = scaled(self.box, places)
        found = self.kriging(x)[0][:, :, 0] * self.size
        return found[0] + self.mean, found[1:] * slopes.T

    @cached_property
    def width(self) -> float:
        """Factor from a standard deviation to a half-width, which holds `COVERED` of the beads that are left out."""
        residuals, spreads = self.kriging.left_out()
        return float(np.quantile(np.abs(residuals[:, 0]) / spreads, COVERED))

    def values(self, places: Array) -> tuple[Array, Array]:
        """Velocities at places and half-widths of their intervals, (places,) each."""
        found, spread = self.kriging.values(scaled(self.box, places)[0])
        return found[:, 0] * self.size + self.mean, self.width * self.size * spread
