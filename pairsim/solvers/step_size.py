"""Step sizes: variable-step BDF3 and its error control."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pairsim.runtime.arrays import Array

GROWTH = 1.5  # most that a step may grow by: variable-step BDF3 is stable below 1.53


@dataclass(frozen=True)
class Scheme:
    """One implicit step h = h* + g h', in which h* is a combination of old values.

    Attributes:
        g: gamma dt.
        weights: Factors of the old values in h*, newest first.
    """

    g: float
    weights: tuple[float, ...]

    @staticmethod
    def bdf(times: Sequence[float], t: float) -> Scheme:
        """BDF from the old times, newest first, to t: of order three with three of them, BDF1 for the first step.

        The derivative at t of the polynomial through all values is set: its Lagrange weights d_i give
        h = (h' - sum(d_i h_i))/d_0.
        """
        nodes = np.array([t, *times])
        others = [np.delete(nodes, i) for i in range(len(nodes))]
        d = np.array([np.prod(t - rest[1:]) / np.prod(x - rest) for x, rest in zip(nodes, others, strict=True)])
        d[0] = np.sum(1 / (t - nodes[1:]))
        return Scheme(float(1 / d[0]), tuple(float(w) for w in -d[1:] / d[0]))


def extrapolation_weights(times: Sequence[float], t: float) -> Array:
    """Lagrange weights that carry values at `times` to t."""
    nodes = np.asarray(times)
    weights = np.ones(len(nodes))
    for i in range(len(nodes)):
        for j in range(len(nodes)):
            if i != j:
                weights[i] *= (t - nodes[j]) / (nodes[i] - nodes[j])
    return weights


def velocity_error(times: Sequence[float], t: float) -> float:
    """Local error of the velocity in a step of one order less, over (corrected - predicted) value.

    The predictor is a parabola through three old values: its error is prod(t - t_i) y_ttt/6. What BDF2 would leave
    in the velocity is (t - t_0)(t - t_1) y_ttt/6.

    Args:
        times: The three old times, newest first.
        t: The new time.
    """
    return 1.0 / (t - times[2])


def _rounded(dt: float) -> float:
    """dt to three digits, so that noise in the error does not make two runs of one case take different steps."""
    return float(f"{dt:.2e}")


@dataclass(frozen=True)
class StepControl:
    """Chooses steps so that the local error of the velocities that BDF2 would have stays at `tolerance`.

    Attributes:
        tolerance: Allowed local error by step size, in units of U_av.
        smallest, largest: Limits of the step.
        fixed: A step size to keep to instead.
    """

    tolerance: float
    smallest: float
    largest: float
    fixed: float | None = None

    def accepts(self, error: float) -> bool:
        """Whether a step with this error (in units of the tolerance) stands."""
        return self.fixed is not None or error <= 1.5

    def next(self, dt: float, size: float, error: float) -> float:
        """Step size after a step.

        Args:
            dt: The step size that was wanted.
            size: The one that was taken, smaller where it had to land on a time.
            error: Its error in units of the tolerance; 0 where it is unknown.
        """
        if self.fixed is not None:
            return self.fixed
        if error == 0.0:
            return dt
        return min(_rounded(self._wanted(dt, size, error)), self.largest)

    def _wanted(self, dt: float, size: float, error: float) -> float:
        factor = 0.85 / max(error, 1e-4) ** 0.5
        if size < dt * (1 - 1e-9) and error <= 1.0:
            return min(max(size * factor, dt), GROWTH * dt, self.largest)
        if 1.0 <= factor < 1.15:  # the Jacobian in hand serves longer at an unchanged step
            return min(size, self.largest)
        return min(size * min(max(factor, 0.3), GROWTH), self.largest)


def land(t: float, dt: float, milestone: float) -> float:
    """A step not above dt that reaches the milestone without a last tiny step."""
    left = milestone - t
    if left <= dt * (1 + 1e-9):
        return left
    return left / 2 if left < 2 * dt else dt


def reached(t: float, milestone: float) -> bool:
    """Whether t is the milestone, but for rounding, or past it."""
    return t >= milestone - 1e-12 * max(1.0, milestone)
