"""Developed flow without particles at the Deborah numbers of a branch."""

from __future__ import annotations

import numpy as np

from pairsim.physics.materials.polymer import Law
from pairsim.physics.pipe import Pipe, PipeState
from pairsim.runtime.fenicsx import MPI

# Relative difference of De up to which a known flow is the first guess for another one; chosen.
ALL_BUT_THE_SAME = 0.01


class DevelopedFlows:
    """Cache of developed flows by Deborah number.

    Args:
        comm: Communicator of the case.
        law: Constitutive law, None for a Newtonian liquid.
        flow: Mean velocity [U_av].
    """

    def __init__(self, comm: MPI.Comm, law: Law | None, flow: float = 1.0) -> None:
        self._comm, self._law, self._flow = comm, law, flow
        self._known: dict[float, PipeState] = {}

    def at(self, De: float) -> PipeState:
        """Developed flow at a Deborah number; collective.

        Raises:
            NoSteadyState: No developed flow was found.
        """
        if De not in self._known:
            nearest = min(self._known, key=lambda other: abs(other - De), default=np.inf)
            near = self._known[nearest] if abs(nearest - De) <= ALL_BUT_THE_SAME * De else None
            pipe = Pipe(self._law.at(De) if self._law else None, self._flow)
            self._known[De] = self._comm.bcast(pipe.steady(near))
        return self._known[De]

    def learn(self, other: DevelopedFlows) -> None:
        """Copy the flows computed by another scene in the same liquid."""
        self._known |= other._known
