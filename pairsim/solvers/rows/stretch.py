"""How the lengths of soft particles that differ change along with their distances.

The flow between two neighbours pulls at them as one tends to run away from the other, and pushes where it runs into it.
Both become longer or shorter by it, the more the nearer they are, so that the distance between their surfaces changes
at another rate than that between their centres. The ratio of both rates is found to be linear in the relative velocity
of the two, whatever it comes from: their sizes or their neighbours. (Of pairs and triplets, Ca_e = 0.1, at distances
of about 0.0725, it is 0.855, 0.890, 0.911, 1.028, 1.082, 1.102, 1.132 and 1.180 at relative velocities of -0.0180,
-0.0144, -0.0122, 0.0008, 0.0070, 0.0092, 0.0121 and 0.0175, of which three are of pairs, and three of equal particles.)
Beside that it depends on their mean size a little. Where one particle runs hard into the other the ratio remains
positive (`_positive`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np
from scipy.interpolate import PchipInterpolator

from pairsim.runtime.arrays import Array
from pairsim.solvers.rows.parts import Parts

if TYPE_CHECKING:
    from pairsim.solvers.rows.model import Row

LINEAR = 0.5  # part of the ratio of equal particles down to which that of others is linear in what differs; chosen
QUANTILE = 1.96  # of a normal distribution, for half-widths


@dataclass(frozen=True)
class Stretch:
    """What differing particles change of the derivatives of distances between centres by those between surfaces.

    Attributes:
        distances: Those of pairs that were solved, ascending [D_c], shape (m,).
        slopes: Derivatives of the ratio of the rates of the distances between surfaces and centres, by dU and by the
            mean of the logarithms of both diameters, times the square of the distance, with which films go
            [D_c^2/U_av, D_c^2], shape (m, 2).
        scatter: Standard deviation of the first of them among pairs of which another particle is larger or smaller,
            shape (m,).
        outer: What a pair adds to the distances from the rear of the first particle to its centre and from the centre
            of the second one to its front, by the logarithm of the diameter of each [D_c], shape (k, 2, 2) of the
            coefficients.
    """

    distances: Array
    slopes: Array
    scatter: Array
    outer: Parts

    @classmethod
    def fitted(cls, equal: Sequence[Row], unequal: Sequence[Row], rates: Array) -> Self | None:
        """That of pairs.

        Args:
            equal: Pairs of equal particles.
            unequal: Single particles and pairs of which one is larger or smaller, at some of the distances of these.
            rates: Those of the terms of `outer`.

        Returns:
            None where lengths do not change: those of rigid particles.
        """
        pairs = [row for row in unequal if len(row.gaps) == 1]
        places = sorted({float(row.gaps[0]) for row in pairs})
        if not any(row.slopes[:-1, :, 1].any() for row in pairs):
            return None
        slopes, scatter = np.zeros((len(places), 2)), np.zeros(len(places))
        for i, d in enumerate(places):
            (reference,) = (row for row in equal if float(row.gaps[0]) == d)
            at = [row for row in pairs if float(row.gaps[0]) == d]
            differ = np.array([[row.dU[0] - reference.dU[0], _mean_size(row)] for row in at])
            changes = np.array([_ratio(row) - _ratio(reference) for row in at])
            found = np.linalg.lstsq(differ, changes)[0]
            slopes[i] = found * d**2
            scatter[i] = np.std((changes - differ @ found) / differ[:, 0]) * d**2
        return cls(np.array(places), slopes, scatter, _outer(np.array(places), unequal, rates))

    @property
    def steeper(self) -> Self:
        """The same with what is not one number for all pairs at one end of its interval."""
        return replace(self, slopes=self.slopes + QUANTILE * np.outer(self.scatter, [1.0, 0.0]))

    @cached_property
    def _curve(self) -> PchipInterpolator:
        return PchipInterpolator(np.log(self.distances), self.slopes)

    def changed(self, of_equals: Array, gaps: Array, sizes: Array, faster: Array) -> Array:
        """Derivatives of the distances between centres by those between surfaces.

        Args:
            of_equals: Those of equal particles, a banded matrix as of `RowModel.along`, shape (2 k + 1, N-1).
            gaps: Distances between facing surfaces from upstream, none below the least solved one [D_c], shape (N-1,).
            sizes: Deviations of the logarithms of the diameters, shape (N,).
            faster: Relative velocities beyond those of equal particles [U_av], shape (N-1,).
        """
        found, middle = of_equals.copy(), len(of_equals) // 2
        pairs = np.column_stack([sizes[:-1], sizes[1:]])
        slopes = self._curve(np.log(np.clip(gaps, *self.distances[[0, -1]]))) / gaps[:, None] ** 2
        changes = np.sum(slopes * np.column_stack([faster, pairs.mean(axis=1)]), axis=1)
        found[middle] /= _positive(changes * of_equals[middle])
        rear, front = np.einsum("wij,wj->iw", self.outer.slopes(gaps), pairs)
        found[middle - 1, 1:] += rear[1:]  # of the particle that has another one upstream
        found[middle + 1, :-1] += front[:-1]
        return found


def _ratio(pair: Row) -> float:
    """Rate of the distance between the surfaces of a pair over that between their centres."""
    return 1 / (1 + float(pair.slopes[0, 0, 1]))


def _mean_size(pair: Row) -> float:
    """Mean of the deviations of the logarithms of both diameters."""
    assert pair.parts is not None
    return float(pair.parts[:, 0].mean())


def _positive(x: Array) -> Array:
    """1 + x, and where that is below `LINEAR` what goes on smoothly and stays positive."""
    return np.where(x > LINEAR - 1, 1 + x, LINEAR**2 / (2 * LINEAR - 1 - np.minimum(x, LINEAR - 1)))


def _outer(places: Array, unequal: Sequence[Row], rates: Array) -> Parts:
    """`Stretch.outer` of pairs at distances, (n,) [D_c]."""
    alone, found = np.zeros(2), np.zeros((len(places), 2, 2))
    for row in unequal:
        assert row.parts is not None
        (j, k), *_ = np.argwhere(row.parts)
        if k:
            continue
        each = np.array([row.rear, row.values[-1, 1]]) / (2 * row.parts[j, 0])
        if len(row.values) == 1:
            alone += each
        else:
            found[np.searchsorted(places, row.gaps[0]), :, j] += each
    return Parts.fitted(rates, places[:, None], found - np.diag(alone))
