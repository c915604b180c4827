"""How far uncertain inputs change dU of an atlas, by Monte Carlo: dU for each of many draws of the inputs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from pairsim.analysis.input_ranges import COVERED, MANY, DrawnRange
from pairsim.atlas.atlas import PARAMETERS, Atlas
from pairsim.atlas.unequal import Beads, UnequalAtlas
from pairsim.cases.case import SceneCase
from pairsim.cases.differences import differ
from pairsim.cases.inputs import drawn, inputs_of
from pairsim.quantities.kinds import LENGTH, VELOCITY
from pairsim.runtime.arrays import Array, Flags
from pairsim.solvers.curves.interpolant import hermite, slopes_of

BETWEEN = 4  # distances in each interval of the atlas, across which dU of distant pairs falls by factors; chosen
DRAWS = 2000  # number of draws: the fraction of them inside a range has a standard error of 0.5 %
KNOWN = {*PARAMETERS, "length", "velocity"}
"""The numbers and scales whose changes from draw to draw enter dU of every atlas."""


def range_of_draws(case: SceneCase, atlas: Atlas) -> DrawnRange:
    """The range that holds dU for the fraction `COVERED` of all draws of the inputs, at fixed physical distances.

    For a draw outside of the atlas dU is not known. Such draws count as outside of the range, so that it holds this
    fraction whatever their dU is; if they are too many for that, it is the range of the draws inside of the atlas.
    """
    scales, numbers = drawn(case, DRAWS)
    assert case.scales is not None
    draws = _Draws.of(case, numbers, atlas)
    inside = draws.inside
    shift = np.broadcast_to(np.log(LENGTH.factor(case.scales) / LENGTH.factor(scales)), DRAWS)
    velocity = np.broadcast_to(VELOCITY.factor(scales), DRAWS)
    x = np.log(atlas.d)
    d = np.geomspace(float(atlas.d[0]), float(atlas.d[-1]), BETWEEN * (len(x) - 1) + 1)
    d[[0, -1]] = atlas.d[[0, -1]]
    values = np.full((DRAWS, len(d)), np.nan)
    dU, known = draws.dU, KNOWN | draws.known
    for i, curve in zip(np.flatnonzero(inside), dU, strict=True):
        at = np.log(d) + shift[i]
        here = (at >= x[0]) & (at <= x[-1])
        values[i, here] = velocity[i] * hermite(x, curve, slopes_of(curve, x))(at[here])
    least, largest = np.array([_ends(column) for column in values.T]).T
    uncertain = [each for each in inputs_of(case) if each.half_width]
    missing = {
        name: None for each in uncertain for name, change in each.changes.items() if change and name not in known
    }
    outside = np.isnan(values).mean(axis=0)
    return DrawnRange(d, least, largest, outside, " or ".join(draws.beyond), ", ".join(missing))


def _ends(values: Array) -> tuple[float, float]:
    """The ends of the range of values, shape (draws,), of which nan count as outside; 0 and 0 if all are nan."""
    known = values[np.isfinite(values)]
    if not len(known):
        return 0.0, 0.0
    outside = 1 - len(known) / len(values)
    tail = (1 - COVERED - outside) / 2 / (1 - outside) if outside < 1 - COVERED else (1 - COVERED) / 2
    least, largest = np.quantile(known, [tail, 1 - tail])
    return float(least), float(largest)


@dataclass(frozen=True)
class _Draws:
    """The draws of the inputs as pairs of an atlas.

    Attributes:
        inside: Whether each is inside of the box and the ratios of the atlas, shape (draws,).
        dU: dU of those inside, shape (inside, distances) [U_av].
        known: Numbers, beside `KNOWN`, whose changes from draw to draw enter dU.
        beyond: The ends of the box beyond which many draws of beta, De and Ca_e are, in words.
    """

    inside: Flags
    dU: Array
    known: set[str]
    beyond: Sequence[str]

    @classmethod
    def of(cls, case: SceneCase, numbers: Mapping[str, Array], atlas: Atlas) -> Self:
        """The pairs of a case with draws of the numbers that differ from draw to draw, see `cases.inputs.drawn`."""
        given = {"beta": case.betas, "De": (case.De,), "Ca_e": case.Ca_es}
        each = {name: _of_draws(numbers.get(name), own) for name, own in given.items()}
        if differ(case) and (unequal := atlas.of_unequal) is not None:
            return cls._unequal(Beads(each["beta"], each["De"][:, 0], each["Ca_e"]), numbers, unequal)
        places = np.stack([values[:, 0] for values in each.values()], axis=1)
        inside = np.array([not atlas.outside(**dict(zip(PARAMETERS, one, strict=True))) for one in places])
        dU, known = atlas.velocities(places[inside])[0], set[str]()
        if "difference" in numbers and (by_difference := atlas.changes_by_difference(places[inside])) is not None:
            dU = dU + numbers["difference"][inside, None] * by_difference
            known.add("difference")
        return cls(inside, dU, known, [*_beyond(places, atlas)])

    @classmethod
    def _unequal(cls, beads: Beads, numbers: Mapping[str, Array], unequal: UnequalAtlas) -> Self:
        if "difference" in numbers:
            half = numbers["difference"][:, None] / 2 * np.array([-1.0, 1.0])
            beads = beads._replace(betas=beads.betas.mean(axis=1, keepdims=True) * (1 + half))
        inside = np.array([not unequal.outside(*pair) for pair in zip(*(each.tolist() for each in beads), strict=True)])
        dU = unequal.velocities(beads.those(inside))[0]
        both = np.concatenate([beads.alone(0), beads.alone(1)])
        return cls(inside, dU, {"difference"}, list(dict.fromkeys(_beyond(both, unequal.equal))))


def _of_draws(values: Array | None, own: Sequence[float]) -> Array:
    """A number in all draws, drawn or that of the case, shape (DRAWS, particles), or (DRAWS, 1) if they share it."""
    found = np.asarray(own, dtype=float)[:, None] if values is None else np.atleast_2d(values)
    return np.broadcast_to(found, (max(len(own), len(found)), DRAWS)).T


def _beyond(places: Array, atlas: Atlas) -> Iterator[str]:
    """The ends of the box beyond which many draws of beta, De and Ca_e, shape (draws, 3), are, in words."""
    for name, values in zip(PARAMETERS, places.T, strict=True):
        low, high = atlas.box[name]
        for part, words in (((values < low).mean(), f"below {low:g}"), ((values > high).mean(), f"above {high:g}")):
            if part >= MANY:
                yield f"{name} {words}"
