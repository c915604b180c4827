"""The likelihood of films over unknown numbers, its profile, and the contributions of nuisance parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from pairsim.lab.films.film_model import Changes
from pairsim.runtime.arrays import Array, Flags, Indices

ROUNDS = 30  # Gauss-Newton steps, at most
REFRESHED = 3  # times that the effects of nuisance parameters are computed on the way to a minimum, at most
STEP = 1e-3  # of a logarithm, for derivatives; chosen
CLOSE = 5e-4  # tolerance of the ends of intervals, in logarithms; chosen
SETTLED = 1e-6  # relative change of the sum of squares below which Gauss-Newton steps end


class Fitted(NamedTuple):
    """The most probable motion at values of the unknown numbers.

    Attributes:
        cost: Sum of squares of the residuals over their noise, and of the deviations of all nuisance parameters over
            their standard deviations.
        logs: Logarithms of the unknown numbers, shape (numbers,).
        state: The state, see `FilmModel.states`, shape (states,).
        changes: Residuals and derivatives at these.
        parts: Deviation of each nuisance parameter over its standard deviation, shape (parameters,).
    """

    cost: float
    logs: Array
    state: Array
    changes: Changes
    parts: Array

    @property
    def residuals(self) -> Array:
        """Residuals with the nuisance parameters at their most probable values [D_c], shape (frames,)."""
        return np.asarray(self.changes.residuals + self.changes.parts @ self.parts)


@dataclass(frozen=True)
class Likelihood:
    """The likelihood of films with independent noise and with normal nuisance parameters that act linearly.

    Attributes:
        changes: Residuals and their derivatives, as a function of the logarithms of the unknown numbers and the state.
        residuals: Residuals and their derivatives by the state alone, as the same function.
        bounds: Least and largest logarithm of each unknown number, shape (numbers, 2).
        noise: Standard deviation of distances [D_c].
        states: Least and largest values of the state, shape (states, 2).
        normal: Whether a value of the state has a normal prior of variance 1, shape (states,); others have a flat one.
        used: Whether a frame counts, shape (frames,).
    """

    changes: Callable[[Array, Array], Changes]
    residuals: Callable[[Array, Array], tuple[Array, Array]]
    bounds: Array
    noise: float
    states: Array
    normal: Flags
    used: Flags

    def best(self, logs: Array, state: Array, free: Sequence[int] = ()) -> Fitted:
        """The most probable motion, by Gauss-Newton steps.

        In each round of steps the effects of nuisance parameters are those at its start.

        Args:
            logs: Logarithms of the unknown numbers, as a first guess.
            state: The state, as a first guess.
            free: Indices of the logarithms that are fitted; the others keep their values.
        """
        count = len(free)
        bounds, prior = np.concatenate([self.bounds[list(free)], self.states]), np.append(np.zeros(count), self.normal)
        found = self._at(logs, np.clip(state, *self.states.T))
        for _ in range(REFRESHED if count else 1):
            parts = found.changes.parts[self.used]
            x, cost, step = np.array([*found.logs[list(free)], *found.state]), np.inf, np.zeros(len(bounds))
            for _ in range(ROUNDS):
                tried = np.clip(x + step, *bounds.T)
                at = found.logs.copy()
                at[list(free)] = tried[:count]
                residuals, by_state = self.residuals(at, tried[count:])
                white = self.weighted(parts, residuals[self.used, None])[:, 0]
                now = float(residuals[self.used] @ white + prior @ tried**2)
                if now > cost:
                    step = step / 2
                    continue
                settled, x, cost = cost - now <= SETTLED * now, tried, now
                if settled:
                    break
                by_logs = [self.by_log(k, at, tried[count:], residuals) for k in free]
                columns = np.column_stack([*by_logs, by_state])[self.used]
                curvature = columns.T @ self.weighted(parts, columns) + np.diag(prior)
                step = -np.linalg.lstsq(curvature, columns.T @ white + prior * x)[0]
            at = found.logs.copy()
            at[list(free)] = x[:count]
            again = self._at(at, x[count:])
            if count and again.cost > found.cost:
                break
            found = again
        return found

    def by_log(self, k: int, logs: Array, state: Array, residuals: Array) -> Array:
        """Derivative of residuals by a logarithm, shape (frames,)."""
        step = -STEP if logs[k] + STEP > self.bounds[k, 1] else STEP
        ahead = logs.copy()
        ahead[k] += step
        return np.asarray((self.residuals(ahead, state)[0] - residuals) / step)

    def weighted(self, parts: Array, columns: Array) -> Array:
        """The inverse of the covariance of the frames times columns, shape (frames, columns).

        The covariance is that by the noise and by nuisance parameters with the effects `parts`, (frames, parameters).
        """
        inner = self.noise**2 * np.eye(parts.shape[1]) + parts.T @ parts
        return np.asarray((columns - parts @ np.linalg.solve(inner, parts.T @ columns)) / self.noise**2)

    def counted(self, changes: Changes) -> Changes:
        """The changes at the frames that count."""
        return Changes(changes.residuals[self.used], changes.by_state[self.used], changes.parts[self.used])

    def _at(self, logs: Array, state: Array) -> Fitted:
        changes = self.changes(logs, state)
        seen = self.counted(changes)
        white = self.weighted(seen.parts, seen.residuals[:, None])[:, 0]
        cost = float(seen.residuals @ white + self.normal @ state**2)
        return Fitted(cost, logs, state, changes, -seen.parts.T @ white)


def minima_of(costs: Array) -> Indices:
    """Indices of the local minima of costs, ends included, shape (minima,)."""
    padded = np.pad(costs, 1, constant_values=np.inf)
    return np.flatnonzero((costs < padded[:-2]) & (costs <= padded[2:]))


def shares(
    likelihood: Likelihood, changes: Changes, by_values: Array, names: Sequence[str], of_state: str
) -> list[dict[str, float]]:
    """Contribution of each nuisance parameter, and of the noise, to the standard deviation of each unknown value.

    It is the root of the difference of the variances with the nuisance parameter and without it; that of the noise is
    the standard deviation that remains without any of them.

    Args:
        likelihood: Has the noise.
        changes: Residuals and derivatives at the best motion.
        by_values: Derivatives of the residuals by the values, shape (frames, values).
        names: Names of the columns of `changes.parts`; those of one name count together.
        of_state: Name of the values of the state that have a normal prior.

    Returns:
        For each value, the contributions by name; that of the noise is "noise".
    """
    seen, normal = likelihood.counted(changes), likelihood.normal
    columns, count = np.concatenate([by_values[likelihood.used], seen.by_state[:, ~normal]], axis=1), by_values.shape[1]
    every = np.concatenate([seen.parts, seen.by_state[:, normal]], axis=1)
    of_each = np.array([*names, *[of_state] * int(np.count_nonzero(normal))])

    def variances(kept: Flags) -> Array:
        parts = every[:, kept]
        return np.asarray(np.diag(np.linalg.pinv(columns.T @ likelihood.weighted(parts, columns)))[:count])

    whole = variances(np.ones(len(of_each), dtype=bool))
    found = {name: whole - variances(of_each != name) for name in dict.fromkeys(of_each.tolist())}
    found["noise"] = variances(np.zeros(len(of_each), dtype=bool))
    return [{name: float(np.sqrt(max(each[k], 0.0))) for name, each in found.items()} for k in range(count)]


def crossing(function: Callable[[float], float], inside: float, outside: float, limit: float) -> float:
    """Where a function reaches a limit between two values; the second of these if it is still below the limit there."""
    if function(outside) <= limit:
        return outside
    return float(scipy.optimize.brentq(lambda value: function(value) - limit, inside, outside, xtol=CLOSE))
