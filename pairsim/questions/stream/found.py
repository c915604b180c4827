"""Streams that have moved."""

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
    """What was found of streams.

    Attributes:
        ways: Each of the streams.
        by_model: Half-widths of what is counted by the model of rows, shape (lengths, statistics).
        edges: Those of the bins of histograms [D_c].
    """

    ways: Sequence[Way]
    by_model: Array
    edges: Array

    @cached_property
    def means(self) -> Array:
        """Means of what is counted, shape (lengths, statistics)."""
        return mean_of(self.ways)

    @cached_property
    def half_widths(self) -> Array:
        """Half-widths of these by how much streams differ, of the same shape."""
        return half_widths(self.ways)

    @property
    def spacing(self) -> float:
        """First distance between the centres of neighbours, on average [D_c]."""
        return float(np.mean([way.spacing for way in self.ways]))

    @property
    def velocity(self) -> float:
        """Mean velocity at first [U_av]."""
        return float(np.mean([way.velocity[0] for way in self.ways]))

    def per_drop(self, case: StreamCase) -> float | None:
        """Beads of a drop on average; None if drops are not counted."""
        return None if case.stream.drop is None else case.stream.drop * self.velocity / self.spacing
