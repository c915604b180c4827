"""What particles change in a row that differ from the others in size or softness, to first order in each of them.

The derivatives of all velocities by diameter and Ca_e of each particle are taken apart as velocities are
(`pairsim.solvers.rows.model`): what its own size and softness do to a particle alone, what they do to it and to its
neighbour in a pair, and what a third particle changes in that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view

from pairsim.runtime.arrays import Array

if TYPE_CHECKING:
    from pairsim.solvers.rows.model import Row

# Exponentials by the number of particles; of derivatives the slopes are not known, by which velocities are fitted, too.
TERMS = {2: 6, 3: 6}  # chosen
SMALLEST = 1e-5  # singular values that are left out, relative to the largest; chosen


@dataclass(frozen=True)
class Deviations:
    """Derivatives of the velocities of a row by diameter and Ca_e of its particles.

    Attributes:
        alone: Those of a single particle by logarithms of its own diameter and Ca_e [U_av], shape (2,).
        rates: Of two, three, ... neighbours, the rates at which each term of what they add decays with every distance
            [1/D_c], shape (m, k-1) for k of them.
        coefficients: Those of the terms in the derivatives of the velocity of each of them by each of them, shape
            (m, k, k, 2).
        least: Smallest distance that was solved; derivatives at smaller ones are those at this one [D_c].
    """

    alone: Array
    rates: Sequence[Array]
    coefficients: Sequence[Array]
    least: float

    def velocities(self, gaps: Array, parts: Array) -> Array:
        """Changes of the velocities of a row [U_av], shape (N,).

        Args:
            gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).
            parts: Deviations of the logarithms of diameter and Ca_e of each particle, shape (N, 2).
        """
        changes = parts @ self.alone
        for rates, part in zip(self.rates, self.coefficients, strict=True):
            count = part.shape[1]
            if len(gaps) < count - 1:
                break
            windows = sliding_window_view(gaps, count - 1)
            terms, total = np.exp(-np.maximum(windows, self.least) @ rates.T), len(windows)
            differ = np.moveaxis(sliding_window_view(parts, count, axis=0), 2, 1).reshape(total, -1)
            by = (terms @ part.reshape(len(part), -1)).reshape(total, count, -1)
            added = np.einsum("wik,wk->wi", by, differ)
            for i in range(count):
                changes[i : i + total] += added[:, i]
        return np.asarray(changes)

    def matrix(self, gaps: Array) -> Array:
        """The derivatives of a short row, shape (N, N, 2)."""
        n = len(gaps) + 1
        units = np.eye(2 * n).reshape(2 * n, n, 2)
        return np.array([self.velocities(gaps, unit) for unit in units]).T.reshape(n, n, 2)


def deviations(alone: Row, rows: Sequence[Row], rates: Sequence[Array], least: float) -> Deviations:
    """The derivatives that are nearest to those of short rows.

    Args:
        alone: A single particle.
        rows: Short rows; those without derivatives count as not there.
        rates: Of two, three, ... neighbours, the rates of the terms of their velocities, of which the slowest are used.
        least: Smallest distance that was solved [D_c].
    """
    assert alone.by_particle is not None, "derivatives were asked for"
    found = Deviations(alone.by_particle[0, 0], [], [], least)
    for count, most in TERMS.items():
        known = [
            (row.gaps, row.by_particle) for row in rows if row.by_particle is not None and len(row.values) == count
        ]
        if not known:
            break
        slowest = rates[count - 2][rates[count - 2].sum(axis=1).argsort(kind="stable")[:most]]
        terms = np.exp(-np.array([gaps for gaps, _ in known]) @ slowest.T)
        left = np.array([by_particle - found.matrix(gaps) for gaps, by_particle in known]).reshape(len(known), -1)
        size = np.abs(terms).max(axis=0)
        fit = scipy.linalg.lstsq(terms / size, left, cond=SMALLEST)[0] / size[:, None]
        more = fit.reshape(len(slowest), count, count, 2)
        found = Deviations(found.alone, [*found.rates, slowest], [*found.coefficients, more], least)
    return found
