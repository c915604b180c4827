"""Variable-step BDF3 and its step size control; see "Time integration" in docs/explanation/numerics.md."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pairsim.runtime.arrays import Array

# Largest ratio of successive steps; variable-step BDF3 is zero-stable below 1.534 (Calvo, Grande and Grigorieff 1990).
GROWTH = 1.5


@dataclass(frozen=True)
class Scheme:
    """One implicit step h = h* + g h', where h* is a linear combination of old values and h' the new rate of h.

    Attributes:
        g: gamma dt.
        weights: Coefficients of the old values in h*, newest first.
    """

    g: float
    weights: tuple[float, ...]

    @staticmethod
    def bdf(times: Sequence[float], t: float) -> Scheme:
        """BDF step from old times to t, whose order is the number of old times.

        The derivative h' at t is that of the polynomial through all values, h' = d_0 h + sum(d_i h_i) with its Lagrange
        weights d_i, so that h = (h' - sum(d_i h_i))/d_0 (Hairer, Norsett and Wanner 1993, section III.5).

        Args:
            times: Old times, newest first; one to three.
            t: New time.
        """
        nodes = np.array([t, *times])
        others = [np.delete(nodes, i) for i in range(len(nodes))]
        d = np.array([np.prod(t - rest[1:]) / np.prod(x - rest) for x, rest in zip(nodes, others, strict=True)])
        d[0] = np.sum(1 / (t - nodes[1:]))
        return Scheme(float(1 / d[0]), tuple(float(w) for w in -d[1:] / d[0]))


def extrapolation_weights(times: Sequence[float], t: float) -> Array:
    """Weights of the Lagrange extrapolation to t of values at k `times`, shape (k,)."""
    nodes = np.asarray(times)
    weights = np.ones(len(nodes))
    for i in range(len(nodes)):
        for j in range(len(nodes)):
            if i != j:
                weights[i] *= (t - nodes[j]) / (nodes[i] - nodes[j])
    return weights


def velocity_error(times: Sequence[float], t: float) -> float:
    """Factor that turns the difference between corrected and predicted positions into an error of the velocity.

    The error of the predictor, the parabola through three old values, is prod(t - t_i) y_ttt/6. The local error of the
    velocity with BDF2, one order below the scheme, is (t - t_0)(t - t_1) y_ttt/6.

    Args:
        times: The three old times, newest first.
        t: The new time.

    Returns:
        Ratio of both errors, 1/(t - t_2).
    """
    return 1.0 / (t - times[2])


def _rounded(dt: float) -> float:
    """Round dt to three digits, so that rounding errors do not change the step sizes of a repeated run."""
    return float(f"{dt:.2e}")


@dataclass(frozen=True)
class StepControl:
    """Step size control by the local error of the velocities, estimated for BDF2.

    The constants 1.5, 0.85, 0.3 and 1.15 in the methods were chosen.

    Attributes:
        tolerance: Largest local error of the velocities [U_av].
        smallest: Smallest step [D_c/U_av].
        largest: Largest step [D_c/U_av].
        fixed: Constant step size in place of the control [D_c/U_av]; None to control the step size.
    """

    tolerance: float
    smallest: float
    largest: float
    fixed: float | None = None

    def accepts(self, error: float) -> bool:
        """Whether a step is accepted; with a fixed step size it always is.

        Args:
            error: Local error in units of the tolerance.
        """
        return self.fixed is not None or error <= 1.5

    def next(self, dt: float, size: float, error: float) -> float:
        """Step size after a step.

        Args:
            dt: Step size before it was shortened to reach a milestone.
            size: Step size that was taken.
            error: Local error of the step in units of the tolerance; 0 if unknown.
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
        if 1.0 <= factor < 1.15:  # a constant step lets the factorised matrix be reused for longer
            return min(size, self.largest)
        return min(size * min(max(factor, 0.3), GROWTH), self.largest)


def land(t: float, dt: float, milestone: float) -> float:
    """Step size of at most dt such that the milestone is reached without a very small last step."""
    left = milestone - t
    if left <= dt * (1 + 1e-9):
        return left
    return left / 2 if left < 2 * dt else dt


def reached(t: float, milestone: float) -> bool:
    """Whether t equals the milestone up to rounding, or exceeds it."""
    return t >= milestone - 1e-12 * max(1.0, milestone)
