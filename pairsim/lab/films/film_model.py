"""The model of films of a pair by an atlas, and what each nuisance parameter changes in them.

Nuisance parameters are the quantities that are not known exactly, beside those that are fitted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy

from pairsim.analysis.master_curve import Curve
from pairsim.analysis.pair_motion import path_by
from pairsim.atlas.atlas import PARAMETERS, Atlas
from pairsim.lab.atlas_curve import curve_of_atlas
from pairsim.record.columns import BY_DIFFERENCE, DISTANCE, DU, DU_ERROR, SENSITIVITIES, SLOPE, STRETCH, T_RELAX
from pairsim.record.table import Table
from pairsim.runtime.arrays import Array

NORMAL = float(scipy.stats.norm.ppf(0.975))  # half-width of an interval of 95 % over the standard deviation
FINE = 240  # intervals of time in which changes of a motion are integrated; chosen
MODES = (1.0, 2.0, 4.0, 8.0)  # decay rates of the start-up transient, in units of the slowest one; chosen
NEARLY_ALL = 0.99  # part of the variance of the atlas's errors, without their common part, that is kept; chosen
START = 0.02  # standard deviation of the transient at each of these rates [D_c]; runs from rest have up to 0.008
SHORTEST = 1e-3  # decay time that is distinguished from 0 [D_c/U_av]
OF_DERIVATIVE = 0.03  # relative half-width of the derivative by the difference of diameters, by curves left out
MOST_DEVIATIONS = 8.0  # standard deviations of the difference of the diameters, at most, from its given value; chosen
SHAPE = 0.01  # half-width of what deformation adds to the gap at given centres, in diameters; runs have up to 0.0095


@dataclass(frozen=True)
class Seen:
    """A film in the units of its case.

    Attributes:
        times: Times from its first frame on [D_c/U_av], shape (frames,).
        distances: Distances between the surfaces [D_c], of the same shape.
        centres: Distances between the centres [D_c] if the film has these; None if it has those between the surfaces.
        pixel: Relative half-width of the size of a pixel, 0 where it is known or not used.
        exchanged: Whether the beads have exchanged places, or the flow was reversed, relative to the first film.
    """

    times: Array
    distances: Array
    centres: Array | None = None
    pixel: float = 0.0
    exchanged: bool = False


@dataclass(frozen=True)
class Uncertain:
    """A quantity of an experiment that is not known exactly, and what it changes.

    Attributes:
        name: Its key in the `physical` block.
        half_width: Relative half-width of its interval of 95 %.
        powers: Exponents of the quantity in beta, De and Ca_e, and in the scales of length and velocity, by name.
    """

    name: str
    half_width: float
    powers: Mapping[str, float]


@dataclass(frozen=True)
class Changes:
    """Residuals of a motion, and what changes them.

    Attributes:
        residuals: Distances of the model minus those that were seen [D_c], shape (frames,).
        by_state: Their derivatives by the state, shape (frames, states).
        parts: Their changes by one standard deviation of each nuisance parameter [D_c], shape (frames, parameters).
    """

    residuals: Array
    by_state: Array
    parts: Array


class Place(NamedTuple):
    """The curve of the atlas at one place.

    Attributes:
        here: beta, De and Ca_e of the place.
        curve: The curve.
        x: Logarithms of distances, shape (nodes,).
        rates: Their rates of change in time at these distances [U_av/D_c], shape (nodes,).
        by_difference: Derivatives of these by the difference of the diameters over their mean, shape (nodes,).
    """

    here: Mapping[str, float]
    curve: Curve
    x: Array
    rates: Array
    by_difference: Array


@dataclass(frozen=True)
class FilmModel:
    """The model of films of one pair.

    Attributes:
        atlas: The atlas that gives dU at each distance.
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
    _places: dict[Any, Place] = field(default_factory=dict, repr=False)

    @property
    def names(self) -> list[str]:
        """Names of the nuisance parameters, the columns of `Changes.parts`; several columns may have the same one."""
        atlas = ["atlas"] * len(self.errors) * (2 if any(self.difference) else 1)
        films = [name for seen in self.films for name in ("start",) * len(MODES)]
        centres = ["shape of the beads"] * any(seen.centres is not None for seen in self.films)
        pixel = ["pixel"] * any(seen.pixel for seen in self.films)
        return [*(each.name for each in self.uncertain), *pixel, *centres, *films, *atlas]

    @property
    def states(self) -> Array:
        """Least and largest values of the state, shape (states, 2).

        The state is the distance at the first frame of each film [D_c], for the motion without a start-up transient,
        and, unless the difference of the diameters is known, the deviation of this over its standard deviation.
        """
        d = self.atlas.d
        return np.array([[d[0], d[-1]]] * len(self.films) + [[-MOST_DEVIATIONS, MOST_DEVIATIONS]] * self.differs)

    @property
    def differs(self) -> bool:
        """Whether the difference of the diameters is not known, and therefore part of the state."""
        return self.difference[1] > 0

    def difference_at(self, state: Array) -> float:
        """The difference of the diameters over their mean, at a state."""
        return float(self.difference[0] + self.difference[1] / NORMAL * (state[-1] if self.differs else 0.0))

    def place(self, numbers: Mapping[str, float]) -> Place:
        """The atlas at numbers that replace those of the case; kept for further calls."""
        key = tuple(numbers.items())
        if key not in self._places:
            here = {**self.numbers, **numbers}
            curve = curve_of_atlas(self.atlas, beta=here["beta"], De=here["De"], Ca_e=here["Ca_e"])
            assert curve.motion is not None, "an atlas has many distances"
            x, rates = curve.motion.rates
            by_difference = np.zeros_like(rates)
            if any(self.difference):
                slopes = curve.table[BY_DIFFERENCE] / curve.table[STRETCH]
                by_difference = np.interp(x, np.log(curve.table[DISTANCE]), slopes) / np.exp(x)
            self._places[key] = Place(here, curve, x, rates, by_difference)
        return self._places[key]

    def changes(self, numbers: Mapping[str, float], state: Array) -> Changes:
        """Residuals and what changes them, at values of the unknown numbers, by name, and a state as in `states`."""
        paths = self._paths(numbers, state)
        common = [np.concatenate(each) for each in zip(*(path.parts() for path in paths), strict=True)]
        own = scipy.linalg.block_diag(*(path.left_of_start() for path in paths))
        residuals, by_state = self._residuals(paths)
        return Changes(residuals, by_state, np.concatenate([*common[:-1], own, common[-1]], axis=1))

    def residuals(self, numbers: Mapping[str, float], state: Array) -> tuple[Array, Array]:
        """The residuals and their derivatives by the state, the first two of `Changes`, in less time."""
        return self._residuals(self._paths(numbers, state))

    def _paths(self, numbers: Mapping[str, float], state: Array) -> list[Path]:
        place, difference = self.place(numbers), self.difference_at(state)
        starts = state[: len(self.films)].tolist()
        return [Path(self, seen, place, difference, start) for seen, start in zip(self.films, starts, strict=True)]

    def _residuals(self, paths: Sequence[Path]) -> tuple[Array, Array]:
        by_state = scipy.linalg.block_diag(*(path.by_start[:, None] for path in paths))
        if self.differs:
            deviation = self.difference[1] / NORMAL
            by_state = np.column_stack([by_state, np.concatenate([deviation * path.by_difference for path in paths])])
        return np.concatenate([path.residuals for path in paths]), by_state

    @cached_property
    def errors(self) -> Array:
        """Functions of the distance by which errors of the atlas are modelled, shape (functions, distances).

        The sum of all, each times an independent normal factor of variance 1, varies with the distance as errors over
        their standard deviations do. One function is constant, so that errors which are the same at all distances are
        not underestimated. Of the others those that matter are kept, scaled such that their sum has variance 1.
        """
        _, sizes, shapes = np.linalg.svd(self.atlas.patterns, full_matrices=False)
        matter = sizes[:, None] * shapes
        matter = matter[np.cumsum(sizes**2) <= NEARLY_ALL * np.sum(sizes**2)]
        return np.vstack([np.ones(matter.shape[1]), matter / np.linalg.norm(matter, axis=0)])


