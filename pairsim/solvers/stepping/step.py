"""What an accepted time step of a run gives."""

from __future__ import annotations

from dataclasses import dataclass

from pairsim.fem.diagnostics import Observation
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Array
from pairsim.solvers.nonlinear.convergence import Report


@dataclass(frozen=True)
class Step:
    """An accepted time step.

    Attributes:
        t: Time at the end of the step [D_c/U_av].
        dt: Size of the step [D_c/U_av].
        error: Local error in units of the tolerance, 0 if unknown.
        report: Report of Newton's method.
        observation: Quantities evaluated from the solution.
        distortion: Smallest ratio of a liquid cell's current to its reference Jacobian.
        scene: Scene on the mesh of this step.
        mesh_id: Number of remeshings before the step.
        x: Full vector, shape (n,).
        h: Positions of the material, shape (n_h,).
        velocity: Velocity of the material [U_av], shape (n_h,).
        U_correction: Estimated exact minus discrete velocities [U_av], shape (N,); None if they are not estimated.
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
    U_correction: Array | None
