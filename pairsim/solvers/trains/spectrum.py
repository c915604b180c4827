"""Growth rates of all disturbances of an infinite train, with their errors, and what becomes of a spread of distances.

Moving particle 0 of a train changes the velocity of particle j by b_j, and waves exp(i k j) grow at the rate

    lambda(k) = sum_j b_j exp(-i k j),    b_0 = -sum of the others.

A cell of n has the rates of the infinite train at k = 2 pi m/n (`pairsim.solvers.trains.response`). Between these
lambda is that of the row b_j, -n/2 < j <= n/2, which follows from them. By how much the rest of the row changes it is
judged by the row that follows from every second one, as in a cell of n/2, and by how fast the row falls off. The error
by the cells of the mesh is by how much larger ones change the row: of all changes at their worst signs, so that it
vanishes with lambda at k = 0.

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

WAVES = 400  # wave numbers between 0 and pi in means and maxima over all; chosen
NEGLIGIBLE_RATE = 1e-9  # of rates that vanish by reversibility, relative to the others; 1e-11 was measured
BEYOND = 8.0  # factor of what the rest of the row is expected to change; long waves have the squares of distances
EARLIEST, LATEST = 1e-6, 1e12  # times between which a spread is followed [D_c/U_av]; chosen


class Wave(NamedTuple):
    """A disturbance of a train: its number, its rates and the half-widths of their intervals.

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
    """Several waves, with what `Wave` has of each in arrays of shape (waves,)."""

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
        rates: lambda(2 pi m/n), m = 0, ..., n - 1, complex, of an even number n of at least 2.
        others: Rates as other computations have them, such as on larger cells, (any, n); differences from `rates` are
            part of the errors.
    """

    rates: Array
    others: Array

    @property
    def waves(self) -> tuple[Array, Array]:
        """Waves of the cell up to k = pi, without k = 0: their numbers and complex growth rates, (n/2,) each."""
        m = np.arange(1, len(self.rates) // 2 + 1)
        return 2 * np.pi * m / len(self.rates), self.rates[m]

    @property
    def of_cell(self) -> Waves:
        """The waves of the cell, as in `waves`, with the half-widths of their intervals."""
        return self.at(self.waves[0])

    def at(self, k: Array, rest: float = 0.0) -> Waves:
        """Waves of given numbers; half-widths have a part of what every second wave of the cell alone would change."""
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
        """Waves of all numbers from 0 to pi."""
        sizes = np.abs(_folded(self.rates)).sum(axis=0)
        near, far = np.split(sizes, [-(-len(sizes) // 2)])
        rest = min(1.0, BEYOND * float(far.sum() / near.sum()))  # if the row goes on to fall off as there
        return self.at(np.linspace(0.0, np.pi, WAVES + 1), rest)

    @property
    def fastest(self) -> Wave:
        """The wave that grows fastest or, where all decay, decays fastest."""
        growth = self.everywhere.growth
        return self.everywhere[int((growth if self.verdict == "clusters" else np.abs(growth)).argmax())]

    @property
    def least_stable(self) -> Wave:
        """The wave whose growth rate over 2 (1 - cos k) is largest, above 0 where any wave grows."""
        return self.everywhere[int(self.everywhere.scaled.argmax())]

    @property
    def verdict(self) -> str:
        """What becomes of disturbances: "orders", "clusters", "neither" or "undecided".

        All decay; some grow; all keep their size, but for rounding; or none of these is certain.
        """
        growing, turning = np.abs(_folded(self.rates)).max(axis=1)
        if growing <= NEGLIGIBLE_RATE * turning:
            return "neither"
        scaled, error = self.everywhere.scaled, self.everywhere.scaled_error
        return "clusters" if (scaled > error).any() else "orders" if (scaled < -error).all() else "undecided"

    def time_to(self, factor: float) -> tuple[float, float, float]:
        """Time in which the spread of the distances of a train changes by a factor [D_c/U_av].

        Its distances are independent at first: all waves are there in equal parts, and the square of the spread is the
        mean of exp(2 growth t) over them, as long as disturbances are small.

        Returns:
            The time, the least and the largest by the intervals of the rates; infinite where there is none.
        """
        growth, error = self.everywhere.growth[1:], self.everywhere.growth_error[1:]
        ends = np.log([EARLIEST, LATEST]).tolist()

        def above(log_t: float, part: int) -> float:
            """Logarithm of the square of the change until then over that wanted."""
            rates = 2 * (growth + part * error) * np.exp(log_t)
            return float(scipy.special.logsumexp(rates, b=factor**-2 / len(growth)))

        if any(above(ends[0], part) * above(ends[1], part) >= 0 for part in (0, 1, -1)):
            return np.inf, np.inf, np.inf
        times = [float(np.exp(scipy.optimize.brentq(above, *ends, args=(part,)))) for part in (0, 1, -1)]
        return times[0], min(times), max(times)


def _folded(rates: Array) -> Array:
    """The parts of a row that growth rates and frequencies are made of, for neighbours j = 1, ..., n/2, (2, n/2).

    They are multiplied by -(1 - cos(k j)) and sin(k j). The last neighbour is that on both sides.
    """
    n = len(rates)
    row, j = np.real(np.fft.ifft(rates)), np.arange(1, n // 2 + 1)
    return np.array([np.where(2 * j == n, 0.5, 1.0) * (row[j] + row[-j]), row[-j] - row[j]])
