"""Affine constraints between the unknowns, x = x_0 + P y, and the restriction T of the residual.

Constraints are sparse matrices in the canonical numbering of a scene. The time scheme is
h = h* + g (M y - U_m a), with g = gamma dt and the unit axial translation a. The full vector is

    x = base + N y + C h,    P = N + g C M,

and Newton's matrix is T A P with the assembled Jacobian A; see "Constraints" in docs/explanation/numerics.md. An entry
of A contributes to it with a factor t (n + g c m), so that the sparsity pattern does not depend on the step size.
`pairsim.fem.algebra.scene_constraints` builds the constraints of each kind of problem.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pairsim.runtime.arrays import Array, Indices


@dataclass(frozen=True)
class PositionUpdate:
    """How the positions of the particles' material follow from the free unknowns, h = h* + g (M y - U_m a).

    Attributes:
        h_star: The fixed part h*, shape (n_h,): it follows from earlier steps in a time step, and from the distances
            in a quasi-steady scene.
        g: gamma dt of a time step, 1 in a quasi-steady scene.
        U_m: Velocity of the frame; 0 in a quasi-steady scene.
    """

    h_star: Array
    g: float = 1.0
    U_m: float = 0.0


@dataclass(frozen=True)
class Constraints:
    """Affine map from the free unknowns y to the full vector x, and the restriction of the residual to n_y equations.

    Attributes:
        base: Constant part of x, shape (n,).
        N: Direct dependence of x on y, shape (n, n_y).
        C: Dependence of x on the material positions h, shape (n, n_h).
        M: Derivative dh/dy divided by g, shape (n_h, n_y). M y is the velocity of the material positions in the
            laboratory frame in time steps, and their displacement in quasi-steady scenes, where g = 1.
        a: Unit axial translation of h, shape (n_h,).
        V: Velocity of the particles' material, V y, as a function of y, shape (n_h, n_y). In time steps it equals M; in
            quasi-steady scenes all material of a particle has the velocity of the particle.
        T: Restriction of the residual to the test functions that satisfy the constraints, shape (n_y, n).
        integrated: Whether an equation contains h but not its rate, as incompressibility of solids does; such equations
            are divided by g, to be of the same order as the others. Boolean, shape (n_y,).
        fields: Indices in y of each field, for norms and reports.
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

    def positions(self, y: Array, update: PositionUpdate) -> Array:
        """Material positions h = h* + g (M y - U_m a), shape (n_h,)."""
        return np.asarray(update.h_star + update.g * (self.M @ y - update.U_m * self.a))

    def expand(self, y: Array, h: Array) -> Array:
        """Full vector x = base + N y + C h, shape (n,)."""
        return np.asarray(self.base + self.N @ y + self.C @ h)

    def state(self, y: Array, update: PositionUpdate) -> tuple[Array, Array]:
        """Material positions h, shape (n_h,), and full vector x, shape (n,), of free unknowns y."""
        h = self.positions(y, update)
        return h, self.expand(y, h)


class Triplets:
    """Builder of a sparse matrix from triplets; duplicate entries are summed."""

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
    """Numbering of the free unknowns, allocated field by field."""

    def __init__(self) -> None:
        self.size = 0
        self.fields: dict[str, Indices] = {}

    def take(self, field: str, count: int) -> Indices:
        new = np.arange(self.size, self.size + count)
        self.size += count
        self.fields[field] = np.concatenate([self.fields[field], new]) if field in self.fields else new
        return new
