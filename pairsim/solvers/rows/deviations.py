"""Changes of the velocities of a row whose particles differ from each other in size or softness.

The derivatives of all velocities with respect to the diameter and the Ca_e of each particle are sums of contributions,
as velocities are (`pairsim.solvers.rows.model`): that of a particle's own size and softness if it is alone, that of the
sizes and moduli of a pair to both of its velocities, and that of three neighbours. There are second-order terms of a
single particle's own size and softness, and of pairs, in which at least one derivative is that by a size.

Changes of the lengths of soft particles are in `pairsim.solvers.rows.stretch`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from pairsim.runtime.arrays import Array
from pairsim.solvers.rows.exponential_sums import ExponentialSum, Remainder, slowest
from pairsim.solvers.rows.stretch import Stretch

if TYPE_CHECKING:
    from pairsim.solvers.rows.model import Row

# Number of exponentials, by the number of particles. There are fewer than for velocities, which are fitted to slopes as
# well: the slopes of the derivatives are not known.
TERMS = {2: 6, 3: 6}  # chosen
TERMS_OF_SECOND_ORDER = 4  # of the second derivatives of pairs; chosen


@dataclass(frozen=True)
class Deviations:
    """Derivatives of the velocities of a row with respect to the logarithms of diameter and Ca_e of its particles.

    Attributes:
        alone: Derivatives of the velocity of a single particle with respect to its own diameter and Ca_e [U_av], shape
            (2,).
        parts: Contributions of two, three, ... neighbours to the derivatives of their velocities; the coefficients for
            k neighbours have the shape (m, k, k, 2): term, velocity, particle, diameter or Ca_e.
        least: Smallest distance that was solved [D_c]; at smaller ones the derivatives are those at this one.
        alone_twice: Second derivatives of the velocity of a single particle [U_av], shape (2, 2).
        pairs_twice: Contribution of a pair to the second derivatives; the coefficients have the shape
            (m, 2, 2, 2, 2, 2). None if it is not known.
        stretch: Changes of the lengths of soft particles; None if they are not known, or particles are rigid.
        remainder: For a variant by which errors are judged: a change of some first-order terms, of the size of those
            that the series may leave out; None for no change.
        remainder_twice: The same for the second-order terms of pairs.
    """

    alone: Array
    parts: Sequence[ExponentialSum]
    least: float
    alone_twice: Array = field(default_factory=lambda: np.zeros((2, 2)))
    pairs_twice: ExponentialSum | None = None
    stretch: Stretch | None = None
    remainder: Remainder | None = None
    remainder_twice: Remainder | None = None

    def velocities(self, gaps: Array, parts: Array) -> Array:
        """Changes of the velocities of a row [U_av], shape (N,).

        Args:
            gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).
            parts: Deviations of the logarithms of diameter and Ca_e of each particle, shape (N, 2).
        """
        changes = self._of_first_order(gaps, parts) + np.einsum("nk,kl,nl->n", parts, self.alone_twice, parts) / 2
        if self.pairs_twice is not None and len(gaps):
            windows, differ = _windows(np.maximum(gaps, self.least), parts, 2)
            added = np.einsum("wijkml,wjk,wml->wi", self.pairs_twice.at(windows), differ, differ) / 2
            if self.remainder_twice is not None:
                added *= self.remainder_twice.factors(windows)
            changes[:-1] += added[:, 0]
            changes[1:] += added[:, 1]
        return np.asarray(changes)

    def _of_first_order(self, gaps: Array, parts: Array) -> Array:
        changes = parts @ self.alone
        for count, part in enumerate(self.parts, 2):
            if len(gaps) < count - 1:
                break
            windows, differ = _windows(np.maximum(gaps, self.least), parts, count)
            added = np.einsum("wijk,wjk->wi", part.at(windows), differ)
            if self.remainder is not None and self.remainder.count == count:
                added *= self.remainder.factors(windows)
            for i in range(count):
                changes[i : i + len(windows)] += added[:, i]
        return np.asarray(changes)

    def matrix(self, gaps: Array) -> Array:
        """The first derivatives in a short row of equal particles at distances (N-1,) [D_c], shape (N, N, 2)."""
        n = len(gaps) + 1
        units = np.eye(2 * n).reshape(2 * n, n, 2)
        return np.array([self._of_first_order(gaps, unit) for unit in units]).T.reshape(n, n, 2)


def _windows(gaps: Array, parts: Array, count: int) -> tuple[Array, Array]:
    """Distances and deviations of each set of `count` neighbours in a row, (w, count - 1) and (w, count, 2)."""
    return sliding_window_view(gaps, count - 1), np.moveaxis(sliding_window_view(parts, count, axis=0), 2, 1)


def deviations(
    alone: Row, rows: Sequence[Row], unequal: Sequence[Row], rates: Sequence[Array], least: float
) -> Deviations:
    """Fit the derivatives to those of short rows.

    Args:
        alone: A single particle.
        rows: Short rows of equal particles; those whose derivatives are not known are left out.
        unequal: Short rows in which one particle differs, from which the terms of second order follow.
        rates: For two, three, ... neighbours, the rates at which the terms of their velocities decay with the distances
            [1/D_c]. Derivatives have only those of these terms that decay most slowly.
        least: Smallest distance that was solved [D_c].
    """
    assert alone.by_particle is not None, "derivatives were asked for"
    found = Deviations(alone.by_particle[0, 0], [], least)
    for count, most in TERMS.items():
        known = [
            (row.gaps, row.by_particle) for row in rows if row.by_particle is not None and len(row.values) == count
        ]
        if not known:
            break
        left = np.array([by_particle - found.matrix(gaps) for gaps, by_particle in known])
        part = ExponentialSum.fitted(slowest(rates[count - 2], most), np.array([gaps for gaps, _ in known]), left)
        found = replace(found, parts=[*found.parts, part])
    return _with_second_order(found, unequal, rates)


def _with_second_order(first: Deviations, unequal: Sequence[Row], rates: Sequence[Array]) -> Deviations:
    """The first derivatives, completed with the second derivatives that are known."""
    second = {tuple(row.gaps.tolist()): _second_derivatives(row.gaps, unequal) for row in unequal}
    if () not in second:
        return first
    found = replace(first, alone_twice=second.pop(())[0, 0, :, 0])
    pairs = np.array([gaps for gaps in second if len(gaps) == 1])
    if not len(pairs):
        return found
    left = np.array([second[tuple(gaps)] for gaps in pairs.tolist()])
    for i in range(2):
        left[:, i, i, :, i] -= found.alone_twice
    left[..., 1, :, 1] = 0.0  # those with respect to two moduli are not known
    twice = ExponentialSum.fitted(slowest(rates[0], TERMS_OF_SECOND_ORDER), pairs, left)
    return replace(found, pairs_twice=twice)


def _second_derivatives(gaps: Array, unequal: Sequence[Row]) -> Array:
    """Second derivatives of the velocities of a short row, shape (N, N, 2, N, 2); 0 where they are not known.

    They are central differences of the first derivatives, between a row in which one particle is larger (or softer) and
    one in which it is smaller (or stiffer) by the same factor.
    """
    n = len(gaps) + 1
    found, known = np.zeros((n, n, 2, n, 2)), np.zeros((n, 2), bool)
    for row in unequal:
        if row.gaps.tolist() == gaps.tolist() and row.parts is not None and row.by_particle is not None:
            (j, k), *_ = np.argwhere(row.parts)
            found[..., j, k] += row.by_particle / (2 * row.parts[j, k])
            known[j, k] = True
    mirrored = np.transpose(found, (0, 3, 4, 1, 2))
    both = known[:, :, None, None] & known
    return np.where(both, (found + mirrored) / 2, found + mirrored)