@dataclass(frozen=True)
class Path:
    """The motion in one film by the model, at values of all unknowns."""

    model: FilmModel
    seen: Seen
    place: Place
    difference: float  # of the diameters over their mean
    start: float  # distance at the first frame [D_c]

    @property
    def _columns(self) -> Table:
        """The columns of the curve, shape (distances,) each."""
        return self.place.curve.table

    @cached_property
    def times(self) -> Array:
        """Times at which changes are integrated, shape (FINE + 1,)."""
        return np.linspace(0.0, max(float(self.seen.times[-1]), SHORTEST), FINE + 1)

    @cached_property
    def rates(self) -> Array:
        """Rates of change of the logarithm of the distance [U_av/D_c], shape (nodes,)."""
        side = -1.0 if self.seen.exchanged else 1.0
        return np.asarray(self.place.rates + side * self.difference * self.place.by_difference)

    @cached_property
    def distances(self) -> Array:
        """Distances at `times` [D_c], of the same shape."""
        return path_by(self.place.x, self.rates, self.start, self.times)

    @cached_property
    def stretch(self) -> Array:
        """Derivative of the distance that the film has by that between the surfaces at `times`, of the same shape.

        The centres of beads whose shapes change with the distance do not move as the facing surfaces do.
        """
        if self.seen.centres is None:
            return np.ones_like(self.times)
        motion = self.place.curve.motion
        assert motion is not None, "an atlas has many distances"
        return np.asarray(motion.stretch(self.distances))

    @cached_property
    def shown(self) -> Array:
        """Distances at `times` as the film has them [D_c]: those between the centres count from the first one on."""
        return self.start + np.asarray(_integral(self.stretch, self.distances))

    @cached_property
    def grown(self) -> Array:
        """Derivative of the distance at `times` by that at the first one, of the same shape."""
        growth = self.rates + np.gradient(self.rates, self.place.x)  # derivative of the rate of d by d
        return np.exp(_integral(np.interp(np.log(self.distances), self.place.x, growth), self.times))

    @cached_property
    def by_start(self) -> Array:
        """Derivative of the distance in the frames by that in the first one, shape (frames,)."""
        return np.interp(self.seen.times, self.times, 1 + self.stretch * self.grown - self.stretch[0])

    @property
    def by_difference(self) -> Array:
        """Derivative of the distance in the frames by the difference of the diameters over their mean, (frames,)."""
        side = -1.0 if self.seen.exchanged else 1.0
        return side * self.shifts(self._columns[BY_DIFFERENCE])[:, 0]

    @property
    def residuals(self) -> Array:
        """Distances of the model minus those that were seen [D_c], shape (frames,)."""
        return np.interp(self.seen.times, self.times, self.shown) - self.seen.distances

    def shifts(self, velocities: Array) -> Array:
        """Changes of the distance in the frames, (frames, columns), by changes of dU, (columns, distances)."""
        x, nodes = np.log(self.distances), np.log(self._columns[DISTANCE])
        stretch = np.interp(x, nodes, self._columns[STRETCH])
        along = np.array([np.interp(x, nodes, each) for each in np.atleast_2d(velocities)])
        moved = self.stretch * self.grown * _integral(along / (stretch * self.grown), self.times)
        return np.array([np.interp(self.seen.times, self.times, each) for each in moved]).T

    def parts(self) -> list[Array]:
        """Changes by nuisance parameters that films have in common, in the order of `FilmModel.names`.

        Those by errors of the atlas come last; each array has the shape (frames, columns).
        """
        model, seen, frames = self.model, self.seen, len(self.seen.times)
        columns = []
        if model.uncertain:
            of_inputs = self.shifts(np.array([self._velocity_change(each) for each in model.uncertain]))
            if seen.centres is not None:  # distances are those of the centres less a diameter
                of_inputs += self.place.here["beta"] * np.array(
                    [each.powers.get("beta", 0.0) for each in model.uncertain]
                )
            columns.append(of_inputs * [each.half_width / NORMAL for each in model.uncertain])
        if any(each.pixel for each in model.films):  # without the noise of what was seen, which a pixel does not change
            between = 0.0 if seen.centres is None else self.place.here["beta"]
            whole = between + np.interp(seen.times, self.times, self.shown)
            columns.append(-whole[:, None] * seen.pixel / NORMAL)
        if any(each.centres is not None for each in model.films):
            shape = SHAPE * self.place.here["beta"] if seen.centres is not None else 0.0
            columns.append(np.full((frames, 1), shape / NORMAL))
        errors = self._columns[DU_ERROR] * model.errors
        if any(model.difference):
            off = OF_DERIVATIVE * self.difference * self._columns[BY_DIFFERENCE]
            errors = np.concatenate([errors, off * model.errors])
        return [*columns, self.shifts(errors / NORMAL)]

    def left_of_start(self) -> Array:
        """Start-up transients that the film may still contain: exponentials with the rates of `MODES`, (frames, rates).

        Each is one standard deviation; the slowest decays with the decay time at the first distance.
        """
        slowest = self.place.curve.interpolated(self._columns[T_RELAX], self.start)
        return np.asarray(START * np.exp(-np.outer(self.seen.times / max(slowest, SHORTEST), MODES)))

    def _velocity_change(self, one: Uncertain) -> Array:
        """Derivative of dU by the logarithm of a quantity, at a fixed physical distance, (distances,)."""
        table, powers = self._columns, one.powers
        along = table[DISTANCE] * table[SLOPE] * powers.get("length", 0.0)
        change = table[DU] * powers.get("velocity", 0.0) - along
        numbers = ((name, powers[name]) for name in PARAMETERS if powers.get(name))
        here = self.place.here
        return np.asarray(change + sum(here[name] * power * table[SENSITIVITIES[name]] for name, power in numbers))


def _integral(values: Array, times: Array) -> Array:
    """The integral over time from the first one on, along the last axis."""
    return np.asarray(scipy.integrate.cumulative_trapezoid(values, times, initial=0))
