"""How particles arrive: their initial distances, and by how much they differ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from pairsim.runtime.arrays import Array

CUT = 3.0  # standard deviations at which the differences of particles are cut off; chosen


@dataclass(frozen=True)
class Arrivals:
    """How the particles of streams arrive.

    Attributes:
        kind: At random, as by a Poisson process whose particles do not overlap, or regularly.
        jitter: Standard deviation of the places of those that arrive regularly, over their spacing.
        length: Length of a particle [D_c].
        contact: Smallest distance between facing surfaces [D_c].
        diameter: Standard deviation of the diameters over their mean.
        modulus: Standard deviation of the moduli over their mean.
    """

    kind: Literal["random", "regular"]
    jitter: float
    length: float
    contact: float
    diameter: float
    modulus: float

    def draw(self, random: np.random.Generator, mean: float, count: int) -> tuple[Array, Array]:
        """Draw one stream.

        Args:
            random: Generator of random numbers.
            mean: Mean distance between facing surfaces [D_c].
            count: Number of particles.

        Returns:
            Initial distances between facing surfaces from upstream [D_c], shape (count - 1,), and the result of
            `parts`.
        """
        parts = self.parts(random, count)
        if self.kind == "random":
            return self.contact + random.exponential(mean - self.contact, count - 1), parts
        spacing = mean + self.length
        centres = np.sort(spacing * (np.arange(count) + self.jitter * random.standard_normal(count)))
        return self.between(centres, parts), parts

    def parts(self, random: np.random.Generator, count: int) -> Array:
        """Deviations of the logarithms of diameter and Ca_e of so many particles, shape (count, 2)."""
        normal = np.clip(random.standard_normal((count, 2)), -CUT, CUT)
        return np.asarray(normal * [self.diameter, -self.modulus])  # Ca_e is inverse to the modulus

    def between(self, centres: Array, parts: Array) -> Array:
        """Distances between the facing surfaces of particles with centres in ascending order [D_c], (count - 1,)."""
        radii = self.length / 2 * (1 + parts[:, 0])
        return np.asarray(np.maximum(np.diff(centres) - radii[1:] - radii[:-1], self.contact))
