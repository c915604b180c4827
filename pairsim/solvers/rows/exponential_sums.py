"""Sums of exponentials of the distances, as which neighbours contribute, and the size of what such a sum leaves out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy

from pairsim.runtime.arrays import Array

SMALLEST = 1e-5  # singular values below this fraction of the largest one are left out of a fit; chosen


@dataclass(frozen=True)
class ExponentialSum:
    """Contribution of k neighbours to derivatives of their velocities, a sum of exponentials of their distances.

    Attributes:
        rates: Rates at which each of m terms decays with each of the distances [1/D_c], shape (m, k-1).
        coefficients: The coefficients of the terms, shape (m, ...).
    """

    rates: Array
    coefficients: Array

    def at(self, windows: Array) -> Array:
        """The sums of the terms at distances between k neighbours, (n, k-1) [D_c], shape (n, ...)."""
        return np.tensordot(np.exp(-windows @ self.rates.T), self.coefficients, 1)

    def slopes(self, gaps: Array) -> Array:
        """For pairs, derivatives of these sums with respect to the distance, at distances (n,) [D_c], (n, ...)."""
        return np.tensordot(-self.rates[:, 0] * np.exp(-gaps[:, None] * self.rates[:, 0]), self.coefficients, 1)

    @classmethod
    def fitted(cls, rates: Array, places: Array, values: Array) -> ExponentialSum:
        """Fit terms of given rates to values at some distances, by least squares.

        Args:
            rates: The rates of the terms [1/D_c], shape (m, k-1).
            places: The distances between k neighbours [D_c], shape (n, k-1).
            values: The values there, shape (n, ...).
        """
        terms = np.exp(-places @ rates.T)
        size = np.abs(terms).max(axis=0)
        fit = scipy.linalg.lstsq(terms / size, values.reshape(len(places), -1), cond=SMALLEST)[0] / size[:, None]
        return cls(rates, fit.reshape(len(rates), *values.shape[1:]))


def slowest(rates: Array, most: int) -> Array:
    """Of the rates of terms, (m, k-1), those of the at most `most` terms that decay most slowly."""
    return np.asarray(rates[rates.sum(axis=1).argsort(kind="stable")[:most]])


@dataclass(frozen=True)
class Remainder:
    """A change of the last terms of a series by as much as the series may leave out, from which errors are judged.

    There are terms of `count` neighbours for each set of so many particles in succession. A relative velocity depends
    on those of `count + 1` sets. If all of these were changed at once, the changes might cancel in one row and not in
    the next. Therefore only the terms of every (`count` + 1)th set along the row are changed. The changes of all
    `phases` together change each set once.

    Attributes:
        count: Number of neighbours of a term.
        phase: Index of the first set that is changed, which is that of its first particle.
        distances: Mean distances of the neighbours, ascending [D_c], shape (m,).
        parts: Fraction by which a term becomes smaller at these distances, shape (m,).
    """

    count: int
    phase: int
    distances: Array
    parts: Array

    @classmethod
    def phases(cls, count: int, distances: Array | None = None, parts: Array | None = None) -> list[Self]:
        """The changes that together change each set of neighbours once; without `parts`, terms are left out."""
        distances, parts = (np.ones(1) if each is None else each for each in (distances, parts))
        return [cls(count, phase, distances, parts) for phase in range(count + 1)]

    def factors(self, windows: Array) -> Array:
        """The factors of the terms of each set along a row, at its distances (w, count - 1) [D_c], shape (w, 1)."""
        factors = np.ones(len(windows))
        chosen = slice(self.phase, None, self.count + 1)
        factors[chosen] -= np.interp(windows[chosen].mean(axis=1), self.distances, self.parts)
        return factors[:, None]
