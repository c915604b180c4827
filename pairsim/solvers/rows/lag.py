"""Lag of the shapes of soft particles behind distances that change.

Where two particles come closer or move apart, their lengths are not those of particles that are held at the same
distance: they follow with a delay. Because of this the distance between their centres is longer by

    lambda = tau (d_t - dU),

in which dU is the rate of the distance between the centres and d_t that of the distance between the surfaces, so that
d_t - dU is the rate at which lengths become shorter, and tau is a relaxation time. For pairs that were solved, lambda
is known to first order in the rates (`Row.lag`). The logarithm of tau is fitted to these, as a linear function of the
logarithm of the distance, of dU, and of the product of both. (For pairs of soft particles with Ca_e = 0.1 at d = 0.04,
tau is 1.20, 0.80, 0.68 and 0.63 D_c/U_av where dU is -0.0156, 0.0013, 0.0062 and 0.0114 U_av. For six pairs that were
not used in the fit, whose sizes differ by up to 12 % and which come closer, lambda is accurate to 4e-4 D_c; it is to
1e-3 where they move apart at 0.035 to 0.042 U_av.)

Particles that are held at first have no lag; it approaches lambda as 1 - exp(-t/tau).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from pairsim.runtime.arrays import Array

if TYPE_CHECKING:
    from pairsim.solvers.rows.model import Row

ROUNDING = 1e-9  # largest relative difference of distances that count as the same
# Rate at which lengths change, relative to the largest one of all pairs, below which a pair is not used; chosen.
SLIGHT = 0.01
ALL = 4  # number of coefficients, and so the least number of pairs for a fit


@dataclass(frozen=True)
class Lag:
    """Relaxation time with which lengths lag behind distances that change.

    Attributes:
        coefficients: The coefficients of 1, log d, dU and dU log d in the logarithm of the relaxation time, shape (4,).
        distances: The smallest and the largest distance of the pairs to which it was fitted [D_c]; outside this range
            the relaxation time is that at the nearer end.
        velocities: The smallest and the largest dU of these pairs [U_av], with the same meaning.
    """

    coefficients: Array
    distances: tuple[float, float]
    velocities: tuple[float, float]

    @classmethod
    def fitted(cls, pairs: Sequence[Row], least: float) -> Self | None:
        """Fit the relaxation time to pairs.

        Args:
            pairs: Pairs of equal and of unequal particles.
            least: Smallest distance of the pairs that are used [D_c].

        Returns:
            The lag; None if shapes do not change, as those of rigid particles, or if too few pairs are known.
        """
        known = [
            (float(row.gaps[0]), float(row.dU[0]), float(row.rates[0] - row.dU[0]), float(row.lag[0]))
            for row in pairs
            if row.lag is not None and row.gaps[0] >= least * (1 - ROUNDING)
        ]
        if not known:
            return None
        d, dU, shorter, lag = np.array(known).T
        tells = (np.abs(shorter) > SLIGHT * np.abs(shorter).max()) & (lag * shorter > 0)
        if np.count_nonzero(tells) < ALL:
            return None
        d, dU, shorter, lag = d[tells], dU[tells], shorter[tells], lag[tells]
        terms, weights = _terms(d, dU), np.abs(shorter)
        found = np.linalg.lstsq(terms * weights[:, None], np.log(lag / shorter) * weights)[0]
        return cls(found, (float(d.min()), float(d.max())), (float(dU.min()), float(dU.max())))

    def time(self, gaps: Array, dU: Array) -> Array:
        """The relaxation times [D_c/U_av] at distances [D_c] and relative velocities [U_av], shape (n,) each."""
        return np.asarray(
            np.exp(_terms(np.clip(gaps, *self.distances), np.clip(dU, *self.velocities)) @ self.coefficients)
        )

    def at(self, gaps: Array, dU: Array, rates: Array) -> Array:
        """lambda, by which distances between centres are longer than for held particles [D_c], shape (n,).

        Args:
            gaps: Distances between surfaces [D_c], shape (n,).
            dU: Relative velocities [U_av], shape (n,).
            rates: Rates of the distances between surfaces [U_av], shape (n,).
        """
        return self.time(gaps, dU) * (rates - dU)


def _terms(d: Array, dU: Array) -> Array:
    """The functions of which the logarithm of the relaxation time is a linear combination, shape (n, 4)."""
    return np.stack([np.ones_like(d), np.log(d), dU, dU * np.log(d)], axis=-1)
