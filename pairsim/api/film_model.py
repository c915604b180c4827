"""What films of a pair show by an atlas, and what each thing that is not known exactly changes in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from pairsim.atlas.atlas import Atlas
from pairsim.cases.physical import DIFFERENCE
from pairsim.results.curve_table import Motion
from pairsim.runtime.arrays import Array

NORMAL = float(scipy.stats.norm.ppf(0.975))  # half-width of an interval of 95 % over the standard deviation
FINE = 240  # intervals of time in which changes of a motion are integrated; chosen
MODES = (1.0, 2.0, 4.0, 8.0)  # rates of what is left of the start, in units of the slowest one; chosen
NEARLY_ALL = 0.99  # of the variance of errors of the atlas that are not alike at all distances; chosen
START = 0.02  # standard deviation of each such part [D_c]; runs from rest have up to 0.008
SHORTEST = 1e-3  # decay time that is distinguished from 0 [D_c/U_av]
SHAPE = (
    0.01  # by how much deformed beads change the gap between surfaces at given centres, over a diameter: runs, 0.009
)


@dataclass(frozen=True)
class Seen:
    """A film in the units of its case.

    Attributes:
        times: Times from its first frame on [D_c/U_av], shape (frames,).
        distances: Distances between the surfaces [D_c], of the same shape.
        centres: Distances between the centres [D_c] where these were seen; None where it was the surfaces.
        pixel: Relative half-width of the size of a pixel, 0 where it is known or not used.
        exchanged: Whether the beads have changed places, or the flow its direction.
    """

    times: Array
    distances: Array
    centres: Array | None = None
    pixel: float = 0.0
    exchanged: bool = False


@dataclass(frozen=True)
class Uncertain:
    """Something that is not known exactly, and what it changes.

    Attributes:
        name: The key of the `physical` block.
        half_width: Relative half-width of its interval of 95 %.
        powers: Of the quantity in beta, De and Ca_e, and in the scales of length and velocity, by name.
    """

    name: str
    half_width: float
    powers: Mapping[str, float]


@dataclass(frozen=True)
class Changes:
    """A motion less what was seen, and its changes.

    Attributes:
        residuals: Distances of the model less those that were seen [D_c], shape (frames,).
        by_start: Their derivatives by the distance at the first frame of each film, shape (frames, films).
        parts: Changes by one standard deviation of each thing that is not known [D_c], shape (frames, things).
    """

    residuals: Array
    by_start: Array
    parts: Array


@dataclass(frozen=True)
class FilmModel:
    """Films of one pair.

    Attributes:
        atlas: Its dU at each distance.
        numbers: beta, De and Ca_e; those that are unknown are replaced.
        films: What was seen.
        uncertain: Quantities with half-widths, the same in all films.
        difference: The difference of the two diameters over their mean, leading less trailing, and its half-width.
    """

    atlas: Atlas
    numbers: Mapping[str, float]
    films: Sequence[Seen]
    uncertain: Sequence[Uncertain] = ()
    difference: tuple[float, float] = (0.0, 0.0)
    _tables: dict[Any, tuple[Mapping[str, Array], Motion]] = field(default_factory=dict, repr=False)

    @property
    def names(self) -> list[str]:
        """What the columns of `Changes.parts` are: the name of the thing, several columns may have the same one."""
        atlas = ["atlas"] * len(self.errors)
        films = [name for seen in self.films for name in ("start",) * len(MODES)]
        centres = ["shape of the beads"] * any(seen.centres is not None for seen in self.films)
        pixel = ["pixel"] * any(seen.pixel for seen in self.films)
        difference = [DIFFERENCE.key] * bool(self.difference[1])
        return [*(each.name for each in self.uncertain), *difference, *pixel, *centres, *films, *atlas]

    def motion(self, numbers: Mapping[str, float]) -> tuple[Mapping[str, Array], Motion]:
        """Table and motion of the pair at numbers that replace those of the case; kept for further calls."""
        key = tuple(numbers.items())
        if key not in self._tables:
            table = self.atlas.table(**{**self.numbers, **numbers})
            motion = Motion.of(table)
            assert motion is not None, "an atlas has many distances"
            self._tables[key] = table, motion
        return self._tables[key]

    def changes(self, numbers: Mapping[str, float], starts: Sequence[float]) -> Changes:
        """What the films would show, less what they do.

        Args:
            numbers: Those of De and Ca_e that are unknown.
            starts: The distance at the first frame of each film [D_c], of the motion without what is left of its start.
        """
        paths = self._paths(numbers, starts)
        residuals, by_start = self._residuals(paths)
        common = [np.concatenate(each) for each in zip(*(path.parts() for path in paths), strict=True)]
        own = scipy.linalg.block_diag(*(path.left_of_start() for path in paths))
        return Changes(residuals, by_start, np.concatenate([*common[:-1], own, common[-1]], axis=1))

    def residuals(self, numbers: Mapping[str, float], starts: Sequence[float]) -> tuple[Array, Array]:
        """The first two of `Changes` alone."""
        return self._residuals(self._paths(numbers, starts))

    def _paths(self, numbers: Mapping[str, float], starts: Sequence[float]) -> list[Path]:
        table, motion = self.motion(numbers)
        here = {**self.numbers, **numbers}
        return [Path(self, seen, here, table, motion, start) for seen, start in zip(self.films, starts, strict=True)]

    @staticmethod
    def _residuals(paths: Sequence[Path]) -> tuple[Array, Array]:
        by_start = scipy.linalg.block_diag(*(path.by_start[:, None] for path in paths))
        return np.concatenate([path.residuals for path in paths]), by_start

    @cached_property
    def errors(self) -> Array:
        """Functions of the distance whose sums with normal factors change as errors of the atlas do.

        One is the same at all distances, so that it is not underestimated what errors which are alike do; those of the
        others that matter have variance 1 together, shape (functions, distances).
        """
        _, sizes, shapes = np.linalg.svd(self.atlas.patterns, full_matrices=False)
        matter = sizes[:, None] * shapes
        matter = matter[np.cumsum(sizes**2) <= NEARLY_ALL * np.sum(sizes**2)]
        return np.vstack([np.ones(matter.shape[1]), matter / np.linalg.norm(matter, axis=0)])


@dataclass(frozen=True)
class Path:
    """The motion that one film would show, at values of what is unknown."""

    model: FilmModel
    seen: Seen
    here: Mapping[str, float]  # beta, De and Ca_e
    table: Mapping[str, Array]  # of the atlas there
    motion: Motion
    start: float  # distance at the first frame [D_c]

    @cached_property
    def times(self) -> Array:
        """Times at which changes are integrated, shape (FINE + 1,)."""
        return np.linspace(0.0, max(float(self.seen.times[-1]), SHORTEST), FINE + 1)

    @cached_property
    def distances(self) -> Array:
        """Distances at these times, of the same shape."""
        return self.motion.path(self.start, self.times)

    @cached_property
    def grown(self) -> Array:
        """What a change of the first distance has become at these times, of the same shape."""
        by_log, rates = self.motion.rates
        growth = rates + np.gradient(rates, by_log)  # derivative of the rate of d by d
        return np.exp(_integral(np.interp(np.log(self.distances), by_log, growth), self.times))

    @cached_property
    def by_start(self) -> Array:
        """The same at the frames, shape (frames,)."""
        return np.interp(self.seen.times, self.times, self.grown)

    @cached_property
    def residuals(self) -> Array:
        """Distances less those that were seen [D_c], shape (frames,)."""
        fitted = np.interp(self.seen.times, self.times, self.distances)
        if self.model.difference[0]:
            fitted = fitted + self.model.difference[0] * self._by_difference[:, 0]
        return np.asarray(fitted - self.seen.distances)

    def shifts(self, velocities: Array) -> Array:
        """What changes of dU, shape (columns, distances), change at the frames, shape (frames, columns)."""
        x, nodes = np.log(self.distances), np.log(self.table["d"])
        stretch = np.interp(x, nodes, self.table["stretch"])
        along = np.array([np.interp(x, nodes, each) for each in np.atleast_2d(velocities)])
        moved = self.grown * _integral(along / (stretch * self.grown), self.times)
        return np.array([np.interp(self.seen.times, self.times, each) for each in moved]).T

    @cached_property
    def _by_difference(self) -> Array:
        return (-1.0 if self.seen.exchanged else 1.0) * self.shifts(self.table["by_difference"])

    def parts(self) -> list[Array]:
        """Changes by what films have in common, in the order of `FilmModel.names`, those of the atlas last."""
        model, seen, frames = self.model, self.seen, len(self.seen.times)
        columns = []
        if model.uncertain:
            of_inputs = self.shifts(np.array([self._velocity_change(each) for each in model.uncertain]))
            if seen.centres is not None:  # distances are those of the centres less a diameter
                of_inputs += self.here["beta"] * np.array([each.powers.get("beta", 0.0) for each in model.uncertain])
            columns.append(of_inputs * [each.half_width / NORMAL for each in model.uncertain])
        if model.difference[1]:
            columns.append(self._by_difference * model.difference[1] / NORMAL)
        if any(each.pixel for each in model.films):
            whole = seen.distances if seen.centres is None else seen.centres
            columns.append(-whole[:, None] * seen.pixel / NORMAL)
        if any(each.centres is not None for each in model.films):
            shape = SHAPE * self.here["beta"] if seen.centres is not None else 0.0
            columns.append(np.full((frames, 1), shape / NORMAL))
        return [*columns, self.shifts(self.table["dU_error"] / NORMAL * model.errors)]

    def left_of_start(self) -> Array:
        """What may be left of the start: exponentials of the slowest decay time and of faster ones, (frames, MODES)."""
        slowest = float(np.interp(np.log(self.start), np.log(self.table["d"]), self.table["t_relax"]))
        return np.asarray(START * np.exp(-np.outer(self.seen.times / max(slowest, SHORTEST), MODES)))

    def _velocity_change(self, one: Uncertain) -> Array:
        """Derivative of dU by the logarithm of a quantity at a distance that is constant in units, (distances,)."""
        table, powers = self.table, one.powers
        change = table["dU"] * powers.get("velocity", 0.0) - table["d"] * table["slope"] * powers.get("length", 0.0)
        numbers = ((name, powers[name]) for name in ("beta", "De", "Ca_e") if powers.get(name))
        return np.asarray(change + sum(self.here[name] * power * table[f"by_{name}"] for name, power in numbers))


def _integral(values: Array, times: Array) -> Array:
    """The integral over time from the first one on, along the last axis."""
    return np.asarray(scipy.integrate.cumulative_trapezoid(values, times, initial=0))
