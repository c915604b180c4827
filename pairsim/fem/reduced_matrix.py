"""Contributions of assembled entries to the matrix T A P of the free unknowns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pairsim.fem.constraints import Constraints
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Array, Indices


@dataclass(frozen=True)
class Entries:
    """Contributions of the assembled Jacobian of one phase to T A P, one for each COO entry of T A P.

    Attributes:
        source: Position in the data of the assembled matrix of the phase, shape (k,).
        value: Factor without its power of g = gamma dt, shape (k,).
        times_g: Indices of the contributions whose factor is multiplied by g.
        over_g: Indices of the contributions whose factor is divided by g.
    """

    source: Indices
    value: Array
    times_g: Indices
    over_g: Indices

    def factors(self, g: float) -> Array:
        """Factors of all contributions for a given g = gamma dt, shape (k,)."""
        factors = self.value.copy()
        factors[self.times_g] *= g
        factors[self.over_g] /= g
        return factors


def expand(scene: Scene, constraints: Constraints) -> tuple[Indices, Indices, list[Entries], Array]:
    """COO structure of T A P, with the contributions of one phase after the other and the constant entries last.

    Returns:
        Rows, columns, the contributions of each phase, and the values of the constant entries (see
        `Scene.linear_terms`).
    """
    P0, P1, T = constraints.N.tocoo(), (constraints.C @ constraints.M).tocoo(), constraints.T.tocsc()
    # P maps a column of A to columns of T A P: through N without a factor g, and through C M with it, whose columns are
    # distinguished by an offset of n_y.
    image = sparse.csr_matrix(
        (np.arange(1, P0.nnz + P1.nnz + 1), (np.r_[P0.row, P1.row], np.r_[P0.col + 0, P1.col + constraints.size])),
        shape=(scene.size, 2 * constraints.size),
    )
    factor = np.r_[P0.data, P1.data]

    def images(row: Indices, column: Indices) -> tuple[Indices, Indices, Indices, Array, np.ndarray]:
        count_t, count_p = np.diff(T.indptr)[row], np.diff(image.indptr)[column]
        source = np.repeat(np.arange(len(row)), count_t * count_p)
        within = np.arange(len(source)) - np.repeat(np.cumsum(count_t * count_p) - count_t * count_p, count_t * count_p)
        at_t = T.indptr[row[source]] + within // count_p[source]
        at_p = image.indptr[column[source]] + within % count_p[source]
        target = image.indices[at_p]
        value = T.data[at_t] * factor[image.data[at_p] - 1]
        return source, T.indices[at_t], target % constraints.size, value, target >= constraints.size

    rows, columns, entries = [], [], []
    for phase, offset in zip(scene.phases, scene.offsets, strict=False):
        place, row, column = phase.entries
        source, i, j, value, carries_g = images(row + offset, column + offset)
        divided = constraints.integrated[i]
        entries.append(
            Entries(place[source], value, np.flatnonzero(carries_g & ~divided), np.flatnonzero(divided & ~carries_g))
        )
        rows.append(i)
        columns.append(j)
    row, column, value = scene.linear_terms()
    source, i, j, product, _ = images(row, column)
    constant = product * value[source]
    return np.concatenate([*rows, i]), np.concatenate([*columns, j]), entries, constant
