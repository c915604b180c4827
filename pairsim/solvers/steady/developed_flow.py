"""Developed flow without particles of the liquids of a branch."""

from __future__ import annotations

import numpy as np

from pairsim.physics.liquids import Liquid
from pairsim.physics.material import apart
from pairsim.physics.pipe import Pipe, PipeState

# Largest relative difference of the parameters of two liquids at which the flow of one is the first guess for the
# other; chosen.
ALL_BUT_THE_SAME = 0.01


class DevelopedFlows:
    """Cache of developed flows by liquid; all have the same laws.

    Args:
        flow: Mean velocity [U_av].
    """

    def __init__(self, flow: float = 1.0) -> None:
        self._flow = flow
        self._known: dict[Liquid, PipeState] = {}

    def at(self, liquid: Liquid) -> PipeState:
        """Developed flow of a liquid.

        Raises:
            NoSteadyState: No developed flow was found.
        """
        if liquid not in self._known:
            distances = {other: apart(other.numbers, liquid.numbers) for other in self._known}
            nearest = min(distances, key=lambda other: distances[other], default=liquid)
            near = self._known[nearest] if distances.get(nearest, np.inf) <= ALL_BUT_THE_SAME else None
            self._known[liquid] = Pipe(liquid, self._flow).steady(near)
        return self._known[liquid]

    def learn(self, other: DevelopedFlows) -> None:
        """Copy the flows that another scene with the same laws has computed."""
        self._known |= other._known
