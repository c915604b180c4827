"""Flow without particles at a flow rate that varies in time: a `Pipe`, integrated from kink to kink of a waveform."""

from __future__ import annotations

from bisect import bisect_left

import numpy as np
import scipy

from pairsim.physics.liquids import Liquid
from pairsim.physics.pipe import LARGEST_ERRORS, OUT_OF_REACH, Pipe, PipeState
from pairsim.physics.waveform import Waveform
from pairsim.quantities.kinds import TIME
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import NoSteadyState
from pairsim.runtime.message import Message

FIRST_STEP = 1e-5  # of the integration in a piece, in cycles; chosen


class PulsatingPipe(Pipe):
    """Tube flow at a flow rate that varies in time. A call with a time integrates the flow up to this time.

    Args:
        liquid: The liquid.
        waveform: The mean velocity [U_av] over time [D_c/U_av].
        start: The flow whose stresses are the initial ones; None: an unstressed liquid.
    """

    def __init__(self, liquid: Liquid, waveform: Waveform, start: PipeState | None = None) -> None:
        super().__init__(liquid, waveform.at(0.0))
        self._waveform = waveform
        self._piece = 0.0, waveform.next_kink(0.0)  # the piece between kinks that is being integrated
        self._times, self._parts = [0.0], list[scipy.integrate.DenseOutput]()
        self._first = self._start if start is None else start.state.ravel()
        self._solver = self._begin(self._first) if liquid.has_memory else None
        self._last_state: tuple[float, PipeState] | None = None

    def __call__(self, t: float) -> PipeState:
        """The flow at a time [D_c/U_av]; at a jump, the flow before the jump.

        Raises:
            NoSteadyState: The time integration failed.
        """
        if self._last_state is None or self._last_state[0] != t:
            values = self._values(t) if self.liquid.has_memory else np.empty(0)
            self._flow = self._waveform.at(t)
            self._last_state = t, self._state(values.reshape(-1, len(self.r)))
        return self._last_state[1]

    def _values(self, t: float) -> Array:
        """Conformations and scalars at a time, shape (k n,)."""
        while self._times[-1] < t:
            self._advance()
        if not self._parts or t <= 0.0:
            return np.asarray(self._first)
        return np.asarray(self._parts[bisect_left(self._times, t) - 1](t))

    def _begin(self, c: Array) -> scipy.integrate.LSODA:
        """An integration of the present piece from the values c at its start."""
        begin, end = self._piece
        end = min(end, begin + OUT_OF_REACH)
        # At rest, where nothing changes yet, LSODA would choose a first step as long as the piece.
        first = min(FIRST_STEP * self._waveform.cycle, end - begin)
        return scipy.integrate.LSODA(self._rate, begin, c, end, first_step=first, **LARGEST_ERRORS, jac=self._jacobian)

    def _advance(self) -> None:
        """Take a step, which ends at a kink at the latest."""
        assert self._solver is not None, "a liquid without a memory has no stress that is integrated"
        if self._solver.status == "finished":
            self._piece = self._piece[1], self._waveform.next_kink(self._piece[1])
            self._solver = self._begin(self._solver.y)
        message = self._solver.step()
        if self._solver.status == "failed":
            what, De = "the flow without particles at De = {} was lost at t = {}: {}", f"{self.liquid.De:g}"
            lost = Message(what, De, TIME(self._solver.t, "g"), message or "")
            raise NoSteadyState(lost, advice="another De or xi")
        self._times.append(self._solver.t)
        self._parts.append(self._solver.dense_output())

    def _flow_in_piece(self, t: float) -> float:
        """Mean velocity at a time of the present piece; if it jumps at an end of the piece, its value inside."""
        begin, end = self._piece
        return self._waveform.after(begin) if t <= begin else self._waveform.at(min(t, end))

    def _rate(self, t: float, flat: Array) -> Array:
        self._flow = self._flow_in_piece(t)
        return super()._rate(t, flat)

    def _jacobian(self, t: float, flat: Array) -> Array:
        self._flow = self._flow_in_piece(t)
        return super()._jacobian(t, flat)
