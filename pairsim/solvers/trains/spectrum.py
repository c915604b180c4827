"""Growth rates of all disturbances of an infinite train, with their errors, and the evolution of a spread of distances.

A unit displacement of particle 0 of a train changes the velocity of particle j by b_j, and waves exp(i k j) grow at the
rate

    lambda(k) = sum_j b_j exp(-i k j),    b_0 = -sum of the others.

A cell of n particles has the rates of the infinite train at k = 2 pi m/n (`pairsim.solvers.trains.response`). At other
k, lambda is computed from the coefficients b_j, -n/2 < j <= n/2, that belong to these rates. The effect of the omitted
coefficients is judged by those that belong to every second rate, as in a cell of n/2, and by how fast the b_j decay
with j. The error due to the cells of the mesh is judged by the change of the b_j on larger cells: all changes count
with their worst signs, so that the error vanishes with lambda at k = 0.

The growth rate over 2 (1 - cos k) is finite at k = 0, where it is the coefficient -C of k^2 of long waves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy

from pairsim.runtime.arrays import Array

WAVES = 400  # number of wave numbers from 0 to pi for means and maxima over all waves; chosen
NEGLIGIBLE_RATE = 1e-9  # relative size of rates that vanish by reversibility; 1e-11 was measured
BEYOND = 8.0  # factor of the expected effect of omitted b_j, as these count with j^2 in long waves
EARLIEST, LATEST = 1e-6, 1e12  # range of times in which a change of the spread is searched for [D_c/U_av]; chosen


class Wave(NamedTuple):
    """A disturbance of a train: its wave number and its rates, each with its half-width in `..._error`.

    Attributes:
        k: Wave number [1/spacing].
        scaled: Growth rate over 2 (1 - cos k) [U_av/D_c].
        growth: Growth rate [U_av/D_c].
        frequency: Angular frequency, positive where the wave travels upstream past the particles [U_av/D_c].
    """

    k: float
    scaled: float
    scaled_error: float
    growth: float
    growth_error: float
    frequency: float
    frequency_error: float


@dataclass(frozen=True)
class Waves:
    """Several waves, with the attributes of `Wave` as arrays of shape (waves,)."""

    k: Array
    scaled: Array
    scaled_error: Array
    growth: Array
    growth_error: Array
    frequency: Array
    frequency_error: Array

    def __getitem__(self, number: int) -> Wave:
        return Wave(*(float(values[number]) for values in vars(self).values()))

    def __iter__(self) -> Iterator[Wave]:
        return map(self.__getitem__, range(len(self.k)))


@dataclass(frozen=True)
class Spectrum:
    """Growth rates of the disturbances of a train [U_av/D_c].

    Attributes:
        rates: lambda(2 pi m/n), m = 0, ..., n - 1, complex, for an even number n of at least 2.
        others: The same rates from other computations, such as on larger cells, (any, n); their differences from
            `rates` are part of the errors.
    """

    rates: Array
    others: Array

    @property
    def waves(self) -> tuple[Array, Array]:
        """Waves of the cell with 0 < k <= pi: their wave numbers and complex growth rates, (n/2,) each."""
        m = np.arange(1, len(self.rates) // 2 + 1)
        return 2 * np.pi * m / len(self.rates), self.rates[m]

    @property
    def of_cell(self) -> Waves:
        """The waves of the cell, those of `waves`, with their half-widths."""
        return self.at(self.waves[0])

    def at(self, k: Array, rest: float = 0.0) -> Waves:
        """Waves of given wave numbers, with half-widths.

        Args:
            k: The wave numbers [1/spacing], (waves,).
            rest: Fraction of the difference from the result with every second rate of the cell only that is added to
                the half-widths of growth rates, for the omitted b_j.
        """
        row, half = _folded(self.rates), np.maximum(k, 1e-8)[:, None] / 2
        off = np.abs([_folded(other) - row for other in self.others]).sum(axis=0) + NEGLIGIBLE_RATE * np.abs(row).max()
        j = np.arange(1, len(self.rates) // 2 + 1)
        shapes = -((np.sin(half * j) / np.sin(half)) ** 2) / 2, np.sin(2 * half * j)
        scaled, scaled_error = shapes[0] @ row[0], np.abs(shapes[0]) @ off[0]
        if rest:
            scaled_error += rest * np.abs(scaled - Spectrum(self.rates[::2], self.others[:, ::2]).at(k).scaled)
        growth, growth_error = (2 * (1 - np.cos(k)) * each for each in (scaled, scaled_error))
        frequency, frequency_error = shapes[1] @ row[1], np.abs(shapes[1]) @ off[1]
        return Waves(k, scaled, scaled_error, growth, growth_error, frequency, frequency_error)

    @cached_property
    def everywhere(self) -> Waves:
        """Waves of `WAVES` + 1 wave numbers from 0 to pi."""
        sizes = np.abs(_folded(self.rates)).sum(axis=0)
        near, far = np.split(sizes, [-(-len(sizes) // 2)])
        rest = min(1.0, BEYOND * float(far.sum() / near.sum()))  # as if the b_j continued to decay at this rate
        return self.at(np.linspace(0.0, np.pi, WAVES + 1), rest)

    @property
    def fastest(self) -> Wave:
        """The wave that grows fastest if the train clusters, otherwise the one that grows or decays fastest."""
        growth = self.everywhere.growth
        return self.everywhere[int((growth if self.verdict == "clusters" else np.abs(growth)).argmax())]

    @property
    def least_stable(self) -> Wave:
        """The wave whose growth rate over 2 (1 - cos k) is largest; this rate is above 0 if any wave grows."""
        return self.everywhere[int(self.everywhere.scaled.argmax())]

    @property
    def verdict(self) -> str:
        """The fate of disturbances: "orders", "clusters", "neither" or "undecided".

        In this order: all decay; some grow; all keep their size, up to rounding errors; none of these is certain.
        """
        growing, turning = np.abs(_folded(self.rates)).max(axis=1)
        if growing <= NEGLIGIBLE_RATE * turning:
            return "neither"
        scaled, error = self.everywhere.scaled, self.everywhere.scaled_error
        return "clusters" if (scaled > error).any() else "orders" if (scaled < -error).all() else "undecided"

    def time_to(self, factor: float) -> tuple[float, float, float]:
        """Time in which the spread of the distances of a train changes by a factor [D_c/U_av].

        The distances are taken to be independent at first: all waves have the same amplitude, and as long as
        disturbances are small the square of the spread is proportional to the mean of exp(2 growth t) over all waves.

        Returns:
            The time, and the smallest and largest time according to the half-widths of the rates; all infinite if there
            is no such time for one of these.
        """
        growth, error = self.everywhere.growth[1:], self.everywhere.growth_error[1:]
        ends = np.log([EARLIEST, LATEST]).tolist()

        def above(log_t: float, part: int) -> float:
            """Logarithm of the ratio of the square of the spread's change at this time to that of `factor`.

            Args:
                log_t: Logarithm of the time.
                part: Multiple of the half-widths that is added to the growth rates: 0, 1 or -1.
            """
            rates = 2 * (growth + part * error) * np.exp(log_t)
            return float(scipy.special.logsumexp(rates, b=factor**-2 / len(growth)))

        if any(above(ends[0], part) * above(ends[1], part) >= 0 for part in (0, 1, -1)):
            return np.inf, np.inf, np.inf
        times = [float(np.exp(scipy.optimize.brentq(above, *ends, args=(part,)))) for part in (0, 1, -1)]
        return times[0], min(times), max(times)


def _folded(rates: Array) -> Array:
    """Coefficients of growth rates (first row) and frequencies, for neighbours j = 1, ..., n/2, (2, n/2).

    A growth rate is the sum over j of the first ones, b_j + b_-j, times -(1 - cos(k j)); a frequency is the sum of the
    second ones, b_-j - b_j, times sin(k j). The neighbour j = n/2, which is the same on both sides, counts once.
    """
    n = len(rates)
    row, j = np.real(np.fft.ifft(rates)), np.arange(1, n // 2 + 1)
    return np.array([np.where(2 * j == n, 0.5, 1.0) * (row[j] + row[-j]), row[-j] - row[j]])
