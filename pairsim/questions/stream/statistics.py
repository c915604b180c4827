"""What is counted of streams at a length of tube."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from pairsim.analysis.drops import KINDS, shares
from pairsim.runtime.arrays import Array
from pairsim.solvers.rows.stream_motion import Stream

SURE = 2.0  # standard errors in a half-width: that of an interval of 95 %


@dataclass(frozen=True)
class Statistics:
    """Numbers of streams at a length of tube.

    Attributes:
        each: Of every stream the spread of the distances, the share of beads in contact, and the shares of drops by
            their number of beads (nan without drops), shape (streams, 2 + KINDS).
    """

    each: Array

    @classmethod
    def of(cls, stream: Stream, lengths: Array, drop: float | None) -> Self:
        """Those of streams.

        Args:
            stream: The streams.
            lengths: Lengths of the beads [D_c], shape (streams, N).
            drop: Length of tube whose liquid a drop takes [D_c]; None if drops are not counted.
        """
        touching = stream.touching
        none = np.zeros((len(touching), 1), dtype=bool)
        in_contact = np.hstack([touching, none]) | np.hstack([none, touching])
        spread = stream.gaps.std(axis=1) / stream.gaps.mean(axis=1)
        counted = np.full((len(touching), KINDS), np.nan)
        if drop is not None:
            # While the liquid of a drop passes at U_av, beads pass that are U/U_av times as far apart.
            rows = zip(places_of(stream.gaps, lengths), stream.velocities.mean(axis=1), strict=True)
            counted = np.array([shares(places, drop * U) for places, U in rows])
        return cls(np.column_stack([spread, in_contact.mean(axis=1), counted]))

    @property
    def means(self) -> Array:
        """Means over the streams, shape (2 + KINDS,)."""
        return np.asarray(self.each.mean(axis=0))

    @property
    def half_widths(self) -> Array:
        """Half-widths of the intervals of the means, by how much streams differ, of the same shape."""
        return np.asarray(SURE * self.each.std(axis=0, ddof=1) / np.sqrt(len(self.each)))


def places_of(gaps: Array, lengths: Array) -> Array:
    """Positions of the centres along the tube beside that of the first bead [D_c], shape (streams, N)."""
    apart = gaps + (lengths[:, 1:] + lengths[:, :-1]) / 2
    return np.asarray(np.cumsum(np.pad(apart, ((0, 0), (1, 0))), axis=1))
