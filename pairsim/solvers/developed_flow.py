"""The flow without particles at every Deborah number of a branch."""

from __future__ import annotations

import numpy as np

from pairsim.physics.materials.polymer import Law
from pairsim.physics.pipe import Pipe, PipeState
from pairsim.runtime.fenicsx import MPI

# Relative change of De over which a flow is taken from the one known.
ALL_BUT_THE_SAME = 0.01


class DevelopedFlows:
    """Finds each developed flow once.

    Args:
        comm: Communicator of the case.
        law: Constitutive law, None for a Newtonian liquid.
    """

    def __init__(self, comm: MPI.Comm, law: Law | None) -> None:
        self._comm, self._law = comm, law
        self._known: dict[float, PipeState] = {}

    def at(self, De: float) -> PipeState:
        """The flow at a Deborah number.

        Raises:
            NoSteadyState: It was not found.
        """
        if De not in self._known:
            nearest = min(self._known, key=lambda other: abs(other - De), default=np.inf)
            near = self._known[nearest] if abs(nearest - De) <= ALL_BUT_THE_SAME * De else None
            pipe = Pipe(self._law.at(De) if self._law else None)
            self._known[De] = self._comm.bcast(pipe.steady(near))
        return self._known[De]

    def learn(self, other: DevelopedFlows) -> None:
        """Take over the flows of another scene in the same liquid."""
        self._known |= other._known
