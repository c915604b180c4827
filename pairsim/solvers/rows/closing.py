"""How particles come closer that are nearer than all rows of which a model is made.

The film between two soft particles that are pushed together is wide and flat: it resists more than that between
spheres, the more the softer they are. How much is known from a pair whose particles come closer as the upstream one is
smaller, solved down to small distances: how fast it is there, as a part of how fast it is at the least distance of the
model, is taken for all pairs of these particles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import TYPE_CHECKING, Self

import numpy as np

from pairsim.runtime.arrays import Array

if TYPE_CHECKING:
    from pairsim.solvers.rows.model import Row

ROUNDING = 1e-9  # of distances
LEAST_POWER = 1.0  # of the distance, with which rates go to 0: that of a film between spheres


@dataclass(frozen=True)
class Closing:
    """By which factor particles that come closer are slower than at the least distance of a model.

    Attributes:
        distances: Those that were solved, ascending [D_c], shape (m,).
        factors: The factors there, 1 from the least distance of the model on, shape (m,).
        errors: Half-widths of the velocities there over the velocities, shape (m,).
    """

    distances: Array
    factors: Array
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
        distances, rates = np.array([[row.gaps[0], row.rates[0]] for row in every]).T
        factors = np.minimum(rates / below[0].rates[0], 1.0)
        factors[len(below) :] = 1.0
        return cls(distances, factors, np.array([row.dU_error / abs(float(row.dU[0])) for row in every]))

    @property
    def faster(self) -> Self:
        """The same with particles that come closer as much faster as they may be by the errors of these rows.

        Most of it is what is left out of the series for how far shapes lag behind distances that change.
        """
        return replace(self, factors=self.factors * (1 + self.errors))

    def factor(self, gaps: Array) -> Array:
        """The factors at distances [D_c], between the solved ones and below them powers of the distance."""
        x, y, at = np.log(self.distances), np.log(self.factors), np.log(gaps)
        power = max((y[1] - y[0]) / (x[1] - x[0]), LEAST_POWER)
        return np.asarray(np.exp(np.where(at < x[0], y[0] + power * (at - x[0]), np.interp(at, x, y))))
