"""Velocities of a row of any number of equal particles, from those of rows of up to five.

What a particle does in a row is what it does alone, and what its neighbours change: each pair of neighbours, what a
third one changes in that, and a fourth and fifth one. With the velocities U of short rows, the part W of k particles is
what is left of U when the parts of all shorter rows of neighbours among them are subtracted (the cumulant expansion of
a chain). Particles that are not neighbours have no part of their own: whatever reaches one from another has passed
those between, which is why sums of pairs are so poor and this series converges (measured: by a factor of 4 to 7 with
each particle at a distance of d = 0.1, of 3 at 0.2 in a liquid with De = 1).

The parts are sums of products of exponentials of the distances, as which disturbances of the flow in a tube decay. All
are fitted together: to solutions of short rows, to their derivatives by the distances, and to the growth rates of
infinite trains, in which errors of slopes that short rows do not show would add up. Lengths of particles have such
parts, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view

from pairsim.runtime.arrays import Array

RATES = np.geomspace(1.0, 8.0, 16)  # of the slowest exponential, which are tried [1/D_c]; chosen
POWERS = {2: 6, 3: 4, 4: 3, 5: 1}  # how many more exponentials there are, by the number of particles; chosen
TRUSTED = 1e-3  # part of the largest |dU| down to which solutions are the better the smaller their error is; chosen
SLOPES = 0.3  # weight of slopes, which are known to first order in what moving changes; chosen
ROUNDING = 1e-12  # of velocities, relative to U_av
SMALLEST = 1e-5  # singular values that are left out, relative to the largest; chosen


@dataclass(frozen=True)
class Row:
    """What is known of a row of N particles.

    Attributes:
        gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).
        values: Of each particle, its velocity [U_av], and by how much the distance to the centre of the next one
            exceeds that of the surfaces [D_c]; of the last one, or of a single one, its own length. Shape (N, 2).
        slopes: Their derivatives by every distance, shape (N, N-1, 2).
        dU_error: Largest half-width of a relative velocity [U_av].
    """

    gaps: Array
    values: Array
    slopes: Array
    dU_error: float = 0.0

    @property
    def dU(self) -> Array:
        """Relative velocities of neighbours [U_av], shape (N-1,)."""
        return np.diff(self.values[:, 0])

    @property
    def rates(self) -> Array:
        """Rates of the distances, at which those between centres change as the velocities say [U_av], (N-1,)."""
        return np.asarray(np.linalg.solve(np.eye(len(self.gaps)) + self.slopes[:-1, :, 1], self.dU))


type Waves = tuple[float, Array, Array]
"""Distance in an infinite train [D_c], phases between neighbours and complex growth rates [U_av/D_c], (m,) each."""


@dataclass(frozen=True)
class RowModel:
    """Values of rows of equal particles.

    Attributes:
        alone: Values of a single particle, such as its velocity and length, shape (q,).
        rates: Of two, three, ... neighbours, the rates at which each term of what they add decays with every distance
            [1/D_c], shape (m, k-1) for k of them.
        coefficients: Those of the terms of two, three, ... in the values of each of them, shape (all m k, q).
        least: Distance below which nothing was solved, and values are those at it [D_c].
    """

    alone: Array
    rates: Sequence[Array]
    coefficients: Array
    least: float = 0.0

    def row(self, gaps: Array) -> Row:
        """The row at given distances, shape (N-1,)."""
        n, left = len(gaps) + 1, self.coefficients
        values, slopes = np.tile(self.alone, (n, 1)), np.zeros((n, n - 1, len(self.alone)))
        for count, rates in enumerate(self.rates[: n - 1], 2):
            part, left = np.split(left, [len(rates) * count])
            part = part.reshape(len(rates), count, -1)
            windows = sliding_window_view(gaps, count - 1)
            terms = np.exp(-np.maximum(windows, self.least) @ rates.T)
            changes = -terms[:, :, None] * rates * (windows >= self.least)[:, None]
            own = np.arange(len(windows))[:, None] + np.arange(count)
            np.add.at(values, own, np.tensordot(terms, part, 1))
            np.add.at(slopes, (own[:, :, None], own[:, None, :-1]), np.einsum("wmj,mki->wkji", changes, part))
        return Row(gaps, values, slopes)

    def growth(self, d: float, k: Array) -> Array:
        """Growth rates of waves in a long row of even distances, complex, (m,) [U_av/D_c]."""
        dU, lengths = self.waves(d, k)
        return np.asarray(dU[:, 0] / (1 + lengths[:, 1]))

    def waves(self, d: float, k: Array) -> tuple[Array, Array]:
        """Fourier components of the slopes of differences of neighbours' values, and of the slopes, each (m, q)."""
        middle = len(self.rates)
        slopes = self.row(np.full(2 * middle + 1, d)).slopes[middle : middle + 2]
        waves = np.exp(1j * np.outer(k, np.arange(2 * middle + 1) - middle))
        return waves @ (slopes[1] - slopes[0]), waves @ slopes[0]

    def misses(self, row: Row) -> tuple[float, float]:
        """By how much it misses dU of a row and its slopes: the largest differences relative to the largest of each."""
        both = ((each.dU, np.diff(each.slopes[..., 0], axis=0)) for each in (self.row(row.gaps), row))
        dU, slopes = (float(np.abs(x - y).max() / np.abs(y).max()) for x, y in zip(*both, strict=True))
        return dU, slopes


