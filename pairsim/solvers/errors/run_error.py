"""The error to quote with dU in a run, from the estimates at its accepted steps."""

from __future__ import annotations

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.resolution import OF_RUNS, widening
from pairsim.solvers.errors.time_error import SET_IN
from pairsim.solvers.stepping.step_size import extrapolation_weights

KNOWN = 3  # accepted values from which dU is extrapolated over a remeshing


class RunError:
    """Half-width of the interval around dU that should hold the exact one, with four terms.

    1. |dU_correction| plus the largest one so far: the estimate has an error of its own, which does not vanish where
       the estimate changes its sign. Both count more where cells do not resolve the stress.
    2. The error by the time steps.
    3. What remeshings have left, which no residual sees, as the stress is interpolated to another mesh. The exact dU is
       continuous in time, and so is dU + dU_correction but for errors, since it depends little on the mesh: what this
       sum jumps by, against a parabola through its last values, counts as an error.

    4. The error of the quasi-steady state that the run started from, which the estimates do not contain: they are
       carried forward from zero at t = 0, and those before SET_IN, in which soft shapes take up the stress that is
       missing, do not count as the largest one.

    The largest estimate, the jumps and the error of the start are forgotten in a time of 1 + De, as liquid passes by
    and relaxes (chosen).

    Args:
        De: Deborah number, 0 for a Newtonian liquid.

    Attributes:
        start: Half-width of the error of dU in the state that the run started from [U_av], shape (N-1,); 0 at rest.
    """

    def __init__(self, De: float) -> None:
        self.start: Array | float = 0.0
        self._memory, self._mesh = 1.0 + De, 0
        self._times: list[float] = []
        self._values: list[Array] = []
        self._largest: Array | float = 0.0
        self._jumps: Array | float = 0.0

    def add(self, t: float, mesh: int, dU: Array, correction: Array, steps: float, s_jump: float = 0.0) -> Array:
        """The half-width after an accepted step [U_av], shape (N-1,).

        Args:
            t: Time [D_c/U_av].
            mesh: Number of remeshings before the step.
            dU: Relative velocities [U_av], shape (N-1,).
            correction: Estimates of exact minus discrete dU [U_av], shape (N-1,).
            steps: Error of dU by the time steps so far [U_av].
            s_jump: Largest change of log c within a cell; 0 in a Newtonian liquid.
        """
        corrected = dU + correction
        if self._times:
            left = np.exp(-(t - self._times[0]) / self._memory)
            self._largest, self._jumps = self._largest * left, self._jumps * left
            if mesh != self._mesh:
                weights = extrapolation_weights(self._times, t)
                expected = sum(w * value for w, value in zip(weights, self._values, strict=True))
                self._jumps = self._jumps + np.abs(corrected - expected)
        self._mesh = mesh
        if t > SET_IN or not np.any(self.start):
            self._largest = np.maximum(self._largest, np.abs(correction))
        self._times, self._values = [t, *self._times[: KNOWN - 1]], [corrected, *self._values[: KNOWN - 1]]
        start = self.start * np.exp(-t / self._memory)
        cells = widening(s_jump, OF_RUNS) * (np.abs(correction) + self._largest)
        return np.asarray(cells + steps + self._jumps + start)
