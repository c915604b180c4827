"""The values of what is unknown in films at which they are most probable, and the ranges in which they may be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import product

import numpy as np
import scipy

from pairsim.api.film_model import NORMAL, FilmModel
from pairsim.api.likelihood import Fitted, Likelihood, crossing, minima_of, shares
from pairsim.cases.physical import DIFFERENCE
from pairsim.runtime.arrays import Array

LEAST = 1e-3  # an unknown number over the largest one of the atlas: less is as good as 0
PLACES = {1: 60, 2: 16}  # values of each of one or two unknown numbers that are looked at, for all minima; chosen
EXACT = 1e-4  # least noise of distances that is assumed [D_c]; chosen
STEP = 1e-3  # of a logarithm, for derivatives; chosen
FAR = 5.0  # standard deviations from which on a frame is an outlier: one of two million by chance
OUTLIERS = 0.1  # part of the frames that may be outliers; chosen
ROUNDS = 4  # of noise and outliers, at most
SAME = 0.02  # relative change of the noise at which these end; chosen
SCATTER = 1.4826  # standard deviation of normal values over the median of their sizes


@dataclass(frozen=True)
class Search:
    """Films of a model, in logarithms of the unknown numbers.

    Attributes:
        model: What the films show.
        numbers: Names of the unknown numbers, De or Ca_e.
        likelihood: Of the films, with the noise that follows from their scatter, and without outliers.
    """

    model: FilmModel
    numbers: Sequence[str]
    likelihood: Likelihood

    @classmethod
    def of(cls, model: FilmModel, numbers: Sequence[str], noise: float = 0.0) -> Search:
        """That with noise and outliers as of the best motion; a first guess of the noise [D_c] saves time."""

        def at(logs: Sequence[float] | Array) -> dict[str, float]:
            return dict(zip(numbers, np.exp(logs).tolist(), strict=True))

        noise = noise or max(EXACT, *(_scatter(seen.times, seen.distances) for seen in model.films))
        frames = sum(len(seen.times) for seen in model.films)
        likelihood = Likelihood(
            changes=lambda logs, starts: model.changes(at(logs), starts.tolist()),
            residuals=lambda logs, starts: model.residuals(at(logs), starts.tolist()),
            noise=noise,
            ends=(float(model.atlas.d[0]), float(model.atlas.d[-1])),
            used=np.ones(frames, dtype=bool),
        )
        search = cls(model, numbers, likelihood)
        for _ in range(ROUNDS):
            sizes = np.abs(search.found.residuals)
            spread = max(SCATTER * float(np.median(sizes[search.likelihood.used])), EXACT)
            used = sizes <= FAR * spread
            used = used if (~used).mean() <= OUTLIERS else np.ones(frames, dtype=bool)
            noise = max(EXACT, float(np.linalg.norm(sizes[used])) / np.sqrt(search.freedom))
            if abs(noise / search.likelihood.noise - 1) < SAME and (used == search.likelihood.used).all():
                break
            search = replace(search, likelihood=replace(search.likelihood, noise=noise, used=used))
        return search

    @cached_property
    def ends(self) -> Array:
        """Least and largest logarithm of each unknown number, shape (numbers, 2)."""
        largest = np.array([self.model.atlas.box[name][1] for name in self.numbers])
        return np.log([LEAST * largest, largest]).T

    @cached_property
    def _axes(self) -> list[Array]:
        return [np.linspace(low, high, PLACES[len(self.numbers)]) for low, high in self.ends]

    @cached_property
    def _grid(self) -> Mapping[tuple[int, ...], Fitted]:
        """The best motions at all places of the grid, each from the one that is next to it."""
        starts = np.array([np.median(seen.distances[:3]) for seen in self.model.films])
        found: dict[tuple[int, ...], Fitted] = {}
        for place in product(*(range(len(axis)) for axis in self._axes)):
            before = (*place[:-1], place[-1] - 1)
            near = found[before].starts if before in found else starts
            found[place] = self.likelihood.best([axis[i] for axis, i in zip(self._axes, place, strict=True)], near)
        return found

    def at(self, logs: Sequence[float] | Array) -> Fitted:
        """The best motion at values."""
        places = zip(self._axes, logs, strict=True)
        nearest = tuple(int(np.abs(axis - log).argmin()) for axis, log in places)
        return self.likelihood.best(logs, self._grid[nearest].starts)

    @cached_property
    def minima(self) -> list[tuple[Array, Fitted]]:
        """All minima of the sum of squares, the least first, with their values."""
        costs = np.array([each.cost for each in self._grid.values()]).reshape([len(axis) for axis in self._axes])
        lower = np.ones(costs.shape, dtype=bool)
        for axis in range(costs.ndim):
            padded = np.pad(costs, [(1, 1) if axis == k else (0, 0) for k in range(costs.ndim)], constant_values=np.inf)
            left = np.take(padded, range(costs.shape[axis]), axis)
            right = np.take(padded, range(2, costs.shape[axis] + 2), axis)
            lower &= (costs < left) & (costs <= right)
        found = []
        for place in zip(*np.nonzero(lower), strict=True):
            near = [
                (axis[max(i - 1, 0)], axis[min(i + 1, len(axis) - 1)])
                for axis, i in zip(self._axes, place, strict=True)
            ]
            x = self._lowest(near)
            found.append((x, self.at(x)))
        return sorted(found, key=lambda each: each[1].cost)

    def _lowest(self, near: Sequence[tuple[float, float]]) -> Array:
        """The values with the least sum of squares within bounds, around their middle."""
        if len(near) == 1:
            found = scipy.optimize.minimize_scalar(lambda x: self.at([x]).cost, bounds=near[0], options={"xatol": 1e-5})
            ends = [(self.at([end]).cost, end) for end in near[0]]
            return np.array([min((float(found.fun), float(found.x)), *ends)[1]])
        middle = np.mean(near, axis=1)
        found = scipy.optimize.minimize(
            lambda x: self.at(x).cost, middle, method="Powell", bounds=near, options={"xtol": 1e-4, "ftol": 1e-6}
        )
        return np.asarray(found.x)

    @property
    def found(self) -> Fitted:
        """The best motion."""
        return self.minima[0][1]

    @property
    def values(self) -> Array:
        """The logarithms of the unknown numbers there, shape (numbers,)."""
        return self.minima[0][0]

    @property
    def freedom(self) -> float:
        """Frames that count, less what is fitted to them: parts count as far as the films determine them."""
        seen = self.likelihood.counted(self.found.changes)
        parts = float(np.sum(seen.parts * self.likelihood.weighted(seen.parts, seen.parts)))
        return max(len(seen.residuals) - len(self.numbers) - seen.by_start.shape[1] - parts, 1.0)

    def profile(self, k: int, log: float) -> float:
        """The least sum of squares with unknown number k given."""
        if len(self.numbers) == 1:
            return self.at([log]).cost
        other = self._axes[1 - k]
        row = int(np.abs(self._axes[k] - log).argmin())
        costs = [self._grid[(row, j) if k == 0 else (j, row)].cost for j in range(len(other))]
        found = np.inf
        for j in minima_of(np.array(costs)):
            bounds = other[max(j - 1, 0)], other[min(j + 1, len(other) - 1)]
            best = scipy.optimize.minimize_scalar(
                lambda x: self.at([log, x] if k == 0 else [x, log]).cost, bounds=bounds, options={"xatol": 1e-3}
            )
            found = min(found, float(best.fun))
        return found

    @cached_property
    def reach(self) -> list[tuple[float, float]]:
        """Logarithms at the ends of the interval of 95 % of each unknown number."""
        least, found = self.found.cost, []
        one, two = (n * scipy.stats.f.ppf(0.95, n, self.freedom) for n in (1, 2))
        several = sum(each.cost <= least + two for _, each in self.minima) > 1
        limit = least + (two if several else one)
        for k, axis in enumerate(self._axes):
            logs = np.unique([*axis, *(x[k] for x, _ in self.minima)])
            costs = np.array([self.profile(k, log) for log in logs])
            costs[np.searchsorted(logs, self.values[k])] = least
            first, last = np.flatnonzero(costs <= limit)[[0, -1]]
            low, high = (float(logs[each]) for each in (first, last))
            function = partial(self.profile, k)
            if first > 0:
                low = crossing(function, low, float(logs[first - 1]), limit)
            if last + 1 < len(logs):
                high = crossing(function, high, float(logs[last + 1]), limit)
            found.append((low, high))
        return found

    @cached_property
    def _by_logs(self) -> Array:
        """Derivatives of the residuals by the logarithms of the unknown numbers, shape (frames, numbers)."""
        columns = []
        for unit in np.eye(len(self.numbers)):
            ahead, behind = (np.clip(self.values + step * unit, *self.ends.T) for step in (STEP, -STEP))
            change = np.subtract(*(self.likelihood.residuals(each, self.found.starts)[0] for each in (ahead, behind)))
            columns.append(change / max(float((ahead - behind) @ unit), STEP))
        return np.array(columns).T

    @cached_property
    def parts(self) -> list[dict[str, float]]:
        """Half-widths that each thing has in the interval of each unknown number, over its value, to first order."""
        found = shares(self.likelihood, self.found.changes, self._by_logs, self.model.names)
        return [{name: NORMAL * size for name, size in each.items() if size > 0} for each in found]

    @property
    def difference(self) -> tuple[float, float]:
        """The difference of the diameters and its half-width, as the films have it; 0 where it is not fitted."""
        names = self.model.names
        mean, half_width = self.model.difference
        if DIFFERENCE.key not in names:
            return mean, half_width
        k = names.index(DIFFERENCE.key)
        seen = self.likelihood.counted(self.found.changes)
        columns = np.concatenate([seen.parts, seen.by_start, self._by_logs[self.likelihood.used]], axis=1)
        prior = np.diag([float(i < seen.parts.shape[1]) for i in range(columns.shape[1])])
        spread = np.linalg.pinv(columns.T @ columns / self.likelihood.noise**2 + prior)[k, k]
        size = half_width / NORMAL
        return mean + size * float(self.found.parts[k]), size * NORMAL * float(np.sqrt(spread))

    @property
    def alike(self) -> float:
        """Correlation of the residuals of neighbouring frames, which is small where they are exact."""
        off = self.found.residuals[self.likelihood.used]
        return float(off[1:] @ off[:-1]) / max(float(off @ off), len(off) * self.likelihood.noise**2)


def _scatter(times: Array, distances: Array) -> float:
    """Standard deviation of the noise of a film, from how far frames are off the line between their neighbours."""
    if len(times) < 3:
        return EXACT
    part = (times[1:-1] - times[:-2]) / (times[2:] - times[:-2])
    off = distances[1:-1] - (1 - part) * distances[:-2] - part * distances[2:]
    return SCATTER * float(np.median(np.abs(off) / np.sqrt(1 + (1 - part) ** 2 + part**2)))
