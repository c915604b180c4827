"""An accepted time step of a run with its results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pairsim.fem.diagnostics import Observation
from pairsim.fem.scene import Scene
from pairsim.quantities.kinds import TIME
from pairsim.runtime.arrays import Array
from pairsim.runtime.message import Message, Text
from pairsim.solvers.goals import Goal, U
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
        observation: Quantities evaluated from the discrete solution, without estimates of their errors.
        distortion: Smallest ratio of a liquid cell's current to its reference Jacobian.
        scene: Scene on the mesh of this step.
        mesh_id: Number of remeshings before the step.
        x: Full vector, shape (n,).
        h: Positions of the material, shape (n_h,).
        velocity: Velocity of the material [U_av], shape (n_h,).
        z: Axial positions of the centres of volume, from the initial position of the first one [D_c], shape (N,).
        corrections: Estimated exact minus discrete values of goals, (k,) each, NaN from where the estimate diverged;
            empty if they are not estimated.
        half_widths: Half-widths of the intervals around goals, (k,) each, NaN as above; empty if they are not known.
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
    corrections: Mapping[Goal, Array]
    half_widths: Mapping[Goal, Array]

    @property
    def U(self) -> Array:
        """Velocities of the particles, with the estimate of their error where it is known [U_av], shape (N,)."""
        discrete = self.observation.U
        return discrete + np.nan_to_num(self.corrections[U]) if self.corrections else discrete

    @property
    def dU(self) -> Array:
        """Velocity of each particle relative to its upstream neighbour, from `U` [U_av], shape (N-1,)."""
        return np.diff(self.U)

    @property
    def dU_discrete(self) -> Array:
        """Relative velocities of the discrete solution, without an estimate of its error [U_av], shape (N-1,)."""
        return self.observation.dU
