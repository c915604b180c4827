"""Velocities of a row of any number of equal particles, from those of rows of up to five.

What a particle does in a row is what it does alone, and what its neighbours change: each pair of neighbours, what a
third one changes in that, and a fourth and fifth one. With the velocities U of short rows, the part W of k particles is
what is left of U when the parts of all shorter rows of neighbours among them are subtracted (the cumulant expansion of
a chain). Particles that are not neighbours have no part of their own: whatever reaches one from another has passed
those between, which is why sums of pairs are so poor and this series converges (measured: by a factor of 4 to 7 with
each particle at a distance of d = 0.1, of 3 at 0.2 in a liquid with De = 1).

The parts are sums of products of exponentials of the distances, as which disturbances of the flow in a tube decay,
fitted to solutions and their derivatives by the distances. Lengths of particles have such parts, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view

from pairsim.runtime.arrays import Array

RATES = np.geomspace(1.0, 8.0, 16)  # of the slowest exponential, which are tried [1/D_c]; chosen
POWERS = {2: 6, 3: 3, 4: 3, 5: 1}  # how many more exponentials there are, by the number of particles; chosen
TRUSTED = 1e-3  # part of the largest |dU| down to which solutions are the better the smaller their error is; chosen
SLOPES = 0.03  # weight of slopes, which are known to first order in what moving changes; chosen
SMALLEST = 1e-4  # singular values that are left out, relative to the largest; chosen


@dataclass(frozen=True)
class Row:
    """What is known of a row of N particles.

    Attributes:
        gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).
        values: Of each particle, its velocity [U_av], and by how much the distance to the centre of the next one
            exceeds that of the surfaces [D_c]; of the last one, or of a single one, its own length. Shape (N, 2).
        slopes: Their derivatives by every distance, shape (N, 2, N-1).
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
    def dU_slopes(self) -> Array:
        """Their derivatives by every distance [U_av/D_c], shape (N-1, N-1)."""
        return np.diff(self.slopes[:, 0], axis=0)

    @property
    def lengths(self) -> Array:
        """What the distances between centres exceed those between surfaces by [D_c], shape (N-1,)."""
        return self.values[:-1, 1]

    @property
    def rates(self) -> Array:
        """Rates of the distances, at which those between centres change as the velocities say [U_av], (N-1,)."""
        return np.asarray(np.linalg.solve(np.eye(len(self.gaps)) + self.slopes[:-1, 1], self.dU))


class Part(NamedTuple):
    """What k particles add to the values of each other beyond what fewer of them do.

    Attributes:
        rates: Rates at which each term decays with every distance [1/D_c], shape (m, k-1).
        coefficients: Those of the terms in the values of each particle, shape (m, k, 2).
    """

    rates: Array
    coefficients: Array


def _terms(rates: Array, gaps: Array) -> tuple[Array, Array]:
    """The terms at distances of shape (w, k-1), shape (w, m), and their derivatives, shape (w, m, k-1)."""
    terms = np.exp(-gaps @ rates.T)
    return terms, -terms[:, :, None] * rates


@dataclass(frozen=True)
class RowModel:
    """Values of rows of equal particles.

    Attributes:
        alone: Velocity and length of a single particle, shape (2,).
        parts: What two, three, ... neighbours add.
        least: Distance below which nothing was solved, and values are those at it [D_c].
    """

    alone: Array
    parts: tuple[Part, ...] = ()
    least: float = np.inf

    def row(self, gaps: Array) -> Row:
        """The row at given distances, shape (N-1,)."""
        values, slopes = np.tile(self.alone, (len(gaps) + 1, 1)), np.zeros((len(gaps) + 1, 2, len(gaps)))
        for rates, coefficients in self.parts[: len(gaps)]:
            count = coefficients.shape[1]
            windows = sliding_window_view(gaps, count - 1)
            terms, changes = _terms(rates, np.maximum(windows, self.least))
            changes = changes * (windows >= self.least)[:, None]
            own = np.arange(len(windows))[:, None] + np.arange(count)
            np.add.at(values, own, np.tensordot(terms, coefficients, 1))
            sloping = np.einsum("wmj,mki->iwkj", changes, coefficients)
            for i in range(2):
                np.add.at(slopes[:, i], (own[:, :, None], own[:, None, :-1]), sloping[i])
        return Row(gaps, values, slopes)

    def with_part_of(self, rows: Sequence[Row]) -> RowModel:
        """The model with the part of one particle more, fitted to rows of so many."""
        known = [self.row(row.gaps) for row in rows]
        left = [Row(row.gaps, row.values - k.values, row.slopes - k.slopes) for row, k in zip(rows, known, strict=True)]
        largest = max(np.abs(row.dU).max() for row in rows)
        errors = np.array([row.dU_error for row in rows])
        weights = 1 / np.maximum(errors, TRUSTED * largest) if largest else np.ones(len(rows))
        rates = [part.rates.min() for part in self.parts[:1]] or RATES
        _, part = min((_fitted(rate, left, weights) for rate in rates), key=lambda fit: fit[0])
        return RowModel(self.alone, (*self.parts, part), min(self.least, *(row.gaps.min() for row in rows)))


def _fitted(rate: float, rows: Sequence[Row], weights: Array) -> tuple[float, Part]:
    """What a part whose values and slopes are nearest to given ones misses of the velocities, and the part.

    Args:
        rate: Rate of the slowest exponential [1/D_c].
        rows: What is to be fitted, of k particles each.
        weights: Of every row.
    """
    gaps = np.array([row.gaps for row in rows])
    count, scale = gaps.shape[1] + 1, 1 / RATES[-1]  # one for all rates, that what they miss can be compared [D_c]
    most = POWERS[count] + count - 1
    rates = rate * np.array([p for p in product(range(1, most + 1), repeat=count - 1) if sum(p) <= most])
    terms, changes = _terms(rates, gaps)
    matrix = np.concatenate([terms, scale * changes.transpose(0, 2, 1).reshape(-1, len(rates))])
    values = np.array([row.values for row in rows]).reshape(len(rows), -1)
    slopes = np.array([row.slopes.reshape(-1, count - 1).T for row in rows]).reshape(-1, 2 * count)
    weight = np.concatenate([weights, SLOPES * np.repeat(weights, count - 1)])[:, None]
    matrix, wanted = weight * matrix, weight * np.concatenate([values, scale * slopes])
    size = np.abs(matrix).max(axis=0)
    found = scipy.linalg.lstsq(matrix / size, wanted, cond=SMALLEST)[0] / size[:, None]
    missed = (matrix @ found - wanted)[:, ::2]
    return float(np.mean(missed**2)), Part(rates, found.reshape(-1, count, 2))
