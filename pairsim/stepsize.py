"""Step sizes: variable-step BDF2 and its error control."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pairsim.quadratic import Array

GROWTH = 1.6  # most that a step may grow by


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
    def bdf(dt: float, previous: float | None) -> Scheme:
        """BDF2 after a step of size `previous`, BDF1 for the first step (None)."""
        if previous is None:
            return Scheme(dt, (1.0,))
        w = dt / previous
        return Scheme(dt * (1 + w) / (1 + 2 * w), ((1 + w) ** 2 / (1 + 2 * w), -(w**2) / (1 + 2 * w)))


def extrapolation_weights(times: Sequence[float], t: float) -> Array:
    """Lagrange weights that carry values at `times` to t."""
    nodes = np.asarray(times)
    weights = np.ones(len(nodes))
    for i in range(len(nodes)):
        for j in range(len(nodes)):
            if i != j:
                weights[i] *= (t - nodes[j]) / (nodes[i] - nodes[j])
    return weights


def error_factor(times: Sequence[float], t: float) -> float:
    """Local error of a BDF step as a fraction of (corrected - predicted) value.

    The predictor is a parabola through three old values: its error is C_p y_ttt with C_p = prod(t - t_i)/6, that of
    BDF2 is -C_c y_ttt with C_c = dt^2 (dt + dt_1)^2/(6 (2 dt + dt_1)), and the difference of the two is
    (C_p + C_c) y_ttt.

    Args:
        times: The three old times, newest first.
        t: The new time.
    """
    dt = t - times[0]
    dt_1 = times[0] - times[1]
    predictor = dt * (dt + dt_1) * (t - times[2]) / 6
    corrector = dt**2 * (dt + dt_1) ** 2 / (6 * (2 * dt + dt_1))
    return corrector / (predictor + corrector)


def _rounded(dt: float) -> float:
    """dt to three digits, so that noise in the error does not make two runs of one case take different steps."""
    return float(f"{dt:.2e}")


@dataclass(frozen=True)
class StepControl:
    """Chooses steps so that the local error of the particles' velocities stays at `tolerance`.

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
