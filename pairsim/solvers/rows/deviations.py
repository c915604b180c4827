"""What particles change in a row that differ from the others in size or softness.

The derivatives of all velocities by diameter and Ca_e of each particle are taken apart as velocities are
(`pairsim.solvers.rows.model`): what its own size and softness do to a particle alone, what they do to it and to its
neighbour in a pair, and what a third particle changes in that. Of second order are what the own size and softness do to
a particle alone, and the sizes to a pair.

Soft particles that are pushed together or pulled apart become shorter or longer, the more the faster one of them is
than the other: what sizes change of the lengths of a pair changes the rate of its distance at given velocities.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view

from pairsim.runtime.arrays import Array

if TYPE_CHECKING:
    from pairsim.solvers.rows.model import Row

# Exponentials by the number of particles; of derivatives the slopes are not known, by which velocities are fitted, too.
TERMS = {2: 6, 3: 6}  # chosen
TERMS_OF_SECOND_ORDER = 4  # of the second derivatives of pairs; chosen
SMALLEST = 1e-5  # singular values that are left out, relative to the largest; chosen


@dataclass(frozen=True)
class Parts:
    """What a number of neighbours add to derivatives of their velocities.

    Attributes:
        rates: Those at which each term decays with every distance [1/D_c], shape (m, k-1) for k particles.
        coefficients: Those of the terms, shape (m, ...).
    """

    rates: Array
    coefficients: Array

    def at(self, windows: Array) -> Array:
        """Their sums at distances of so many neighbours, (n, k-1) [D_c], shape (n, ...)."""
        return np.tensordot(np.exp(-windows @ self.rates.T), self.coefficients, 1)

    def slopes(self, gaps: Array) -> Array:
        """Their derivatives by the distance of pairs, (n,) [D_c], shape (n, ...)."""
        return np.tensordot(-self.rates[:, 0] * np.exp(-gaps[:, None] * self.rates[:, 0]), self.coefficients, 1)

    @classmethod
    def fitted(cls, rates: Array, places: Array, values: Array) -> Parts:
        """The parts, of the slowest rates, that are nearest to values at places."""
        terms = np.exp(-places @ rates.T)
        size = np.abs(terms).max(axis=0)
        fit = scipy.linalg.lstsq(terms / size, values.reshape(len(places), -1), cond=SMALLEST)[0] / size[:, None]
        return cls(rates, fit.reshape(len(rates), *values.shape[1:]))


@dataclass(frozen=True)
class Deviations:
    """Derivatives of the velocities of a row by the logarithms of diameter and Ca_e of its particles.

    Attributes:
        alone: Those of a single particle by its own [U_av], shape (2,).
        parts: What two, three, ... neighbours add, shape (m, k, k, 2) of the coefficients for k of them.
        least: Smallest distance that was solved; derivatives at smaller ones are those at this one [D_c].
        alone_twice: Second derivatives of a single particle [U_av], shape (2, 2).
        pairs_twice: What a pair adds to these, shape (m, 2, 2, 2, 2, 2) of the coefficients; None where it is not
            known.
        lengths: What a pair adds to the derivatives of the distances between centres, beside those between surfaces, by
            diameters [D_c], shape (m, 2, 2) of the coefficients: to the next particle, for the second one far away, by
            each of the two; None where it is not known.
    """

    alone: Array
    parts: Sequence[Parts]
    least: float
    alone_twice: Array = field(default_factory=lambda: np.zeros((2, 2)))
    pairs_twice: Parts | None = None
    lengths: Parts | None = None

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
            for i in range(count):
                changes[i : i + len(windows)] += added[:, i]
        return np.asarray(changes)

    def stretch(self, of_equals: Array, gaps: Array, parts: Array) -> Array:
        """Derivatives of the distances between centres by those between surfaces.

        Where particles differ much and are near, sums to first order are no longer positive, as these derivatives are:
        the logarithm of each by the own distance is taken to first order.

        Args:
            of_equals: Those of equal particles, a banded matrix as of `RowModel.along`, shape (2 k + 1, N-1).
            gaps, parts: As for `velocities`.
        """
        if self.lengths is None or not len(gaps):
            return of_equals
        found, middle = of_equals.copy(), len(of_equals) // 2
        _, differ = _windows(gaps, parts[:, :1], 2)
        slopes = self.lengths.slopes(np.maximum(gaps, self.least)) * (gaps >= self.least)[:, None, None]
        first, second = np.einsum("wij,wj->iw", slopes, differ[..., 0])
        found[middle] *= np.exp(first / of_equals[middle])
        found[middle + 1, :-1] += second[:-1]  # the last particle has no next one
        return found

    def matrix(self, gaps: Array) -> Array:
        """The derivatives of a short row of equal particles, shape (N, N, 2)."""
        n = len(gaps) + 1
        units = np.eye(2 * n).reshape(2 * n, n, 2)
        return np.array([self._of_first_order(gaps, unit) for unit in units]).T.reshape(n, n, 2)


def _windows(gaps: Array, parts: Array, count: int) -> tuple[Array, Array]:
    """Distances and deviations of so many neighbours along a row, (w, count - 1) and (w, count, 2)."""
    return sliding_window_view(gaps, count - 1), np.moveaxis(sliding_window_view(parts, count, axis=0), 2, 1)


def deviations(
    alone: Row, rows: Sequence[Row], unequal: Sequence[Row], rates: Sequence[Array], least: float
) -> Deviations:
    """The derivatives that are nearest to those of short rows.

    Args:
        alone: A single particle.
        rows: Short rows; those without derivatives count as not there.
        unequal: Short rows in which one particle differs, for what is of second order.
        rates: Of two, three, ... neighbours, the rates of the terms of their velocities, of which the slowest are used.
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
        part = Parts.fitted(_slowest(rates[count - 2], most), np.array([gaps for gaps, _ in known]), left)
        found = replace(found, parts=[*found.parts, part])
    return _with_second_order(found, unequal, rates)


def _slowest(rates: Array, most: int) -> Array:
    return np.asarray(rates[rates.sum(axis=1).argsort(kind="stable")[:most]])


def _with_second_order(first: Deviations, unequal: Sequence[Row], rates: Sequence[Array]) -> Deviations:
    """Derivatives with those of second order, as far as these are known."""
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
    left[..., 1, :, 1] = 0.0  # those by two moduli are not known
    twice = Parts.fitted(_slowest(rates[0], TERMS_OF_SECOND_ORDER), pairs, left)
    return replace(found, pairs_twice=twice, lengths=_lengths(pairs, unequal, _slowest(rates[0], TERMS[2])))


def _lengths(places: Array, unequal: Sequence[Row], rates: Array) -> Parts:
    """`Deviations.lengths` of pairs at places, (n, 1) [D_c]."""
    rear, front, found = 0.0, 0.0, np.zeros((len(places), 2, 2))
    for row in unequal:
        assert row.parts is not None
        (j, k), *_ = np.argwhere(row.parts)
        if k:
            continue
        each = 1 / (2 * row.parts[j, 0])
        if len(row.values) == 1:
            rear, front = rear + row.rear * each, front + row.values[0, 1] * each
        else:
            found[np.argmax((places == row.gaps).all(axis=1)), :, j] += row.values[:, 1] * each
    return Parts.fitted(rates, places, found - [[front, rear], [0.0, front]])


def _second_derivatives(gaps: Array, unequal: Sequence[Row]) -> Array:
    """Second derivatives of the velocities of a short row, shape (N, N, 2, N, 2); 0 where they are not known.

    They are half the differences of the first ones of two rows, in which a particle is larger and smaller, or softer
    and stiffer.
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
