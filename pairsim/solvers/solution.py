"""A discrete solution as functionals see it: quasi-steady, or at the end of a time step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pairsim.fem.algebra.constraints import Constraints
    from pairsim.fem.scene import Scene
    from pairsim.runtime.arrays import Array


@dataclass(frozen=True)
class Solution:
    """A discrete solution.

    Attributes:
        scene: The scene.
        constraints: Its constraints.
        y: Free unknowns, shape (n_y,).
        h: Positions of the material, shape (n_h,).
        x: Full vector, shape (n,).
        g: Derivative of the positions of soft particles' material with respect to their unknowns: gamma dt in a time
            step, whose unknowns are velocities; 1 in a quasi-steady solution, whose unknowns are displacements.
        free: Length of tube on each side of the particles [D_c].
        gradient: Pressure drop per length of the flow without particles [eta_0 U_av/D_c^2].
    """

    scene: Scene
    constraints: Constraints
    y: Array
    h: Array
    x: Array
    g: float
    free: float
    gradient: float
