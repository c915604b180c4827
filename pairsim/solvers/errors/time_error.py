"""Estimate of the error of dU by the time steps, from the accepted steps of a run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pairsim.runtime.arrays import Array

# SAFETY, FEW_FACTOR and SET_IN were fitted to errors measured against fine steps, with eleven step settings of three
# pairs (docs/explanation/decisions.md, "Time steps").
SAFETY = 1.1
FEW, FEW_FACTOR = 3, 3.0  # number of first steps, whose error is less certain for lack of earlier values; their factor
SET_IN = 5e-3  # initial time that is excluded: stresses build up within it, and dU is not of interest [D_c/U_av]
LEAST = 1e-6  # |dU| up to which dU consists of rounding and mesh errors, as for equal rigid particles [U_av]; chosen


class TimeError:
    """Largest local error of dU caused by the time steps.

    The local error of BDF of order k is prod(t - t_i) dU^(k)/(k + 1)!, with the product over the k old times t_i. The
    derivative dU^(k) is estimated by a divided difference of accepted values on the same mesh, since dU jumps by the
    error of the mesh at a remeshing and in the step after it.

    Args:
        order: Order k: 3 is the order of the scheme; 2 is used for viscoelastic liquids, in which the error of the
            stresses is not visible in dU.
    """

    def __init__(self, order: int) -> None:
        self.order = order
        self._count = self._mesh = 0
        self._times: list[float] = []
        self._values: list[Array] = []
        self._largest = self._peak = 0.0

    def add(self, t: float, mesh: int, dU: Sequence[float] | Array) -> None:
        """Add an accepted step.

        Args:
            t: Time [D_c/U_av].
            mesh: Number of remeshings before the step.
            dU: Relative velocities of neighbouring particles [U_av], N-1 values.
        """
        step, self._count = self._count, self._count + 1
        if mesh != self._mesh:
            self._mesh, self._times, self._values = mesh, [], []
            return
        self._times = [*self._times, t][-self.order - 1 :]
        self._values = [*self._values, np.asarray(dU, float)][-self.order - 1 :]
        self._peak = max(self._peak, float(np.max(np.abs(dU), initial=0.0)))
        times, known = np.array(self._times), len(self._times)
        difference = np.array(self._values)
        for k in range(1, known):
            difference = np.diff(difference, axis=0) / (times[k:] - times[:-k])[:, None]
        size = float(np.max(np.abs(difference), initial=0.0)) / known
        if 0 < step <= self.order and known == step + 1:  # the previous step had fewer old values
            self._take(step - 1, times[-2], np.array([0.0, *times[:-2]]), size)
        if known == self.order + 1:
            self._take(step, times[-1], times[:-1], size)

    def _take(self, step: int, t: float, old: Array, size: float) -> None:
        if t > SET_IN * (1 + 1e-9):
            factor = SAFETY * (FEW_FACTOR if step < FEW else 1.0)
            self._largest = max(self._largest, factor * size * float(np.prod(t - old)))

    @property
    def largest(self) -> float:
        """Largest error so far [U_av]."""
        return self._largest

    @property
    def peak(self) -> float:
        """Largest |dU| so far, at least LEAST [U_av]."""
        return max(self._peak, LEAST)

    @property
    def part(self) -> float:
        """Largest error relative to the largest |dU|."""
        return self._largest / self.peak
