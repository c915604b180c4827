"""What the size of the time steps leaves in dU, estimated from the rows of a run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pairsim.runtime.arrays import Array

# Measured against fine steps (docs/notebook/accuracy.md, "Steps").
SAFETY = 1.1
FEW, FEW_FACTOR = 3, 3.0  # of the first steps less is known: no row before them tells how fast stresses set in
SET_IN = 5e-3  # time in which stresses set in whatever the steps; dU there is not what a run is read for
LEAST = 1e-6  # dU below this is rounding and the mesh's: that of rigid pairs


class TimeError:
    """Largest local error of dU by the time steps.

    BDF of order k leaves prod(t - t_i) dU^(k)/(k + 1)! of dU in its step, over the k old times t_i. The derivative is a
    divided difference of the rows, all of one mesh: at a remeshing dU jumps by the error of the mesh, and once more in
    the row after it.

    Args:
        order: Order of the error that is looked at: 3 is that of the scheme; 2 allows for the stresses of a
            viscoelastic liquid, whose own error dU does not show.
    """

    def __init__(self, order: int) -> None:
        self.order = order
        self._count = self._mesh = 0
        self._times: list[float] = []
        self._values: list[Array] = []
        self._largest = self._peak = 0.0

    def add(self, t: float, mesh: int, dU: Sequence[float] | Array) -> None:
        """Take in a row: its time, the remeshings before it, the relative velocities of all neighbours."""
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
        if 0 < step <= self.order and known == step + 1:  # the step before began at rest, with fewer rows behind it
            self._take(step - 1, times[-2], np.array([0.0, *times[:-2]]), size)
        if known == self.order + 1:
            self._take(step, times[-1], times[:-1], size)

    def _take(self, step: int, t: float, old: Array, size: float) -> None:
        if t > SET_IN * (1 + 1e-9):
            factor = SAFETY * (FEW_FACTOR if step < FEW else 1.0)
            self._largest = max(self._largest, factor * size * float(np.prod(t - old)))

    @property
    def part(self) -> float:
        """The error as a part of the largest |dU|."""
        return self._largest / max(self._peak, LEAST)
