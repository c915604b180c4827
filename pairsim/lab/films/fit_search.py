"""The values of unknown numbers at which films are most probable, and the intervals of these numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import product
from pathlib import Path

import numpy as np
import scipy

from pairsim.cases.physical import DIFFERENCE
from pairsim.lab.films.film_model import NORMAL, FilmModel
from pairsim.lab.films.likelihood import Fitted, Likelihood, crossing, minima_of, shares
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

LEAST = 1e-3  # least value of an unknown number over the largest one in the atlas: it counts as 0
PLACES = {1: 60, 2: 16}  # grid points for each of one or two unknown numbers, to find all minima; chosen
EXACT = 1e-4  # least noise of distances that is assumed [D_c]; chosen
FAR = 5.0  # standard deviations beyond which a frame is an outlier: one of two million by chance
OUTLIERS = 0.1  # largest fraction of frames that may be outliers; chosen
ROUNDS = 4  # in which noise and outliers are determined, at most
SAME = 0.02  # relative change of the noise below which these rounds end; chosen
SCATTER = 1.4826  # standard deviation of normal values over the median of their magnitudes


@dataclass(frozen=True)
class Search:
    """The search for the unknown numbers of films, in their logarithms.

    Attributes:
        model: The model of the films.
        numbers: Names of the unknown numbers, De or Ca_e.
        likelihood: That of the films, with the noise that follows from their scatter, and without outliers.
    """

    model: FilmModel
    numbers: Sequence[str]
    likelihood: Likelihood

    @classmethod
    def of(cls, model: FilmModel, numbers: Sequence[str], noise: float = 0.0) -> Search:
        """Set up the search; noise and outliers are determined by the residuals of the best motion, in rounds.

        Args:
            model: The model of the films.
            numbers: Names of the unknown numbers.
            noise: First guess of the noise [D_c], which saves time; 0 for none.
        """

        def at(logs: Array) -> dict[str, float]:
            return dict(zip(numbers, np.exp(logs).tolist(), strict=True))

        largest = np.array([model.atlas.box[name][1] for name in numbers])
        likelihood = Likelihood(
            changes=lambda logs, state: model.changes(at(logs), state),
            residuals=lambda logs, state: model.residuals(at(logs), state),
            bounds=np.log([LEAST * largest, largest]).T,
            noise=noise or max(EXACT, *(_scatter(seen.times, seen.distances) for seen in model.films)),
            states=model.states,
            normal=np.arange(len(model.states)) >= len(model.films),
            used=np.ones(sum(len(seen.times) for seen in model.films), dtype=bool),
        )
        search = cls(model, numbers, likelihood)
        for _ in range(ROUNDS):
            sizes = np.abs(search.found.residuals)
            spread = max(SCATTER * float(np.median(sizes[search.likelihood.used])), EXACT)
            used = sizes <= FAR * spread
            used = used if (~used).mean() <= OUTLIERS else np.ones_like(used)
            noise = max(EXACT, float(np.linalg.norm(sizes[used])) / np.sqrt(search.freedom))
            if abs(noise / search.likelihood.noise - 1) < SAME and (used == search.likelihood.used).all():
                break
            search = replace(search, likelihood=replace(search.likelihood, noise=noise, used=used))
        return search

    @cached_property
    def _axes(self) -> list[Array]:
        return [np.linspace(low, high, PLACES[len(self.numbers)]) for low, high in self.likelihood.bounds]

    @cached_property
    def _grid(self) -> list[Fitted]:
        """The best motions at all points of the grid, each from the one before; the last number changes fastest."""
        first, found = [np.median(seen.distances[:3]) for seen in self.model.films], list[Fitted]()
        state = np.array([*first, *[0.0] * self.model.differs])
        for logs in product(*self._axes):
            near = found[-1].state if found and logs[-1] > self._axes[-1][0] else state
            found.append(self.likelihood.best(np.array(logs), near))
        return found

    @cached_property
    def minima(self) -> list[Fitted]:
        """All minima of the sum of squares, the least first."""
        costs = np.array([each.cost for each in self._grid]).reshape([len(axis) for axis in self._axes])
        lower = (costs == scipy.ndimage.minimum_filter(costs, 3, mode="nearest")).ravel()
        free = range(len(self.numbers))
        found = [
            self.likelihood.best(each.logs, each.state, free)
            for each, low in zip(self._grid, lower, strict=True)
            if low
        ]
        return sorted(found, key=lambda each: each.cost)

    @property
    def found(self) -> Fitted:
        """The best motion."""
        return self.minima[0]

    @property
    def freedom(self) -> float:
        """Degrees of freedom: the number of frames that count, minus that of the values fitted to them.

        Nuisance parameters count as far as the films determine them.
        """
        seen = self.likelihood.counted(self.found.changes)
        parts = float(np.sum(seen.parts * self.likelihood.weighted(seen.parts, seen.parts)))
        return max(len(seen.residuals) - len(self.numbers) - seen.by_state.shape[1] - parts, 1.0)

    def profile(self, k: int, log: float) -> float:
        """The least sum of squares with the logarithm of unknown number k fixed.

        Steps begin at minima of the nearest points of the grid, and at the nearest minimum over all numbers, as those
        that begin far from the least sum of squares may end above it.
        """
        near = [each for each in self._grid if abs(each.logs[k] - log) <= abs(self._axes[k] - log).min()]
        free = [other for other in range(len(self.numbers)) if other != k]
        costs = np.array([each.cost for each in near])
        # the lowest one of those that are equally near, to the precision to which minima are found
        nearest = min(self.minima, key=lambda each: (round(abs(each.logs[k] - log), 2), each.cost))
        found = np.inf
        for begin in [*(near[i] for i in minima_of(costs)), nearest]:
            logs = begin.logs.copy()
            logs[k] = log
            found = min(found, self.likelihood.best(logs, begin.state, free).cost)
        return found

    @cached_property
    def reach(self) -> list[tuple[float, float]]:
        """Logarithms at the ends of the interval of 95 % of each unknown number."""
        least, found = self.found.cost, []
        one, two = (n * scipy.stats.f.ppf(0.95, n, self.freedom) for n in (1, 2))
        several = len({round(float(each.logs[0]), 2) for each in self.minima if each.cost <= least + two}) > 1
        limit = least + (two if several else one)
        for k, axis in enumerate(self._axes):
            logs = np.unique([*axis, *(each.logs[k] for each in self.minima)])
            costs = np.array([self.profile(k, log) for log in logs])
            costs[np.searchsorted(logs, self.found.logs[k])] = least
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
        best = self.found
        derivatives = (
            self.likelihood.by_log(k, best.logs, best.state, best.changes.residuals) for k in range(len(self.numbers))
        )
        return np.column_stack(list(derivatives))

    @cached_property
    def parts(self) -> list[dict[str, float]]:
        """Contribution of each nuisance parameter to the half-width of each unknown number, over its value.

        They are of first order; that of the noise is "noise".
        """
        found = shares(self.likelihood, self.found.changes, self._by_logs, self.model.names, DIFFERENCE.key)
        return [{name: NORMAL * size for name, size in each.items() if size > 0} for each in found]

    @property
    def difference(self) -> tuple[float, float]:
        """The difference of the diameters over their mean, and its half-width: as fitted, or as given if known."""
        if not self.model.differs:
            return self.model.difference
        best = self.found
        seen = self.likelihood.counted(best.changes)
        columns = np.concatenate([seen.by_state, self._by_logs[self.likelihood.used]], axis=1)
        prior = np.diag(np.append(self.likelihood.normal.astype(float), np.zeros(len(self.numbers))))
        spread = np.linalg.pinv(columns.T @ self.likelihood.weighted(seen.parts, columns) + prior)
        k = seen.by_state.shape[1] - 1
        return self.model.difference_at(best.state), self.model.difference[1] * float(np.sqrt(spread[k, k]))

    @property
    def alike(self) -> float:
        """Correlation of the residuals of neighbouring frames; it is small, too, if they are far below the noise."""
        off = self.found.residuals[self.likelihood.used]
        return float(off[1:] @ off[:-1]) / max(float(off @ off), len(off) * self.likelihood.noise**2)


@contextmanager
def near_films(film: Path | str) -> Iterator[None]:
    """Turn a singular least-squares problem into an InputError that names the first film.

    It arises where no motion of the atlas fits the frames, so that numbers overflow: if a time is far beyond all
    others, or a single distance is wrong in a film that has no noise.
    """
    try:
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            yield
    except np.linalg.LinAlgError:
        wrong = "no motion of the atlas comes close to these frames: a time or a distance is far from all others"
        raise InputError(str(film), "", None, wrong) from None


def _scatter(times: Array, distances: Array) -> float:
    """Standard deviation of the noise of a film [D_c], by deviations of frames from the line between neighbours."""
    if len(times) < 3:
        return EXACT
    part = (times[1:-1] - times[:-2]) / (times[2:] - times[:-2])
    off = distances[1:-1] - (1 - part) * distances[:-2] - part * distances[2:]
    return SCATTER * float(np.median(np.abs(off) / np.sqrt(1 + (1 - part) ** 2 + part**2)))
