"""The results of streams that have moved along the tube."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pairsim.questions.stream import StreamCase
from pairsim.questions.stream.statistics import Way, half_widths, mean_of
from pairsim.runtime.arrays import Array


@dataclass(frozen=True)
class Found:
    """The results of streams. "Statistics" are the numbers in `Way.counted`.

    Attributes:
        ways: The way of each stream.
        by_model: Half-widths of the statistics due to the model of rows, shape (lengths, statistics).
        edges: Edges of the bins of histograms [D_c], shape (bins + 1,).
    """

    ways: Sequence[Way]
    by_model: Array
    edges: Array

    @cached_property
    def means(self) -> Array:
        """Means of the statistics over streams, shape (lengths, statistics)."""
        return mean_of(self.ways)

    @cached_property
    def half_widths(self) -> Array:
        """Half-widths of these means due to the differences between streams, of the same shape."""
        return half_widths(self.ways)

    @property
    def spacing(self) -> float:
        """Mean distance between the centres of neighbours at the inlet [D_c]."""
        return float(np.mean([way.spacing for way in self.ways]))

    @property
    def velocity(self) -> float:
        """Mean velocity of the beads at the inlet [U_av]."""
        return float(np.mean([way.velocity[0] for way in self.ways]))

    def per_drop(self, case: StreamCase) -> float | None:
        """Mean number of beads in a drop; None if drops are not counted."""
        return None if case.stream.drop is None else case.stream.drop * self.velocity / self.spacing
