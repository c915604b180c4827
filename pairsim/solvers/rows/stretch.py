"""Changes of the lengths of soft particles, which may differ from each other, with their distances.

If one of two neighbours tends to move away from the other, the flow between them pulls at both; if it moves towards the
other, the flow pushes. Both become longer or shorter, the more so the closer they are. Therefore the distance between
their surfaces changes at another rate than that between their centres. The ratio of the two rates is found to be linear
in the relative velocity of the neighbours, whether this velocity is due to their sizes or to other particles. (In pairs
and triplets with Ca_e = 0.1, at distances of about 0.0725, it is 0.855, 0.890, 0.911, 1.028, 1.082, 1.102, 1.132 and
1.180 at relative velocities of -0.0180, -0.0144, -0.0122, 0.0008, 0.0070, 0.0092, 0.0121 and 0.0175; three of these
values are of pairs, and three of equal particles.) It also depends a little on the mean size of the two. Where one
particle moves towards the other so fast that the linear function would be small or negative, it is replaced by a
function that remains positive (`_positive`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np
from scipy.interpolate import PchipInterpolator

from pairsim.runtime.arrays import Array
from pairsim.solvers.rows.exponential_sums import ExponentialSum

if TYPE_CHECKING:
    from pairsim.solvers.rows.model import Row

LINEAR = 0.5  # value of the ratio, relative to that of equal particles, down to which it is linear; chosen
QUANTILE = 1.96  # of the normal distribution, for half-widths


@dataclass(frozen=True)
class Stretch:
    """How unequal particles change the derivatives of distances between centres with respect to those between surfaces.

    Attributes:
        distances: Distances of the pairs that were solved, ascending [D_c], shape (m,).
        slopes: Derivatives of the ratio of the two rates, that of the distance between surfaces over that between
            centres, with respect to dU and to the mean of the logarithms of both diameters. They are multiplied by the
            square of the distance, as they grow about as its inverse [D_c^2/U_av, D_c^2], shape (m, 2).
        scatter: Standard deviation of the derivative with respect to dU, multiplied likewise, among pairs in which one
            or the other particle is larger or smaller, shape (m,).
        outer: Effect of the neighbour, in a pair, on the distance from the rear of the first particle to its centre and
            on that from the centre of the second particle to its front (first index), differentiated with respect to
            the logarithms of both diameters (second index) [D_c]; the coefficients have the shape (k, 2, 2).
    """

    distances: Array
    slopes: Array
    scatter: Array
    outer: ExponentialSum

    @classmethod
    def fitted(cls, equal: Sequence[Row], unequal: Sequence[Row], rates: Array) -> Self | None:
        """Fit the changes to those in pairs.

        Args:
            equal: Pairs of equal particles.
            unequal: Single particles that are larger or smaller, and pairs in which one particle is, at some of the
                distances of `equal`.
            rates: Rates of the terms of `outer` [1/D_c], shape (k, 1).

        Returns:
            The changes; None if lengths do not change, as those of rigid particles.
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
        """The same with derivatives with respect to dU at the upper end of their interval, which `scatter` gives."""
        return replace(self, slopes=self.slopes + QUANTILE * np.outer(self.scatter, [1.0, 0.0]))

    @cached_property
    def _curve(self) -> PchipInterpolator:
        return PchipInterpolator(np.log(self.distances), self.slopes)

    def changed(self, of_equals: Array, gaps: Array, sizes: Array, faster: Array) -> Array:
        """Derivatives of the distances between centres with respect to those between surfaces, for unequal particles.

        Args:
            of_equals: The same for equal particles, a banded matrix as from `RowModel.along`, shape (2 k + 1, N-1).
            gaps: Distances between facing surfaces from upstream, none below the least that was solved [D_c], (N-1,).
            sizes: Deviations of the logarithms of the diameters, shape (N,).
            faster: Relative velocities minus those of equal particles [U_av], shape (N-1,).

        Returns:
            A banded matrix of the shape of `of_equals`.
        """
        found, middle = of_equals.copy(), len(of_equals) // 2
        pairs = np.column_stack([sizes[:-1], sizes[1:]])
        slopes = self._curve(np.log(np.clip(gaps, *self.distances[[0, -1]]))) / gaps[:, None] ** 2
        changes = np.sum(slopes * np.column_stack([faster, pairs.mean(axis=1)]), axis=1)
        found[middle] /= _positive(changes * of_equals[middle])
        rear, front = np.einsum("wij,wj->iw", self.outer.slopes(gaps), pairs)
        found[middle - 1, 1:] += rear[1:]  # of particles that have another one upstream
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
    """1 + x; below `LINEAR`, a positive function that continues it with the same slope."""
    return np.where(x > LINEAR - 1, 1 + x, LINEAR**2 / (2 * LINEAR - 1 - np.minimum(x, LINEAR - 1)))


def _outer(places: Array, unequal: Sequence[Row], rates: Array) -> ExponentialSum:
    """`Stretch.outer`, from pairs at distances `places`, (n,) [D_c]; other arguments as for `Stretch.fitted`."""
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
    return ExponentialSum.fitted(rates, places[:, None], found - np.diag(alone))
