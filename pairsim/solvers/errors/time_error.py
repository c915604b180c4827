"""Indicator of the error of a goal of a run that is due to the time steps, from the accepted steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pairsim.runtime.arrays import Array

# SAFETY, FEW_FACTOR and SET_IN were fitted to errors measured against fine steps, with eleven step settings of three
# pairs (docs/explanation/decisions.md, "Time steps").
SAFETY = 1.1
FEW = 3  # number of first steps, whose error is less certain as there are few earlier values
FEW_FACTOR = 3.0  # factor of their error
SET_IN = 5e-3  # initial time that is excluded: stresses build up within it, and dU is not of interest [D_c/U_av]
LEAST = 1e-6  # |dU| up to which dU consists of rounding and mesh errors, as for equal rigid particles [U_av]; chosen


@dataclass
class TimeError:
    """Largest indicator of the local error of a goal, such as dU, that is due to the time steps.

    The indicator prod(t - t_i) dU^(k)/(k + 1)!, with the product over the k old times t_i, is the defect of BDF of
    order k for the equation y' = dU of the distances. It gives the size of local errors of dU, to whose measured values
    SAFETY and FEW_FACTOR were fitted, and is no bound on their sum; for velocities, shapes and pressure drops it is
    used by analogy, in their units. The derivative dU^(k) is estimated by a divided difference of accepted values on
    the same mesh, since dU jumps by the error of the mesh at a remeshing and in the step after it.

    Attributes:
        order: Order k: 3 is the order of the scheme; 2 is used for viscoelastic liquids, in which the error of the
            stresses is not visible in dU.
        largest: Largest indicator so far, in the unit of the goal.
        largest_dU: Largest absolute value of the goal so far.
        count: Number of steps since `begun`.
        mesh: Number of remeshings before the last step.
        times: Times of the last steps on this mesh, oldest first, at most order + 1.
        values: Values of the goal at these times, shape (k,) each.
        begun: Time at which steps last began with the first order, at the start or a kink of the flow [D_c/U_av].
    """

    order: int
    largest: float = 0.0
    largest_dU: float = 0.0
    count: int = 0
    mesh: int = 0
    times: list[float] = field(default_factory=list)
    values: list[Array] = field(default_factory=list)
    begun: float = 0.0

    def add(self, t: float, mesh: int, dU: Sequence[float] | Array) -> None:
        """Add an accepted step.

        Args:
            t: Time [D_c/U_av].
            mesh: Number of remeshings before the step.
            dU: Values of the goal, such as the relative velocities of neighbouring particles [U_av], N-1 values.
        """
        step, self.count = self.count, self.count + 1
        if mesh != self.mesh:
            self.mesh, self.times, self.values = mesh, [], []
            return
        self.times = [*self.times, t][-self.order - 1 :]
        self.values = [*self.values, np.asarray(dU, float)][-self.order - 1 :]
        self.largest_dU = max(self.largest_dU, float(np.max(np.abs(dU), initial=0.0)))
        times, known = np.array(self.times), len(self.times)
        difference = np.array(self.values)
        for k in range(1, known):
            difference = np.diff(difference, axis=0) / (times[k:] - times[:-k])[:, None]
        size = float(np.max(np.abs(difference), initial=0.0)) / known
        if 0 < step <= self.order and known == step + 1:  # the previous step had fewer old values
            self._take(step - 1, times[-2], np.array([self.begun, *times[:-2]]), size)
        if known == self.order + 1:
            self._take(step, times[-1], times[:-1], size)

    def begin_again(self, t: float) -> None:
        """Discard values up to a time [D_c/U_av], at which steps begin again."""
        self.begun, self.count, self.times, self.values = t, 0, [], []

    def _take(self, step: int, t: float, old: Array, size: float) -> None:
        if t - self.begun > SET_IN * (1 + 1e-9):
            factor = SAFETY * (FEW_FACTOR if step < FEW else 1.0)
            self.largest = max(self.largest, factor * size * float(np.prod(t - old)))

    @property
    def peak(self) -> float:
        """Largest absolute value of the goal so far, at least LEAST."""
        return max(self.largest_dU, LEAST)

    @property
    def part(self) -> float:
        """Largest indicator relative to `peak`."""
        return self.largest / self.peak
