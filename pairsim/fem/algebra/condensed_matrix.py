"""Assembly of the matrix T A P of the free unknowns, straight from the cells.

FFCx's kernels compute the element matrices, and a compiled loop (`cell_loop.c`) multiplies them by the factors of the
constraints and adds them to entries of T A P whose positions are determined once. A itself is never stored. See
"Nonlinear and linear solvers" in docs/explanation/numerics.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pairsim.fem.algebra.constraints import Constraints
from pairsim.fem.compilation.loops import call
from pairsim.fem.phases.phase import CellJacobian
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Array, Indices


@dataclass(frozen=True)
class _Dependence:
    """For each unknown of a phase, the free unknowns on which it depends or the equations to which it contributes.

    Attributes:
        pointer: Index in `number` at which the entries of each unknown begin, as in CSR, shape (phase.size + 1,).
        number: Columns (free unknowns) or rows (equations) of T A P.
        begin: Position of the first entry of `number` among the entries of all phases.
    """

    pointer: Indices
    number: Indices
    begin: int

    @property
    def here(self) -> slice:
        """Slice of the factors of all phases that belongs to this phase."""
        return slice(self.begin, self.begin + len(self.number))

    @staticmethod
    def of(matrix: sparse.csr_matrix, begin: int, end: int) -> _Dependence:
        """Make it from rows `begin` to `end` (exclusive) of a matrix whose rows are the unknowns of all phases."""
        pointer = matrix.indptr[begin : end + 1]
        number = matrix.indices[pointer[0] : pointer[-1]]
        return _Dependence((pointer - pointer[0]).astype(np.int32), number.astype(np.int32), int(pointer[0]))


class _Contribution:
    """The cells of one phase, and the entries of T A P to which they contribute.

    Args:
        n: Number of rows and columns of T A P.
        cells: Kernel, coefficients and unknowns of the cells.
        rows: Equations to which the unknowns contribute.
        columns: Free unknowns on which the unknowns depend.

    Attributes:
        positions: Position of each contribution in the data of T A P; set by `locate`.
    """

    positions: np.ndarray

    def __init__(self, n: int, cells: CellJacobian, rows: _Dependence, columns: _Dependence) -> None:
        self._n, self.cells, self.rows, self.columns = n, cells, rows, columns
        size = cells.dofs.shape[1]
        # Row i of the matrix of a cell contributes to some rows of T A P, and there to some columns.
        unknown = cells.dofs.ravel()
        rows_of = np.diff(rows.pointer)[unknown]
        of_unknown = np.repeat(np.arange(len(unknown)), rows_of)
        within = np.arange(len(of_unknown)) - np.repeat(np.cumsum(rows_of) - rows_of, rows_of)
        row = rows.number[rows.pointer[unknown[of_unknown]] + within]
        columns_of = np.diff(columns.pointer).astype(np.float64)[cells.dofs]
        coupled = (np.ones(len(cells.coupled)), cells.coupled, cells.coupled_pointer)
        in_row = columns_of @ sparse.csr_matrix(coupled, shape=(size, size)).toarray().T
        ends = np.concatenate([[0], np.cumsum(in_row.astype(np.int64).ravel()[of_unknown])])
        order = np.argsort(row, kind="stable")
        self._begin = ends[:-1][order]
        self._count = int(ends[-1])
        touching_pointer = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=n))])
        self._touching = n, np.int32(size), cells.dofs, touching_pointer, of_unknown[order]

    def pattern(self) -> sparse.csr_matrix:
        """Sparsity pattern of the cells' contributions to T A P, as a matrix of ones, shape (n, n)."""
        cells, columns, n = self.cells, self.columns, self._n
        known = (*self._touching, cells.coupled_pointer, cells.coupled, columns.pointer, columns.number)
        indptr, indices = np.empty(n + 1, dtype=np.int64), np.empty(self._count, dtype=np.int32)
        found = call("row_patterns", *known, np.full(n, -1, dtype=np.int32), indptr, indices)
        return sparse.csr_matrix((np.ones(found), indices[:found], indptr), shape=(n, n))

    def locate(self, indptr: np.ndarray, indices: np.ndarray) -> None:
        """Set `positions` for a CSR matrix with these `indptr` and `indices`; can be called once only."""
        cells, columns = self.cells, self.columns
        known = (*self._touching, self._begin, cells.coupled_pointer, cells.coupled, columns.pointer, columns.number)
        self.positions = np.empty(self._count, dtype=np.int32)
        call("locate", *known, indptr, indices, np.empty(self._n, dtype=np.int32), self.positions)
        del self._touching, self._begin