def fitted(rows: Sequence[Row], trains: Sequence[Waves] = ()) -> RowModel:
    """The model that is nearest to short rows and trains, of as many particles as the longest of the rows.

    Args:
        rows: Short rows, the first one of a single particle.
        trains: Waves of infinite trains.
    """
    alone, *rows = rows
    counts = range(2, max(len(row.values) for row in rows) + 1)
    trusted = max(ROUNDING, TRUSTED * max(np.abs(row.dU).max() for row in rows))
    weights = [1 / max(row.dU_error, trusted) for row in rows]
    most = {n: POWERS[n] + n - 1 for n in counts}
    powers = [[p for p in product(range(1, most[n] + 1), repeat=n - 1) if sum(p) <= most[n]] for n in counts]
    every = ([rate * np.array(each) for each in powers] for rate in RATES)
    return min((_fitted(rates, alone.values[0], rows, weights, trains) for rates in every), key=lambda fit: fit[0])[1]


def _fitted(
    rates: Sequence[Array], alone: Array, rows: Sequence[Row], weights: Sequence[float], trains: Sequence[Waves]
) -> tuple[float, RowModel]:
    """What a model with terms of given rates misses of the velocities, and the model."""
    count, scale = sum(each.size + len(each) for each in rates), SLOPES / RATES[-1]
    # With each coefficient as a quantity of its own, the values of a row are those that multiply the coefficients.
    basis, terms, values = RowModel(np.zeros(count), rates, np.eye(count)), list[Array](), list[Array]()
    for row, weight in zip(rows, weights, strict=True):
        of = basis.row(row.gaps)
        terms += [weight * of.values, weight * scale * of.slopes.reshape(-1, count)]
        values += [weight * (row.values - alone), weight * scale * row.slopes.reshape(-1, 2)]
    U, lengths = np.vstack(values).T
    lengths, weight = _solution(np.vstack(terms), lengths), max(weights) / RATES[-1]
    for d, k, growth in trains:
        dU, stretch = basis.waves(d, k)
        rate = weight * growth * (1 + stretch @ lengths)
        terms, U = [*terms, weight * dU.real, weight * dU.imag], np.concatenate([U, rate.real, rate.imag])
    matrix = np.vstack(terms)
    found = _solution(matrix, U)
    model = RowModel(alone, rates, np.column_stack([found, lengths]), min(row.gaps.min() for row in rows))
    return float(np.mean((matrix @ found - U) ** 2)), model


def _solution(matrix: Array, values: Array) -> Array:
    size = np.abs(matrix).max(axis=0)
    return np.asarray(scipy.linalg.lstsq(matrix / size, values, cond=SMALLEST)[0] / size)
