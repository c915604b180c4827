"""How fast particles come closer that are nearer to each other than those in any of the short rows of a model.

The film of liquid between two soft particles that are pushed together is wide and flat. It resists more than that
between two spheres, and the more the softer the particles are. How much it resists is known from one pair, which is
solved down to distances below the least one of the short rows. Its upstream particle is smaller, and so faster, than
the downstream one: the two come closer. What is found of this pair is taken for all pairs of such particles:

- the relative velocity at each distance, as a part of that at the least distance of the short rows;
- the rate of the distance between the surfaces, likewise;
- which share of what the film takes off the relative velocity is a lower velocity of the upstream particle. The rest is
  a higher velocity of the downstream one. (The shares of rigid particles are almost equal. Of soft particles with
  Ca_e = 0.1 that of the upstream one is 1, so that both are slower in contact than by themselves.)
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

ROUNDING = 1e-9  # relative difference of distances that are the same
SHARE = 0.5  # of each of two particles that are moved equally easily
LEAST_POWER = 1.0  # of the distance, with which rates go to 0: that of a film between spheres


@dataclass(frozen=True)
class Closing:
    """By which factors films slow down particles that come closer.

    Attributes:
        distances: The distances at which the pair was solved, ascending [D_c], shape (m,).
        factors: The rate of the distance (first column) and the relative velocity (second one) at each of them, as
            parts of those at the least distance of the short rows, and 1 beyond it, shape (m, 2).
        shares: The share of the upstream particle in what is taken off the relative velocity, from 0 to 1, shape (m,).
        errors: Half-widths of the relative velocities, as parts of these, shape (m,).
    """

    distances: Array
    factors: Array
    shares: Array
    errors: Array

    @classmethod
    def of(cls, rows: Sequence[Row], least: float) -> Self | None:
        """The factors that solutions of one pair at several distances have.

        Args:
            rows: The solutions.
            least: Least distance of the short rows, which is that of one of the solutions [D_c].

        Returns:
            None where the particles come closer in fewer than two of the solutions at this distance and below: they
            then repel each other more strongly than the difference of their sizes drives them together.
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
        """The same with particles that come closer faster, by the half-widths of the velocities of the pair.

        The larger part of these half-widths is by the terms that are left out of the series for how far shapes lag
        behind distances that change.
        """
        return replace(self, factors=self.factors * (1 + self.errors)[:, None])

    def changed(self, U: Array, gaps: Array) -> Array:
        """By how much films change the velocities of the particles of a row or stream [U_av], shape (N,).

        Each film makes its upstream particle slower by its share, and the downstream one faster by the rest. The
        relative velocity of these two is then its factor times what it would be if all films but this one acted.

        Args:
            U: Velocities without films; of particles that are nearer than the least distance of the short rows those at
                that distance [U_av], shape (N,).
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

        They differ from the relative velocities, as the lengths of the particles change with the distances. Between
        particles that come closer the ratio of the two is that of the solved pair.

        Args:
            dU: Relative velocities with films [U_av], shape (N-1,).
            rates: Rates of the distances at these velocities, if lengths changed as they do at the least distance of
                the short rows [U_av], shape (N-1,).
            gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).
        """
        of_distance, of_dU = self.factor(gaps).T
        return np.where(dU < 0, rates * of_distance / of_dU, rates)

    def factor(self, gaps: Array) -> Array:
        """The factors at distances, (n,) [D_c], shape (n, 2).

        Between two solved distances, and below the least of them, they are proportional to a power of the distance.
        """
        x, y, at = np.log(self.distances), np.log(self.factors), np.log(gaps)
        found = []
        for each in y.T:
            power = max((each[1] - each[0]) / (x[1] - x[0]), LEAST_POWER)
            found.append(np.exp(np.where(at < x[0], each[0] + power * (at - x[0]), np.interp(at, x, each))))
        return np.array(found).T
