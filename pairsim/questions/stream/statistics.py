"""Statistics of streams on their way along the tube."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from pairsim.analysis.drops import KINDS, shares
from pairsim.runtime.arrays import Array
from pairsim.solvers.rows.stream_motion import Stream

SURE = 2.0  # standard errors in a half-width, for a 95 % interval
SHOWN = 30  # largest number of beads whose positions are kept, those in the middle of the stream; chosen


@dataclass(frozen=True)
class Way:
    """What is kept of one stream on its way, at each of several lengths of tube.

    Attributes:
        position: How far its beads have moved on average [D_c], shape (lengths,).
        time: Time [D_c/U_av], shape (lengths,).
        velocity: Mean velocity [U_av], shape (lengths,).
        mean: Mean distance between facing surfaces [D_c], shape (lengths,).
        counted: The statistics: standard deviation of the distances over their mean, fraction of beads in contact, and
            fractions of drops by their number of beads (nan without drops), shape (lengths, 2 + KINDS).
        middle: Positions of beads in the middle of the stream [D_c], shape (lengths, at most SHOWN).
        histograms: Fractions of the distances in bins, shape (lengths, bins).
        spacing: Mean distance between the centres of neighbours at the inlet [D_c].
    """

    position: Array
    time: Array
    velocity: Array
    mean: Array
    counted: Array
    middle: Array
    histograms: Array
    spacing: float

    @classmethod
    def of(cls, on_the_way: Iterable[Stream], lengths: Array, drop: float | None, edges: Array) -> Way:
        """The way of a stream.

        Args:
            on_the_way: The stream at each length of tube.
            lengths: Lengths of its beads [D_c], shape (N,).
            drop: Length of tube whose liquid a drop takes [D_c]; None if drops are not counted.
            edges: Edges of the bins, the last of which includes all larger distances [D_c], shape (bins + 1,).
        """
        found: dict[str, list[float | Array]] = {
            name: [] for name in ("position", "time", "velocity", "mean", "counted", "middle", "histograms")
        }
        begin = max((len(lengths) - SHOWN) // 2, 0)
        places = np.zeros(len(lengths))
        spacing = 0.0
        for stream in on_the_way:
            places = places_of(stream.gaps, lengths)
            spacing = spacing or float(places[-1]) / (len(places) - 1)
            middle = places[begin : begin + SHOWN] - places[begin] + stream.way[begin]
            histogram = np.histogram(np.minimum(stream.gaps, edges[-1]), edges)[0] / len(stream.gaps)
            now = stream.way.mean(), stream.time, stream.velocities.mean(), stream.gaps.mean()
            values = *now, _counted(stream, places, drop), middle, histogram
            for each, value in zip(found.values(), values, strict=True):
                each.append(value)
        return cls(**{name: np.array(each) for name, each in found.items()}, spacing=spacing)


def _counted(stream: Stream, places: Array, drop: float | None) -> Array:
    """`Way.counted` at one length of tube."""
    touching = np.concatenate([[False], stream.touching, [False]])
    in_contact = touching[1:] | touching[:-1]
    # While the liquid of a drop passes at U_av, the beads on U/U_av times its length of tube pass, as they move at U.
    drops = np.full(KINDS, np.nan) if drop is None else shares(places, drop * float(stream.velocities.mean()))
    return np.array([stream.gaps.std() / stream.gaps.mean(), in_contact.mean(), *drops])


def places_of(gaps: Array, lengths: Array) -> Array:
    """Positions of the centres along the tube relative to the first bead [D_c], shape (N,)."""
    return np.cumsum(np.append(0.0, gaps + (lengths[1:] + lengths[:-1]) / 2))


def half_widths(ways: Iterable[Way]) -> Array:
    """Half-widths of the means of the statistics, from the differences of streams, shape (lengths, 2 + KINDS)."""
    each = np.array([way.counted for way in ways])
    return np.asarray(SURE * each.std(axis=0, ddof=1) / np.sqrt(len(each)))


def mean_of(ways: Iterable[Way]) -> Array:
    """Means of the statistics over streams, shape (lengths, 2 + KINDS)."""
    return np.asarray(np.mean([way.counted for way in ways], axis=0))