class CondensedMatrix:
    """T A P in CSR format, with ascending columns in each row.

    Args:
        scene: The scene.
        constraints: Its constraints.
        order: Number of the free unknown of each column, and of the equation of each row: a permutation, shape (n_y,).

    Attributes:
        indptr: Start of each row, shape (n_y + 1,).
        indices: Columns.
        data: Values at the last assembly.
    """

    def __init__(self, scene: Scene, constraints: Constraints, order: Indices) -> None:
        n = constraints.size
        place = np.empty(n, dtype=np.int64)
        place[order] = np.arange(n)
        self._equations = _renumbered(sparse.csr_matrix(constraints.T.T), place)
        # P = N + g C M: both parts on one pattern.
        N, CM = _renumbered(constraints.N, place), _renumbered(sparse.csr_matrix(constraints.C @ constraints.M), place)
        self._free, self._direct, self._by_position = _on_one_pattern(N, CM)
        self._integrated = np.flatnonzero(constraints.integrated[order][self._equations.indices])
        linear = sparse.csr_matrix(self._equations.T @ scene.scalar_terms.matrix @ N)
        by_unknown = self._equations, self._free
        self._contributions = [
            _Contribution(n, phase.cell_jacobian(), *(_Dependence.of(matrix, a, b) for matrix in by_unknown))
            for phase, a, b in zip(scene.phases, scene.offsets[:-1], scene.offsets[1:], strict=True)
        ]
        pattern = _ones(linear)
        # Small patterns, those of the particles, come first, and columns are sorted: adding large patterns is slow, and
        # slower still if they are unsorted.
        for part in reversed(self._contributions):
            more = part.pattern()
            more.sort_indices()
            pattern = sparse.csr_matrix(pattern + more)
        self.indptr, self.indices = pattern.indptr.astype(np.int32), pattern.indices.astype(np.int32)
        self.data = np.zeros(len(self.indices))
        self._constant = _places(pattern, linear), linear.tocoo().data
        for part in self._contributions:
            part.locate(self.indptr, self.indices)

    def assemble(self, g: float) -> None:
        """Assemble at the current state of the phases.

        Args:
            g: gamma dt of the time scheme, 1 in a quasi-steady scene.
        """
        row_factor = self._equations.data.copy()
        row_factor[self._integrated] /= g
        column_factor = self._direct + g * self._by_position
        self.data[:] = 0.0
        self.data[self._constant[0]] = self._constant[1]
        for part in self._contributions:
            cells = part.cells
            status = call(
                *("assemble", cells.kernel, len(cells.dofs), np.int32(cells.dofs.shape[1])),
                *cells.packed(),
                *(cells.points, cells.nodes, np.int32(cells.nodes.shape[1])),
                *(cells.dofs, cells.coupled_pointer, cells.coupled),
                *(part.rows.pointer, row_factor[part.rows.here]),
                *(part.columns.pointer, column_factor[part.columns.here], part.positions, self.data),
            )
            if status:
                raise MemoryError


def _renumbered(matrix: sparse.csr_matrix, place: Indices) -> sparse.csr_matrix:
    """The matrix with column q moved to place[q]."""
    return sparse.csr_matrix((matrix.data, place[matrix.indices], matrix.indptr), shape=matrix.shape)


def _ones(matrix: sparse.csr_matrix) -> sparse.csr_matrix:
    """Matrix of ones on the pattern of another one."""
    return sparse.csr_matrix((np.ones(len(matrix.data)), matrix.indices, matrix.indptr), shape=matrix.shape)


def _places(pattern: sparse.csr_matrix, matrix: sparse.csr_matrix) -> Indices:
    """Position of each entry of a matrix in the data of a pattern, which must contain all of them."""
    numbers = sparse.csr_matrix((np.arange(len(pattern.indices)), pattern.indices, pattern.indptr), shape=pattern.shape)
    entries = matrix.tocoo()
    if not entries.nnz:  # SciPy returns a matrix for empty indices
        return np.empty(0, dtype=np.int64)
    return np.asarray(numbers[entries.row, entries.col], dtype=np.int64).ravel()


def _on_one_pattern(a: sparse.csr_matrix, b: sparse.csr_matrix) -> tuple[sparse.csr_matrix, Array, Array]:
    """Common pattern of two matrices, and the data of both on it."""
    pattern = sparse.csr_matrix(_ones(a) + _ones(b))
    data = np.zeros((2, len(pattern.indices)))
    for values, matrix in zip(data, (a, b), strict=True):
        values[_places(pattern, matrix)] = matrix.tocoo().data
    return pattern, data[0], data[1]
