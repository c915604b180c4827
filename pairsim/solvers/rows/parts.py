"""Sums of exponentials of the distances, of which what neighbours add is made, and what may be left out of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy

from pairsim.runtime.arrays import Array

SMALLEST = 1e-5  # singular values that are left out, relative to the largest; chosen


@dataclass(frozen=True)
class Parts:
    """What a number of neighbours add to derivatives of their velocities.

    Attributes:
        rates: Those at which each term decays with every distance [1/D_c], shape (m, k-1) for k particles.
        coefficients: Those of the terms, shape (m, ...).
    """

    rates: Array
    coefficients: Array

    def at(self, windows: Array) -> Array:
        """Their sums at distances of so many neighbours, (n, k-1) [D_c], shape (n, ...)."""
        return np.tensordot(np.exp(-windows @ self.rates.T), self.coefficients, 1)

    def slopes(self, gaps: Array) -> Array:
        """Their derivatives by the distance of pairs, (n,) [D_c], shape (n, ...)."""
        return np.tensordot(-self.rates[:, 0] * np.exp(-gaps[:, None] * self.rates[:, 0]), self.coefficients, 1)

    @classmethod
    def fitted(cls, rates: Array, places: Array, values: Array) -> Parts:
        """The parts, of the slowest rates, that are nearest to values at places."""
        terms = np.exp(-places @ rates.T)
        size = np.abs(terms).max(axis=0)
        fit = scipy.linalg.lstsq(terms / size, values.reshape(len(places), -1), cond=SMALLEST)[0] / size[:, None]
        return cls(rates, fit.reshape(len(rates), *values.shape[1:]))


def slowest(rates: Array, most: int) -> Array:
    """So many of the rates of terms, (m, k-1), that decay most slowly."""
    return np.asarray(rates[rates.sum(axis=1).argsort(kind="stable")[:most]])


@dataclass(frozen=True)
class Remainder:
    """What may be left out of a series of terms, as a change of some of its last ones.

    A relative velocity has terms of `count + 1` sets of as many neighbours, and so has what is left out. They may
    cancel each other in one row and not in the next. Therefore only those of one of these sets each are changed, where
    the first particle is every `count + 1`th; with all `phases` each set has its turn.

    Attributes:
        count: Neighbours of a term.
        phase: The first particle of the first set that is changed.
        distances: Mean distances of the neighbours, ascending [D_c], shape (m,).
        parts: By which part of itself a term is made smaller there, shape (m,).
    """

    count: int
    phase: int
    distances: Array
    parts: Array

    @classmethod
    def phases(cls, count: int, distances: Array | None = None, parts: Array | None = None) -> list[Self]:
        """Those that change each set of neighbours once; terms are left out altogether where no parts are given."""
        distances, parts = (np.ones(1) if each is None else each for each in (distances, parts))
        return [cls(count, phase, distances, parts) for phase in range(count + 1)]

    def factors(self, windows: Array) -> Array:
        """Those of the terms of neighbours at their distances along a row, (w, count - 1) [D_c], shape (w, 1)."""
        factors = np.ones(len(windows))
        chosen = slice(self.phase, None, self.count + 1)
        factors[chosen] -= np.interp(windows[chosen].mean(axis=1), self.distances, self.parts)
        return factors[:, None]
