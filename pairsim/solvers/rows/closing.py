"""Approach of particles that are closer to each other than those in any of the short rows of a model.

The film of liquid between two soft particles that are pushed together is wide and flat. It resists more than that
between two spheres, and the more so the softer the particles are. Its resistance is known from one pair, which is
solved down to distances below the smallest one of the short rows. The upstream particle of this pair is smaller, and so
faster, than the downstream one: the two come closer. The results for this pair are used for all pairs of such
particles:

- the relative velocity at each distance, relative to that at the smallest distance of the short rows;
- the rate of the distance between the surfaces, relative to the same;
- the share of the upstream particle in the reduction of the relative velocity by the film, which makes this particle
  slower; the rest makes the downstream one faster. (The shares of rigid particles are almost equal. That of the
  upstream one of soft particles with Ca_e = 0.1 is 1, so that two in contact are slower than each by itself.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import TYPE_CHECKING, Self

import numpy as np
import scipy

from pairsim.runtime.arrays import Array

if TYPE_CHECKING:
    from pairsim.solvers.rows.model import Row

ROUNDING = 1e-9  # largest relative difference of distances that count as the same
SHARE = 0.5  # share of each of two particles with the same mobility
LEAST_POWER = 1.0  # least power of the distance with which rates vanish, that of a film between spheres


@dataclass(frozen=True)
class Closing:
    """Factors by which films slow down particles that come closer.

    Attributes:
        distances: The distances at which the pair was solved, ascending [D_c], shape (m,).
        factors: The rate of the distance (first column) and the relative velocity (second one) at each of these
            distances, relative to those at the smallest distance of the short rows; 1 beyond that distance, shape
            (m, 2).
        shares: The share of the upstream particle in the reduction of the relative velocity, from 0 to 1, shape (m,).
        errors: Relative half-widths of the relative velocities, shape (m,).
    """

    distances: Array
    factors: Array
    shares: Array
    errors: Array

    @classmethod
    def of(cls, rows: Sequence[Row], least: float) -> Self | None:
        """The factors from solutions of one pair at several distances.

        Args:
            rows: The solutions.
            least: Smallest distance of the short rows, at which the pair was solved, too [D_c].

        Returns:
            The factors; None if the particles come closer in fewer than two of the solutions at this distance and
            below, because they repel each other more strongly than the difference of their sizes drives them together.
        """
        above = [row for row in rows if row.gaps[0] > least * (1 + ROUNDING) and row.rates[0] < 0]
        below = sorted((row for row in rows if row.gaps[0] <= least * (1 + ROUNDING)), key=lambda row: -row.gaps[0])
        below = list(takewhile(lambda row: row.rates[0] < 0, below))
        if len(below) < 2:
            return None
        every = sorted([*above, *below], key=lambda row: float(row.gaps[0]))
        distances = np.array([row.gaps[0] for row in every])
        found = np.array([[row.rates[0], row.dU[0]] for row in every])
        factors, first = np.minimum(found / [below[0].rates[0], below[0].dU[0]], 1.0), below[0].U
        factors[len(below) :] = 1.0
        shares = np.full(len(every), SHARE)
        for i, row in enumerate(reversed(below[1:])):
            if (taken := row.dU[0] - below[0].dU[0]) > 0:
                shares[i] = min(max((first[0] - row.U[0]) / taken, 0.0), 1.0)
        shares[len(below) - 1 :] = shares[len(below) - 2]
        return cls(distances, factors, shares, np.array([row.dU_error / abs(float(row.dU[0])) for row in every]))

    @property
    def faster(self) -> Self:
        """The same with a faster approach, by the half-widths of the velocities of the pair.

        The larger part of these half-widths is due to the terms that the series for the effect of motion leaves out.
        """
        return replace(self, factors=self.factors * (1 + self.errors)[:, None])

    def changed(self, U: Array, gaps: Array) -> Array:
        """Changes of the velocities of the particles of a row or stream by films [U_av], shape (N,).

        Each film makes its upstream particle slower by its share, and the downstream one faster by the rest. The
        relative velocity of these two then is the film's factor times the relative velocity with all other films.

        Args:
            U: Velocities without films [U_av], shape (N,); those of particles closer than the smallest distance of the
                short rows are those at that distance.
            gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).
        """
        full, left = 1 / self.factor(gaps)[:, 1] - 1, np.diff(U)
        shares = np.interp(np.log(gaps), np.log(self.distances), self.shares)
        # (1 + q_i) dU'_i - s_(i+1) q_(i+1) dU'_(i+1) - (1 - s_(i-1)) q_(i-1) dU'_(i-1) = dU_i, with q = 0 where dU' > 0
        q, closing = np.zeros(len(gaps)), np.zeros(len(gaps), bool)
        for _ in range(len(gaps)):
            if np.array_equal(closing, closing := (left < 0) & (full != 0)):
                break
            q = np.where(closing, full, 0.0)
            upstream, downstream = shares * q, (1 - shares) * q
            matrix = np.array([np.append(0.0, -upstream[1:]), 1 + q, np.append(-downstream[:-1], 0.0)])
            left = scipy.linalg.solve_banded((1, 1), matrix, np.diff(U))
        return np.append(shares * q * left, 0.0) - np.append(0.0, (1 - shares) * q * left)

    def rates(self, dU: Array, rates: Array, gaps: Array) -> Array:
        """Rates of the distances between surfaces with films [U_av], shape (N-1,).

        They differ from the relative velocities, as the lengths of the particles change with the distances. For
        particles that come closer the ratio of the two varies with the distance as that of the solved pair does.

        Args:
            dU: Relative velocities with films [U_av], shape (N-1,).
            rates: Rates of the distances that belong to these velocities if lengths change as they do at the smallest
                distance of the short rows [U_av], shape (N-1,).
            gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).
        """
        of_distance, of_dU = self.factor(gaps).T
        return np.where(dU < 0, rates * of_distance / of_dU, rates)

    def factor(self, gaps: Array) -> Array:
        """The factors, shape (n, 2), at distances, (n,) [D_c].

        Between two solved distances, and below the smallest one, they vary as a power of the distance.
        """
        x, y, at = np.log(self.distances), np.log(self.factors), np.log(gaps)
        found = []
        for each in y.T:
            power = max((each[1] - each[0]) / (x[1] - x[0]), LEAST_POWER)
            found.append(np.exp(np.where(at < x[0], each[0] + power * (at - x[0]), np.interp(at, x, each))))
        return np.array(found).T
