"""Linear constraints between the unknowns, x = x_0 + P y, and the choice of test rows T.

Constraints are pure linear algebra on the canonical numbers of a scene, the same on every process. With the time
scheme h = h* + g (M y - U_m a), in which a moves everything along the axis, the full vector is

    x = base + N y + C h,    P = N + g C M,

so that one set of index arrays serves every step size: the entries of T A P are (t n + g t c m) times assembled ones.
`pairsim.fem.scene_constraints` makes those of each kind of problem.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pairsim.runtime.arrays import Array, Indices


@dataclass(frozen=True)
class Constraints:
    """An affine map from the free unknowns y to the full vector x, and the rows that are tested.

    Attributes:
        base: Constant part of x, shape (n,).
        N: Direct part of the map, (n, n_y).
        C: Dependence of x on the material positions h, (n, n_h).
        M: Velocity of h in the laboratory from y, (n_h, n_y).
        a: Axial translation of h, (n_h,).
        V: Velocity of the particles' material from y, (n_h, n_y): M itself unless the scene is quasi-steady.
        T: Test rows, (n_y, n).
        integrated: Rows that constrain h itself and are divided by g to balance the rest, (n_y,) of bool.
        fields: Unknowns by field, for norms and reports.
    """

    base: Array
    N: sparse.csr_matrix
    C: sparse.csr_matrix
    M: sparse.csr_matrix
    a: Array
    T: sparse.csr_matrix
    integrated: np.ndarray
    fields: dict[str, Indices]
    V: sparse.csr_matrix

    @property
    def size(self) -> int:
        """Number of free unknowns."""
        return int(self.N.shape[1])

    def positions(self, y: Array, h_star: Array, g: float, U_m: float) -> Array:
        """h = h* + g (M y - U_m a)."""
        return np.asarray(h_star + g * (self.M @ y - U_m * self.a))

    def expand(self, y: Array, h: Array) -> Array:
        """x = base + N y + C h."""
        return np.asarray(self.base + self.N @ y + self.C @ h)


class Triplets:
    """Collects the entries of a sparse matrix; entries of the same place are added."""

    def __init__(self) -> None:
        self.rows: list[Indices] = []
        self.columns: list[Indices] = []
        self.values: list[Array] = []

    def add(self, rows: Indices, columns: Indices, values: Array | float = 1.0) -> None:
        rows, columns, values = np.broadcast_arrays(rows, columns, np.asarray(values, dtype=np.float64))
        self.rows.append(rows.ravel())
        self.columns.append(columns.ravel())
        self.values.append(values.ravel())

    def matrix(self, shape: tuple[int, int]) -> sparse.csr_matrix:
        if not self.rows:
            return sparse.csr_matrix(shape)
        data = np.concatenate(self.values), (np.concatenate(self.rows), np.concatenate(self.columns))
        return sparse.csr_matrix(sparse.coo_matrix(data, shape=shape))


class Unknowns:
    """Hands out the numbers of the free unknowns, field by field."""

    def __init__(self) -> None:
        self.size = 0
        self.fields: dict[str, Indices] = {}

    def take(self, field: str, count: int) -> Indices:
        new = np.arange(self.size, self.size + count)
        self.size += count
        self.fields[field] = np.concatenate([self.fields[field], new]) if field in self.fields else new
        return new
