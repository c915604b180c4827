"""Velocities of a row of any number of equal particles, from those of rows of up to five.

The velocity of a particle in a row is that of a single particle, plus contributions of each set of neighbours to which
it belongs: of pairs, of three particles in succession, of four, and of five. The contribution W of k neighbours is
defined by the velocities U of a row of k particles: it is U minus the contributions of all shorter rows of neighbours
among them (the cumulant expansion of a chain). Only particles in succession have a contribution: any disturbance that
reaches one particle from another has passed those between, which is why sums over all pairs are so poor and this series
converges (measured: each additional particle contributes less by a factor of 4 to 7 at a distance of d = 0.1, and of 3
at 0.2 in a liquid with De = 1).

The contributions are sums of products of exponentials of the distances, since disturbances of the flow in a tube decay
exponentially. All are fitted together. Velocities at held distances and lengths of particles are fitted to those of
short rows and to their derivatives with respect to the distances. The effect of motion on the velocities, whose
derivatives are not known, is fitted to that in short rows and to the growth rates of infinite trains, in which errors
of slopes would accumulate that short rows do not show.

The error of velocities between those of the short rows is judged by leaving out every `FOLDS`th of these and fitting
all others again (a delete-a-group jackknife).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product, zip_longest

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view

from pairsim.runtime.arrays import Array
from pairsim.solvers.rows.closing import Closing
from pairsim.solvers.rows.deviations import TERMS, Deviations, deviations
from pairsim.solvers.rows.exponential_sums import SMALLEST, Remainder, slowest
from pairsim.solvers.rows.lag import Lag
from pairsim.solvers.rows.stretch import Stretch

RATES = np.geomspace(1.0, 8.0, 16)  # decay rates that are tried for the slowest exponential [1/D_c]; chosen
# The rates of all exponentials are multiples of that of the slowest one. A term of k particles has a multiple, at least
# 1, for each of its k - 1 distances; all combinations are used whose sum is at most this number plus k - 1. Chosen.
POWERS = {2: 6, 3: 4, 4: 2, 5: 1}
TRUSTED = 1e-3  # least error of a solution in the fit, relative to the largest |dU|; chosen
SLOPES = 0.3 / RATES[-1]  # weight of slopes relative to that of values [D_c]; chosen
FOLDS = 11  # chosen; coprime with the numbers of short rows, so that no distance is left out altogether
FILM = 0.07  # c over the diameter; fitted to one rigid pair at De 1.6, whose dU it matches to 2 % from d = .04 to .005
FARTHEST, PLACES = 1.6, 100  # largest distance and number of distances at which terms are compared; chosen
LEAST_ERROR = 1e-12  # least error of the dU of a short row, whose weight in the fit is 1/error [U_av]; chosen


@dataclass(frozen=True)
class Row:
    """Velocities and lengths in a row of N particles, from a solution or from a model.

    Attributes:
        gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).
        values: Three numbers for each particle, shape (N, 3): its velocity at held distances [U_av]; the distance from
            its centre to that of the next particle minus the distance between their surfaces or, for the last particle,
            the distance from its centre to its front [D_c]; and the effect of motion on its velocity [U_av].
        slopes: Derivatives of these numbers with respect to each distance, shape (N, N-1, 2 or 3): of the first two in
            a solution, of all three in a model; NaN where they are not known.
        dU_error: Largest half-width of a relative velocity [U_av].
        by_particle: Derivatives of the velocities on the slow manifold (rows) with respect to the logarithms of
            diameter and Ca_e of each particle (columns), shape (N, N, 2) [U_av]; None if they were not asked for.
        rear: Distance from the rear of the first particle to its centre [D_c].
        parts: Deviations of the logarithms of diameter and Ca_e of each particle from those of equal particles, shape
            (N, 2); None if all are equal.
        lag: How much longer the distances between centres are than at held distances between surfaces, because shapes
            lag behind distances that change [D_c], shape (N-1,); None for rigid particles, or where they do not move
            relative to each other.
    """

    gaps: Array
    values: Array
    slopes: Array
    dU_error: float = 0.0
    by_particle: Array | None = None
    rear: float = 0.0
    parts: Array | None = None
    lag: Array | None = None

    def followed(self, rear: float) -> Row:
        """The same row with one more particle far downstream, which has no values of its own.

        The second value of the last particle then has the meaning that it has for the others: the distance to the next
        centre minus that between the surfaces. Otherwise it would lack the length from the rear of the next particle to
        its centre, and would jump by this when a particle is added, however far away.

        Args:
            rear: Distance from the rear of the additional particle to its centre [D_c].
        """
        ends = np.zeros_like(self.values)
        ends[-1, 1] = rear
        return replace(self, values=self.values + ends)

    @property
    def U(self) -> Array:
        """Velocities of the particles on the slow manifold [U_av], shape (N,)."""
        return np.asarray(self.values[:, 0] + self.values[:, 2])

    @property
    def dU(self) -> Array:
        """Relative velocities of neighbours on the slow manifold [U_av], shape (N-1,)."""
        return np.diff(self.U)

    @property
    def rates(self) -> Array:
        """Rates of the distances between surfaces [U_av], (N-1,), at which those between centres change by dU."""
        return np.asarray(np.linalg.solve(np.eye(len(self.gaps)) + self.slopes[:-1, :, 1], self.dU))


type Waves = tuple[float, Array, Array]
"""Distance in an infinite train [D_c], phases between neighbours and complex growth rates [U_av/D_c], (m,) each."""


@dataclass(frozen=True)
class RowModel:
    """The values of `Row` for rows of any number of equal particles.

    Attributes:
        alone: Values of a single particle, those of a `Row` that is `followed`: the second is its length, shape (q,).
        rates: For two, three, ... neighbours, the rates at which the m terms of their contribution decay with each of
            their distances [1/D_c], shape (m, k-1) for k neighbours.
        coefficients: The coefficients of these terms in the values of each neighbour, those of two neighbours first,
            shape (sum of all m k, q).
        least: Smallest distance that was solved [D_c]; at smaller distances the values are those at this one.
        short: The rows to which it was fitted.
        others: Models fitted to these rows with some left out, whose differences from this one are a measure of errors.
        deviations: Changes of velocities where particles differ from each other; None if they were not asked for.
        film: Distance c of films, relative to the length of a particle (`pairsim.solvers.rows.films`).
        closing: Slowing of particles that come closer below `least`, in place of such films; None if it is not known.
        lag: Lag of shapes behind distances that change; None if it is not known.
        remainder: For a variant by which errors are judged: a change of some terms, of the size of those that the
            series may leave out; None for no change.
    """

    alone: Array
    rates: Sequence[Array]
    coefficients: Array
    least: float = 0.0
    short: Sequence[Row] = ()
    others: Sequence[RowModel] = ()
    deviations: Deviations | None = None
    film: float = FILM
    closing: Closing | None = None
    lag: Lag | None = None
    remainder: Remainder | None = None

    @property
    def variants(self) -> Sequence[RowModel]:
        """Models whose differences from this one are a measure of the errors of all that follows from velocities.

        These are `others`, and this model with one change each:

        - It has no films, as their c was fitted to one pair only. Where the effect of films is known from a solved pair
          (`closing`), it has films with that c instead.
        - The contribution of the largest number of neighbours is left out, as a measure of that of still more of them.

        Where particles may differ, the second change is replaced by several:

        - The contribution of the largest number of neighbours is changed by as much as still more of them may
          contribute (`_by_more_neighbours`).
        - The second-order terms of some pairs are left out, as a measure of the third-order terms of pairs and the
          second-order terms of three neighbours.
        - Particles come closer faster, by the errors of the solved pair.
        - Shapes do not lag behind distances, as their lag is known to first order only.
        - Lengths change more.
        """
        films = replace(self, film=0.0) if self.closing is None else replace(self, closing=None)
        if self.deviations is not None:
            return [*self.others, films, *self._others_of_unequal(self.deviations)]
        found = [*self.others, films]
        if len(self.rates) > 1:
            of_most = len(self.rates[-1]) * (len(self.rates) + 1)
            found.append(
                replace(self, coefficients=np.vstack([self.coefficients[:-of_most], 0 * self.coefficients[-of_most:]]))
            )
        return found

    def _others_of_unequal(self, differ: Deviations) -> Iterator[RowModel]:
        """Those of the `variants` that exist only where particles may differ."""
        of_equals, of_others = (self._by_more_neighbours(len(each) + 1) for each in (self.rates, differ.parts))
        for one, other in zip_longest(of_equals, of_others):
            yield replace(self, remainder=one, deviations=replace(differ, remainder=other))
        if differ.pairs_twice is not None:
            for one in Remainder.phases(2):
                yield replace(self, deviations=replace(differ, remainder_twice=one))
        if self.closing is not None:
            yield replace(self, closing=self.closing.faster)
        if self.lag is not None:
            yield replace(self, lag=None)
        if differ.stretch is not None:
            yield replace(self, deviations=replace(differ, stretch=differ.stretch.steeper))

    def _by_more_neighbours(self, count: int) -> list[Remainder]:
        """Changes of the contribution of `count` neighbours by as much as a larger number of them may contribute.

        Contributions are taken to form a geometric series in the number of neighbours: if that of `count` of them is q
        times that of one fewer, all larger numbers together contribute q/(1 - q) times as much as `count` of them. The
        ratio q depends on the distance, and is found for evenly spaced rows. (Measured at distances of 0.06 to 0.19:
        four rigid particles at De = 1 contribute .3 to .45 of what three do, and four soft ones in a Newtonian liquid
        .25; at 0.08 three contribute .36 and .23 of what two do.) The list is empty for fewer than three neighbours.
        """
        if count < 3:
            return []
        distances = np.linspace(self.least, FARTHEST, PLACES)
        more, fewer = (np.linalg.norm(self._added(each, distances), axis=1) for each in (count, count - 1))
        ratios = np.minimum(more / fewer, 0.5)  # at 0.5 the whole contribution is left out
        return Remainder.phases(count, distances, ratios / (1 - ratios))

    def _added(self, count: int, distances: Array) -> Array:
        """Contribution of `count` neighbours at equal distances, (m,) [D_c], to their velocities [U_av], (m, count)."""
        sizes = [len(rates) * n for n, rates in enumerate(self.rates, 2)]
        part = np.split(self.coefficients, np.cumsum(sizes)[:-1])[count - 2]
        terms = np.exp(-np.outer(distances, self.rates[count - 2].sum(axis=1)))
        return np.asarray(terms @ (part[:, 0] + part[:, 2]).reshape(-1, count))

    def row(self, gaps: Array) -> Row:
        """The row at given distances, shape (N-1,)."""
        n, left = len(gaps) + 1, self.coefficients
        values, slopes = np.tile(self.alone, (n, 1)), np.zeros((n, n - 1, len(self.alone)))
        for count, rates in enumerate(self.rates[: n - 1], 2):
            part, left = np.split(left, [len(rates) * count])
            part = part.reshape(len(rates), count, -1)
            windows = sliding_window_view(gaps, count - 1)
            terms = self._terms(windows, rates)
            changes = -terms[:, :, None] * rates * (windows >= self.least)[:, None]
            own = np.arange(len(windows))[:, None] + np.arange(count)
            np.add.at(values, own, np.tensordot(terms, part, 1))
            np.add.at(slopes, (own[:, :, None], own[:, None, :-1]), np.einsum("wmj,mki->wkji", changes, part))
        return Row(gaps, values, slopes)

    def along(self, gaps: Array) -> tuple[Array, Array]:
        """Velocities and derivatives that determine the motion of a row, in memory proportional to its length.

        Args:
            gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).

        Returns:
            Velocities [U_av], shape (N,); and the derivatives of the distances between centres (rows) with respect to
            those between surfaces (columns), as a banded matrix for `scipy.linalg.solve_banded` with k diagonals on
            each side of the main one, shape (2 k + 1, N-1).
        """
        n, left, width = len(gaps) + 1, self.coefficients, min(len(self.rates), len(gaps))
        U, stretch = np.full(n, self.alone[0] + self.alone[2]), np.zeros((2 * width + 1, len(gaps)))
        stretch[width] = 1.0
        for count, rates in enumerate(self.rates[: n - 1], 2):
            part, left = np.split(left, [len(rates) * count])
            part = part.reshape(len(rates), count, -1)
            windows = sliding_window_view(gaps, count - 1)
            terms = self._terms(windows, rates)
            added, total = terms @ (part[:, :, 0] + part[:, :, 2]), len(windows)
            for i in range(count):
                U[i : i + total] += added[:, i]
            for j in range(count - 1):
                lengths = (windows[:, j] >= self.least)[:, None] * (terms @ (-rates[:, j, None] * part[:, :, 1]))
                for i in range(count):  # the last particle has no next one
                    rows = min(total, len(gaps) - i)
                    stretch[width + i - j, j : j + rows] += lengths[:rows, i]
        return U, stretch

    def _terms(self, windows: Array, rates: Array) -> Array:
        """The terms of each set of k neighbours along a row at their distances, (w, k-1) [D_c], shape (w, m)."""
        terms = np.exp(-np.maximum(windows, self.least) @ rates.T)
        if self.remainder is not None and self.remainder.count == windows.shape[1] + 1:
            terms = terms * self.remainder.factors(windows)
        return np.asarray(terms)

    def growth(self, d: float, k: Array) -> Array:
        """Complex growth rates of waves in a long, evenly spaced row [U_av/D_c], shape (m,).

        Args:
            d: The distance [D_c].
            k: Phases between neighbours, shape (m,).
        """
        dU, lengths = self.waves(d, k)
        return np.asarray((dU[:, 0] + dU[:, 2]) / (1 + lengths[:, 1]))

    def waves(self, d: float, k: Array) -> tuple[Array, Array]:
        """Changes of the values by waves of the distances in a long, evenly spaced row; arguments as for `growth`.

        Returns:
            Changes of the difference between the values of a particle and those of its upstream neighbour, and changes
            of the values of that neighbour, (m, q) each, for waves whose amplitude at the distance between the two is
            1.
        """
        middle = len(self.rates)
        slopes = self.row(np.full(2 * middle + 1, d)).slopes[middle : middle + 2]
        waves = np.exp(1j * np.outer(k, np.arange(2 * middle + 1) - middle))
        return waves @ (slopes[1] - slopes[0]), waves @ slopes[0]

    def dU_errors(self, gaps: Array) -> Array:
        """Half-widths of the relative velocities of a row [U_av], shape (N-1,).

        Each is the sum of two parts: its change where some of the short rows are left out of the fit, and the largest
        error of nearby short rows: those of at most as many particles whose smallest distances are closest, from below
        and above, to that of this row.
        """
        changes = [other.row(gaps).dU - self.row(gaps).dU for other in self.others]
        return np.asarray(np.linalg.norm(changes, axis=0) + self.dU_error_nearby(gaps))

    def dU_error_nearby(self, gaps: Array) -> float:
        """The largest error of a relative velocity in nearby short rows [U_av], as defined in `dU_errors`."""
        few = [row for row in self.short if len(row.gaps) <= len(gaps)]
        narrowest = np.unique([row.gaps.min() for row in few])
        near = narrowest[max(np.searchsorted(narrowest, gaps.min(), "right") - 1, 0) :][:2]
        return max(row.dU_error for row in few if row.gaps.min() in near)


def fitted(rows: Sequence[Row], trains: Sequence[Waves] = ()) -> RowModel:
    """Fit a model to short rows and trains, with terms of up to as many neighbours as the longest row has particles.

    Args:
        rows: Short rows, the first one of a single particle. Rows whose particles differ are used only for the effect
            of these differences.
        trains: Waves of infinite trains.
    """
    rear, unequal = rows[0].rear, [row for row in rows if row.parts is not None]
    alone, *rows = [row.followed(rear) for row in rows if row.parts is None]
    counts = range(2, max(len(row.values) for row in rows) + 1)
    least = max(LEAST_ERROR, TRUSTED * max(np.abs(row.dU).max() for row in rows))
    rows = [replace(row, dU_error=max(row.dU_error, least)) for row in rows]
    most = {n: POWERS[n] + n - 1 for n in counts}
    powers = [[p for p in product(range(1, most[n] + 1), repeat=n - 1) if sum(p) <= most[n]] for n in counts]
    every = [[rate * np.array(each) for each in powers] for rate in RATES]
    _, best = min((_fitted(rates, alone, rows, trains) for rates in every), key=lambda fit: fit[0])
    parts = [[row for i, row in enumerate(rows) if i % FOLDS != fold] for fold in range(FOLDS)]
    others = [replace(_fitted(best.rates, alone, part, trains)[1], least=best.least) for part in parts]
    if alone.by_particle is not None:
        best, *others = _of_unequal([best, *others], alone, [rows, *parts], unequal)
    return replace(best, short=rows, others=others)


def _of_unequal(
    models: Sequence[RowModel], alone: Row, parts: Sequence[Sequence[Row]], unequal: Sequence[Row]
) -> list[RowModel]:
    """Complete models of equal particles with the changes of velocities where particles differ.

    Args:
        models: The models, of which the first one was fitted to all short rows.
        alone: A single particle.
        parts: The short rows to which each model was fitted.
        unequal: Short rows in which one particle differs, and pairs that come closer, in which both do.
    """
    one_differs = [row for row in unequal if _differing(row) == 1]
    rates, least = models[0].rates, models[0].least
    lag = Lag.fitted([row for row in [*parts[0], *unequal] if len(row.gaps) == 1], least)
    pairs = [row for row in parts[0] if len(row.gaps) == 1]
    stretch = Stretch.fitted(pairs, one_differs, slowest(rates[0], TERMS[2]))
    closing = Closing.of([row for row in unequal if _differing(row) == 2], least)
    of = [replace(deviations(alone, part, one_differs, rates, least), stretch=stretch) for part in parts]
    return [replace(one, deviations=each, closing=closing, lag=lag) for one, each in zip(models, of, strict=True)]


def _differing(row: Row) -> int:
    """Number of diameters and moduli that differ from those of equal particles."""
    return 0 if row.parts is None else int(np.count_nonzero(row.parts))


def _fitted(rates: Sequence[Array], alone: Row, rows: Sequence[Row], trains: Sequence[Waves]) -> tuple[float, RowModel]:
    """Fit a model whose terms have given rates; returns the mean square residual of velocities, and the model."""
    count, single = sum(each.size + len(each) for each in rates), alone.values[0]
    # With the identity as coefficients, the values of a row are the terms that multiply each coefficient.
    basis, weights = RowModel(np.zeros(count), rates, np.eye(count)), [1 / row.dU_error for row in rows]
    of = [basis.row(row.gaps) for row in rows]
    terms = np.vstack([weight * each.values for weight, each in zip(weights, of, strict=True)])
    values = np.vstack([weight * (row.values - single) for weight, row in zip(weights, rows, strict=True)])
    steep = np.vstack([SLOPES * w * each.slopes.reshape(-1, count) for w, each in zip(weights, of, strict=True)])
    slopes = np.vstack([SLOPES * w * row.slopes.reshape(-1, 2) for w, row in zip(weights, rows, strict=True)])
    known = np.concatenate([np.ones(len(terms), bool), np.isfinite(slopes[:, 1])])
    matrix, wanted = np.vstack([terms, steep]), np.vstack([values[:, :2], slopes])
    velocities, missed = _solution(matrix, wanted[:, :1])
    lengths, _ = _solution(matrix[known], wanted[known, 1:])
    held = np.hstack([velocities, lengths])
    moving, added, weight = [terms], [values[:, 2:]], max(weights) * SLOPES
    for d, k, growth in trains:
        dU, stretch = basis.waves(d, k)
        rest = weight * (growth * (1 + stretch @ held[:, 1]) - dU @ held[:, 0])
        moving, added = [*moving, weight * dU.real, weight * dU.imag], [*added, rest.real[:, None], rest.imag[:, None]]
    moved, also_missed = _solution(np.vstack(moving), np.vstack(added))
    model = RowModel(single, rates, np.hstack([held, moved]), min(row.gaps.min() for row in rows))
    return float(missed[0] + also_missed[0]), model


def _solution(matrix: Array, values: Array) -> tuple[Array, Array]:
    """The solution of a least-squares problem, and the mean square residual of each column of values."""
    size = np.abs(matrix).max(axis=0)
    found = np.asarray(scipy.linalg.lstsq(matrix / size, values, cond=SMALLEST)[0] / size[:, None])
    return found, np.mean((matrix @ found - values) ** 2, axis=0)
