"""How particles come closer that are nearer than all rows of which a model is made.

The film between two soft particles that are pushed together is wide and flat: it resists more than that between
spheres, the more the softer they are. How much is known from a pair whose particles come closer as the upstream one is
smaller, solved down to small distances. Its relative velocity and the rate of its distance there, as parts of those at
the least distance of the model, and by which part the upstream particle is slowed down and the other one not made
faster, are taken for all pairs of these particles. (Rigid particles share it almost equally. Of soft ones with
Ca_e = 0.1 the upstream one takes it all: both are slower in contact than by themselves.)
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

ROUNDING = 1e-9  # of distances
SHARE = 0.5  # of particles that are moved equally easily
LEAST_POWER = 1.0  # of the distance, with which rates go to 0: that of a film between spheres


@dataclass(frozen=True)
class Closing:
    """By which factor particles that come closer are slower than at the least distance of a model.

    Attributes:
        distances: Those that were solved, ascending [D_c], shape (m,).
        factors: Rates of the distance there and relative velocities, as parts of those at the least distance of the
            model, 1 from there on, shape (m, 2).
        shares: Of what is taken off the relative velocity, the part by which the upstream particle is slower, (m,).
        errors: Half-widths of the velocities there over the velocities, shape (m,).
    """

    distances: Array
    factors: Array
    shares: Array
    errors: Array

    @classmethod
    def of(cls, rows: Sequence[Row], least: float) -> Self | None:
        """That of rows of two particles that come closer, one of which is at the least distance of the model [D_c].

        Returns:
            None where there are fewer than two up to there: where particles repel each other more than their sizes
            push them.
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
        """The same with particles that come closer as much faster as they may be by the errors of these rows.

        Most of it is what is left out of the series for how far shapes lag behind distances that change.
        """
        return replace(self, factors=self.factors * (1 + self.errors)[:, None])

    def changed(self, U: Array, gaps: Array) -> Array:
        """What films change of the velocities of the particles of a row or stream [U_av], shape (N,).

        Each film slows down its upstream particle by its share, and makes the other one faster by what is left; of the
        relative velocity that neighbours would have by all other films it leaves its factor.

        Args:
            U: Velocities at the least distance of the model where particles are nearer [U_av], shape (N,).
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
        """Rates of the distances with films, where lengths change along with them, too [U_av], shape (N-1,).

        Args:
            dU: Relative velocities with films [U_av], shape (N-1,).
            rates: Rates of the distances with these, at lengths as at the least distance of the model [U_av], (N-1,).
            gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).
        """
        of_distance, of_dU = self.factor(gaps).T
        return np.where(dU < 0, rates * of_distance / of_dU, rates)

    def factor(self, gaps: Array) -> Array:
        """The factors at distances, (n,) [D_c]; powers of these between and below the solved ones, (n, 2)."""
        x, y, at = np.log(self.distances), np.log(self.factors), np.log(gaps)
        found = []
        for each in y.T:
            power = max((each[1] - each[0]) / (x[1] - x[0]), LEAST_POWER)
            found.append(np.exp(np.where(at < x[0], each[0] + power * (at - x[0]), np.interp(at, x, each))))
        return np.array(found).T
