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

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from pairsim.runtime.arrays import Array

WAVES = 400  # wave numbers between 0 and pi in means and maxima over all; chosen
ROUNDING = 1e-9  # of rates that vanish by reversibility, relative to the others; 1e-11 was measured
BEYOND = 8.0  # factor of what the rest of the row is expected to change; long waves have the squares of distances
EARLIEST, LATEST = 1e-6, 1e12  # times between which a spread is followed [D_c/U_av]; chosen


@dataclass(frozen=True)
class Spectrum:
    """Growth rates of the disturbances of a train [U_av/D_c].

    Attributes:
        rates: lambda(2 pi m/n), m = 0, ..., n - 1, complex, of an even number n of at least 2.
        others: The same otherwise computed, (any, n); what they differ by is part of the errors.
    """

    rates: Array
    others: Array

    @property
    def waves(self) -> Array:
        """Wave numbers of the cell up to pi, without 0 [1/spacing], (n/2,)."""
        count = len(self.rates)
        return np.asarray(2 * np.pi * np.arange(1, count // 2 + 1) / count)

    def growth(self, k: Array) -> tuple[Array, Array]:
        """Growth rates at wave numbers, and the half-widths of their intervals without the rest of the row."""
        scaled, error = self._scaled(k)
        return 2 * (1 - np.cos(k)) * scaled, 2 * (1 - np.cos(k)) * error

    def frequency(self, k: Array) -> tuple[Array, Array]:
        """Frequencies at wave numbers, positive where waves travel upstream past the particles, and half-widths."""
        shapes = np.sin(np.outer(k, self._neighbours))
        return shapes @ self._row[1], np.abs(shapes) @ self._row_error[1]

    @cached_property
    def everywhere(self) -> tuple[Array, Array, Array]:
        """Wave numbers from 0 to pi, growth rates over 2 (1 - cos k) there, and the half-widths of their intervals."""
        k = np.linspace(0.0, np.pi, WAVES + 1)
        (scaled, error), half = self._scaled(k), Spectrum(self.rates[::2], self.others[:, ::2])
        sizes = np.abs(self._row).sum(axis=0)
        near, far = np.split(sizes, [-(-len(sizes) // 2)])
        rest = min(1.0, BEYOND * float(far.sum() / near.sum()))  # if the row goes on to fall off as there
        return k, scaled, error + rest * np.abs(scaled - half._scaled(k)[0])

    @property
    def fastest(self) -> tuple[float, float, float]:
        """The wave that grows fastest or, where all decay, decays fastest: k, growth rate and half-width."""
        k, scaled, error = self.everywhere
        growth = 2 * (1 - np.cos(k)) * scaled
        at = int(growth.argmax() if self.verdict == "clusters" else abs(growth).argmax())
        return float(k[at]), float(growth[at]), float(2 * (1 - np.cos(k[at])) * error[at])

    @property
    def diffusion(self) -> tuple[float, float]:
        """The coefficient C of the growth rate -C k^2 of long waves, and the half-width of its interval [U_av/D_c]."""
        _, scaled, error = self.everywhere
        return -float(scaled[0]), float(error[0])

    @property
    def least_stable(self) -> tuple[float, float]:
        """The largest growth rate over 2 (1 - cos k), above 0 where a wave grows, and its half-width [U_av/D_c]."""
        _, scaled, error = self.everywhere
        at = int(scaled.argmax())
        return float(scaled[at]), float(error[at])

    @property
    def verdict(self) -> str:
        """What becomes of disturbances: "orders", "clusters", "neither" or "undecided".

        All decay; some grow; all keep their size, but for rounding; or none of these is certain.
        """
        if np.abs(self._row[0]).max() <= ROUNDING * np.abs(self._row[1]).max():
            return "neither"
        _, scaled, error = self.everywhere
        return "clusters" if (scaled > error).any() else "orders" if (scaled < -error).all() else "undecided"

    def time_to(self, factor: float) -> tuple[float, float, float]:
        """Time in which the spread of the distances of a train changes by a factor [D_c/U_av].

        Its distances are independent at first: all waves are there in equal parts, and the square of the spread is the
        mean of exp(2 growth t) over them, as long as disturbances are small.

        Returns:
            The time, the least and the largest by the intervals of the rates; infinite where there is none.
        """
        k, scaled, error = (each[1:] for each in self.everywhere)
        times = [_time_to(2 * (1 - np.cos(k)) * (scaled + part * error), factor) for part in (0, -1, 1)]
        return times[0], min(times), max(times)

    def _scaled(self, k: Array) -> tuple[Array, Array]:
        """Growth rates over 2 (1 - cos k), and their half-widths without the rest of the row."""
        half = np.maximum(k, 1e-8)[:, None] / 2
        shapes = (np.sin(half * self._neighbours) / np.sin(half)) ** 2 / 2
        return -shapes @ self._row[0], shapes @ self._row_error[0]

    @property
    def _neighbours(self) -> Array:
        return np.arange(1.0, len(self.rates) // 2 + 1)

    @cached_property
    def _row(self) -> Array:
        return _folded(self.rates)

    @cached_property
    def _row_error(self) -> Array:
        differences = np.abs([_folded(other) - self._row for other in self.others])
        return np.asarray(differences.sum(axis=0) + ROUNDING * np.abs(self._row).max())


def _folded(rates: Array) -> Array:
    """The parts of a row that growth rates and frequencies are made of, for neighbours j = 1, ..., n/2, (2, n/2).

    They are multiplied by -(1 - cos(k j)) and sin(k j). The last neighbour is that on both sides.
    """
    n = len(rates)
    row, j = np.real(np.fft.ifft(rates)), np.arange(1, n // 2 + 1)
    return np.array([np.where(2 * j == n, 0.5, 1.0) * (row[j] + row[-j]), row[-j] - row[j]])


def _time_to(growth: Array, factor: float) -> float:
    """When the root of the mean of exp(2 growth t) is the factor; infinite if never."""

    def above(log_t: float) -> float:
        return float(scipy.special.logsumexp(2 * growth * np.exp(log_t), b=factor**-2 / len(growth)))

    start, end = np.log([EARLIEST, LATEST]).tolist()
    return float(np.exp(scipy.optimize.brentq(above, start, end))) if above(start) * above(end) < 0 else np.inf
