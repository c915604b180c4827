"""Velocities of a row of any number of equal particles, from those of rows of up to four.

What a particle does in a row is what it does alone, and what its neighbours change: each pair of neighbours, what a
third one changes in that, and a fourth one. With the velocities U of short rows, the part W of k particles is what is
left of U when the parts of all shorter rows of neighbours among them are subtracted (the cumulant expansion of a
chain). Particles that are not neighbours have no part of their own: whatever reaches one from another has passed those
between, which is why sums of pairs are so poor and this series converges (measured: by a factor of 4 to 7 with each
particle at a distance of d = 0.1, of 3 at 0.2 in a liquid with De = 1).

The parts are sums of products of exponentials of the distances, as which disturbances of the flow in a tube decay,
fitted to solutions and their derivatives by the distances.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view

from pairsim.runtime.arrays import Array
from pairsim.solvers.rows.short_rows import ShortRow

RATES = np.geomspace(1.0, 8.0, 16)  # of the slowest exponential, which are tried [1/D_c]; chosen
POWERS = {2: 5, 3: 3, 4: 1}  # how many more exponentials there are, by the number of particles; chosen
TRUSTED = 1e-3  # part of the largest |dU| down to which solutions are the better the smaller their error is; chosen
SLOPES = 0.1  # weight of slopes, which are known to first order in what moving changes; chosen
SMALLEST = 1e-4  # singular values that are left out, relative to the largest; chosen


@dataclass(frozen=True)
class Part:
    """What k particles add to the velocities of each other beyond what fewer of them do.

    Attributes:
        rate: Rate at which the slowest exponential decays [1/D_c].
        powers: Powers of exp(-rate d) of every distance in each term, shape (m, k-1), all at least 1.
        U: Coefficients of the velocities [U_av], shape (m, k).
        lengths: Those of the distances between centres less those between surfaces [D_c], shape (m, k-1).
    """

    rate: float
    powers: Array
    U: Array
    lengths: Array

    @property
    def count(self) -> int:
        """Number of particles k."""
        return self.powers.shape[1] + 1

    def terms(self, gaps: Array) -> Array:
        """The terms at distances of shape (w, k-1): shape (w, m)."""
        return np.exp(-self.rate * gaps @ self.powers.T)

    def slopes(self, gaps: Array) -> Array:
        """Their derivatives by each distance, shape (w, m, k-1)."""
        return -self.rate * self.terms(gaps)[:, :, None] * self.powers


@dataclass(frozen=True)
class RowModel:
    """Velocities and lengths of rows of equal particles.

    Attributes:
        U: Velocity of a single particle [U_av].
        length: Its length along the tube [D_c].
        parts: What two, three, ... neighbours add.
        least: Distance below which nothing was solved, and velocities are those at it [D_c].
    """

    U: float
    length: float
    parts: tuple[Part, ...]
    least: float

    def velocities(self, gaps: Array) -> Array:
        """Velocities of N particles at distances of shape (N-1,) [U_av], shape (N,)."""
        U = np.full(len(gaps) + 1, self.U)
        for part, windows in self._windows(gaps):
            _spread(part.terms(windows) @ part.U, U)
        return U

    def lengths(self, gaps: Array) -> Array:
        """What the distances between centres exceed the distances by [D_c], shape (N-1,)."""
        lengths = np.full(len(gaps), self.length)
        for part, windows in self._windows(gaps):
            _spread(part.terms(windows) @ part.lengths, lengths)
        return lengths

    def slopes(self, gaps: Array) -> Array:
        """Derivatives of the velocities by every distance [U_av/D_c], shape (N, N-1)."""
        return self._slopes(gaps, len(gaps) + 1, lambda part: part.U)

    def length_slopes(self, gaps: Array) -> Array:
        """Derivatives of the lengths by every distance, shape (N-1, N-1)."""
        return self._slopes(gaps, len(gaps), lambda part: part.lengths)

    def _slopes(self, gaps: Array, count: int, coefficients: Callable[[Part], Array]) -> Array:
        found = np.zeros((count, len(gaps)))
        for part, windows in self._windows(gaps):
            solved = sliding_window_view(gaps >= self.least, part.count - 1)[:, None, :]
            values = np.einsum("mi,wmj->wij", coefficients(part), part.slopes(windows) * solved)
            first = np.arange(len(windows))[:, None, None]
            np.add.at(found, (first + np.arange(values.shape[1])[:, None], first + np.arange(part.count - 1)), values)
        return found

    def rates(self, gaps: Array, U: Array | None = None) -> Array:
        """Rates of the distances [U_av], shape (N-1,), at which those between centres change as the velocities say."""
        U = self.velocities(gaps) if U is None else U
        return np.asarray(np.linalg.solve(np.eye(len(gaps)) + self.length_slopes(gaps), np.diff(U)))

    def _windows(self, gaps: Array) -> list[tuple[Part, Array]]:
        """Each part with the distances of all neighbours of its number, (w, k-1)."""
        known = np.maximum(gaps, self.least)
        return [
            (part, sliding_window_view(known, part.count - 1)) for part in self.parts if part.count <= len(gaps) + 1
        ]

    def with_part_of(self, rows: Sequence[ShortRow]) -> RowModel:
        """The model with the part of one particle more, fitted to rows of so many."""
        gaps = np.array([row.gaps for row in rows])
        count = gaps.shape[1] + 1
        values, changes, errors = [], [], np.array([row.dU_error for row in rows])
        for row in rows:
            d = row.gaps
            values.append(np.concatenate([row.U - self.velocities(d), row.lengths - self.lengths(d)]))
            changes.append(np.vstack([row.U_slopes - self.slopes(d), row.length_slopes - self.length_slopes(d)]))
        rates = RATES if count == 2 else [self.parts[0].rate]
        largest = max(np.abs(np.diff(row.U)).max() for row in rows)
        weights = 1 / np.maximum(errors, TRUSTED * largest) if largest else np.ones(len(rows))
        fits = [_fitted(rate, gaps, np.array(values), np.array(changes), weights) for rate in rates]
        part = min(fits, key=lambda fit: fit[0])[1]
        return RowModel(self.U, self.length, (*self.parts, part), min(self.least, float(gaps.min())))


def _spread(values: Array, along: Array) -> None:
    """Add values of shape (w, k), of windows that begin at 0, 1, ..., to a row."""
    for i, column in enumerate(values.T):
        along[i : i + len(column)] += column


def _fitted(rate: float, gaps: Array, values: Array, slopes: Array, weights: Array) -> tuple[float, Part]:
    """The part whose values and slopes are nearest to given ones, and what it misses of them.

    Args:
        rate: Rate of the slowest exponential [1/D_c].
        gaps: Distances, shape (p, k-1).
        values: Shape (p, 2 k - 1), of velocities and lengths.
        slopes: Their derivatives by each distance, shape (p, 2 k - 1, k-1).
        weights: Of every solution, shape (p,).
    """
    count = gaps.shape[1] + 1
    most = POWERS[count]
    powers = np.array([p for p in product(range(1, most + 2), repeat=count - 1) if sum(p) <= most + count - 1])
    part = Part(rate, powers, np.zeros((len(powers), count)), np.zeros((len(powers), count - 1)))
    scale = 1 / RATES[-1]  # one for all rates, that what they miss can be compared [D_c]
    rows = np.concatenate([part.terms(gaps), scale * part.slopes(gaps).transpose(0, 2, 1).reshape(-1, len(powers))])
    wanted = np.concatenate([values, scale * slopes.transpose(0, 2, 1).reshape(-1, values.shape[1])])
    weight = np.concatenate([weights, SLOPES * np.repeat(weights, count - 1)])[:, None]
    rows, wanted = weight * rows, weight * wanted
    size = np.abs(rows).max(axis=0)
    found = scipy.linalg.lstsq(rows / size, wanted, cond=SMALLEST)[0] / size[:, None]
    missed = float(np.sqrt(np.mean((rows @ found - wanted)[:, :count] ** 2)))
    return missed, Part(rate, powers, found[:, :count], found[:, count:])
