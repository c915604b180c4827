"""What an accepted time step of a run gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pairsim.fem.diagnostics import Observation
from pairsim.fem.scene import Scene
from pairsim.quantities.kinds import TIME
from pairsim.runtime.arrays import Array
from pairsim.runtime.message import Message, Text
from pairsim.solvers.nonlinear.convergence import Report


def at_step(t: float, step: int) -> Text:
    """Time [D_c/U_av] and number of a step in words, for failures; "" at the start of a run."""
    return Message("t = {} (step {})", TIME(t, "g"), step) if t or step else ""


@dataclass(frozen=True)
class Step:
    """An accepted time step.

    Attributes:
        t: Time at the end of the step [D_c/U_av].
        dt: Size of the step [D_c/U_av].
        error: Local error in units of the tolerance, 0 if unknown.
        report: Report of Newton's method.
        observation: Quantities evaluated from the discrete solution.
        distortion: Smallest ratio of a liquid cell's current to its reference Jacobian.
        scene: Scene on the mesh of this step.
        mesh_id: Number of remeshings before the step.
        x: Full vector, shape (n,).
        h: Positions of the material, shape (n_h,).
        velocity: Velocity of the material [U_av], shape (n_h,).
        z: Positions of the centres of volume along the tube, from where the first one started [D_c], shape (N,).
        U_correction: Estimated exact minus discrete velocities [U_av], shape (N,), NaN from where the estimate
            diverged; None if they are not estimated.
        dU_error: Half-widths of the intervals around dU [U_av], shape (N-1,), NaN and None as above.
    """

    t: float
    dt: float
    error: float
    report: Report
    observation: Observation
    distortion: float
    scene: Scene
    mesh_id: int
    x: Array
    h: Array
    velocity: Array
    z: Array
    U_correction: Array | None
    dU_error: Array | None

    @property
    def U(self) -> Array:
        """Velocities of the particles, with the estimate of their error where it is known [U_av], shape (N,)."""
        U = self.observation.U
        return U if self.U_correction is None else U + np.nan_to_num(self.U_correction)

    @property
    def dU(self) -> Array:
        """Velocity of each particle relative to its upstream neighbour, from `U` [U_av], shape (N-1,)."""
        return np.diff(self.U)

    @property
    def dU_discrete(self) -> Array:
        """The same of the discrete solution [U_av], shape (N-1,)."""
        return self.observation.dU

    @property
    def dU_correction(self) -> Array | None:
        """Estimated exact minus discrete dU [U_av], shape (N-1,); None if it is not estimated."""
        return None if self.U_correction is None else np.diff(self.U_correction)
