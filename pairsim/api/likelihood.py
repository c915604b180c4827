"""How probable films are at values of what is unknown: the profile of their likelihood, and intervals by it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from pairsim.api.film_model import Changes
from pairsim.runtime.arrays import Array, Flags, Indices

ROUNDS = 30  # Gauss-Newton steps, at most
REFRESHED = 3  # times that the parts are computed anew on the way to a minimum, at most
STEP = 1e-3  # of a logarithm, for derivatives; chosen
CLOSE = 5e-4  # of ends of intervals, and of the other number at them, in logarithms; chosen
SETTLED = 1e-6  # change of the sum of squares at which these steps end, relative


class Fitted(NamedTuple):
    """The best motion at values of what is unknown.

    Attributes:
        cost: Sum of squares of residuals over their noise and of the parts over their standard deviations.
        logs: Logarithms of the unknown numbers, shape (numbers,).
        starts: First distances [D_c], shape (films,).
        changes: At these.
        parts: By how many standard deviations each thing that is not known is off, shape (things,).
    """

    cost: float
    logs: Array
    starts: Array
    changes: Changes
    parts: Array

    @property
    def residuals(self) -> Array:
        """Residuals of the motion with its parts [D_c], shape (frames,)."""
        return np.asarray(self.changes.residuals + self.changes.parts @ self.parts)


@dataclass(frozen=True)
class Likelihood:
    """Of films with independent noise, and of things with normal distributions that act linearly.

    Attributes:
        changes: Residuals and their changes at logarithms of the unknown numbers and at first distances.
        residuals: Residuals and their changes by these alone.
        bounds: Least and largest logarithm of each unknown number, shape (numbers, 2).
        noise: Standard deviation of distances [D_c].
        ends: Least and largest first distance [D_c].
        used: Whether a frame counts, shape (frames,).
    """

    changes: Callable[[Array, Array], Changes]
    residuals: Callable[[Array, Array], tuple[Array, Array]]
    bounds: Array
    noise: float
    ends: tuple[float, float]
    used: Flags

    def best(self, logs: Array, starts: Array, free: Sequence[int] = ()) -> Fitted:
        """The best motion from first distances on, and from logarithms on that are free; others are held.

        Gauss-Newton steps, in each round with the parts as they are where it begins.
        """
        bounds = np.array([*self.bounds[list(free)], *[self.ends] * len(starts)])
        found, count = self._at(logs, np.clip(starts, *self.ends)), len(free)
        for _ in range(REFRESHED if count else 1):
            parts = found.changes.parts[self.used]
            x, cost, step = np.array([*found.logs[list(free)], *found.starts]), np.inf, np.zeros(len(bounds))
            for _ in range(ROUNDS):
                tried = np.clip(x + step, *bounds.T)
                at = found.logs.copy()
                at[list(free)] = tried[:count]
                residuals, by_start = self.residuals(at, tried[count:])
                white = self.weighted(parts, residuals[self.used, None])[:, 0]
                now = float(residuals[self.used] @ white)
                if now > cost:
                    step = step / 2
                    continue
                settled, x, cost = cost - now <= SETTLED * now, tried, now
                if settled:
                    break
                by_logs = [self.by_log(k, at, tried[count:], residuals) for k in free]
                columns = np.column_stack([*by_logs, by_start])[self.used]
                step = -np.linalg.lstsq(columns.T @ self.weighted(parts, columns), columns.T @ white)[0]
            at = found.logs.copy()
            at[list(free)] = x[:count]
            again = self._at(at, x[count:])
            if count and again.cost > found.cost:
                break
            found = again
        return found

    def by_log(self, k: int, logs: Array, starts: Array, residuals: Array) -> Array:
        """Derivative of residuals by a logarithm, shape (frames,)."""
        step = -STEP if logs[k] + STEP > self.bounds[k, 1] else STEP
        ahead = logs.copy()
        ahead[k] += step
        return np.asarray((self.residuals(ahead, starts)[0] - residuals) / step)

    def weighted(self, parts: Array, columns: Array) -> Array:
        """The inverse of the covariance of the frames times columns, shape (frames, columns)."""
        inner = self.noise**2 * np.eye(parts.shape[1]) + parts.T @ parts
        return np.asarray((columns - parts @ np.linalg.solve(inner, parts.T @ columns)) / self.noise**2)

    def counted(self, changes: Changes) -> Changes:
        """Those of the frames that count."""
        return Changes(changes.residuals[self.used], changes.by_start[self.used], changes.parts[self.used])

    def _at(self, logs: Array, starts: Array) -> Fitted:
        changes = self.changes(logs, starts)
        seen = self.counted(changes)
        white = self.weighted(seen.parts, seen.residuals[:, None])[:, 0]
        return Fitted(float(seen.residuals @ white), logs, starts, changes, -seen.parts.T @ white)


def minima_of(costs: Array) -> Indices:
    """Places of the minima of costs, ends included, shape (minima,)."""
    padded = np.pad(costs, 1, constant_values=np.inf)
    return np.flatnonzero((costs < padded[:-2]) & (costs <= padded[2:]))


def shares(likelihood: Likelihood, changes: Changes, by_values: Array, names: Sequence[str]) -> list[dict[str, float]]:
    """By how much each thing that is not known widens the standard deviation of each unknown value, and "noise".

    This is the root of the difference of variances, with the thing and without it; that of the noise is what remains
    without all things.

    Args:
        likelihood: Has the noise.
        changes: At the best motion.
        by_values: Derivatives of the residuals by the values, shape (frames, values).
        names: Of the columns of `changes.parts`.
    """
    seen = likelihood.counted(changes)
    columns, count = np.concatenate([by_values[likelihood.used], seen.by_start], axis=1), by_values.shape[1]

    def variances(kept: Flags) -> Array:
        parts = seen.parts[:, kept]
        return np.asarray(np.diag(np.linalg.pinv(columns.T @ likelihood.weighted(parts, columns)))[:count])

    of_each = np.array(names)
    whole = variances(np.ones(len(names), dtype=bool))
    found = {name: whole - variances(of_each != name) for name in dict.fromkeys(names)}
    found["noise"] = variances(np.zeros(len(names), dtype=bool))
    return [{name: float(np.sqrt(max(each[k], 0.0))) for name, each in found.items()} for k in range(count)]


def crossing(function: Callable[[float], float], inside: float, outside: float, limit: float) -> float:
    """Where a function exceeds a limit between two values, the second of them if it does nowhere."""
    if function(outside) <= limit:
        return outside
    return float(scipy.optimize.brentq(lambda value: function(value) - limit, inside, outside, xtol=CLOSE))
