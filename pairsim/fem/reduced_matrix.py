"""Where the entries of cell matrices go in Newton's matrix of the reduced unknowns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pairsim.fem.constraints import Constraints
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Array, Indices


@dataclass(frozen=True)
class Entries:
    """Places of one phase's assembled entries in the reduced matrix, and the factors they carry.

    Attributes:
        source: Positions in the phase's assembled data.
        value: Factor apart from g.
        times_g, over_g: Entries whose factor is multiplied or divided by g = gamma dt.
    """

    source: Indices
    value: Array
    times_g: Indices
    over_g: Indices

    def factors(self, g: float) -> Array:
        """The factor of every entry."""
        factors = self.value.copy()
        factors[self.times_g] *= g
        factors[self.over_g] /= g
        return factors


def expand(scene: Scene, constraints: Constraints) -> tuple[Indices, Indices, list[Entries], Array]:
    """COO rows and columns of T A P, phase after phase, and the constant entries at their end."""
    P0, P1, T = constraints.N.tocoo(), (constraints.C @ constraints.M).tocoo(), constraints.T.tocsc()
    # One list of images a column of A: those independent of g and those that carry it.
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
