"""Where a quasi-steady scene is in the space of its parameters, and what does not change along its branch."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pairsim.fem.geometry import MeshSettings
from pairsim.fem.scene import BoundaryVelocity, poiseuille
from pairsim.physics.materials.polymer import Polymer
from pairsim.solvers.newton_options import STEADY, NewtonOptions

# Distances that meshes are made for, in a decade: the mesh of a place depends on the place alone, not on the way to it.
PER_DECADE = 5


@dataclass(frozen=True)
class Parameters:
    """Where a scene is in the space of its parameters.

    Attributes:
        gaps: Distances between facing surfaces on the axis, (N-1,).
        Ca_es: Elastic capillary numbers, 0 for rigid particles, (N,).
        De: Deborah number; 0 without polymer.
        size: Factor of all particle diameters; differs from 1 only for derivatives with respect to beta.
    """

    gaps: tuple[float, ...]
    Ca_es: tuple[float, ...]
    De: float = 0.0
    size: float = 1.0

    def with_gap(self, d: float) -> Parameters:
        """All gaps equal to d."""
        return replace(self, gaps=(d,) * len(self.gaps))


@dataclass(frozen=True)
class SteadyProblem:
    """What does not change along a branch.

    Attributes:
        betas: Diameters.
        length: Length of the tube.
        periodic: Kind of the ends.
        mesh: Cell sizes.
        polymer: Viscoelastic part of the liquid; its De is that of `Parameters`.
        boundary_velocity: Velocity on wall and ends when they are not periodic.
        newton: Options of Newton's method.
        narrowest: Distance that the arcs of the outlines are cut for, where it is below the first one.
    """

    betas: tuple[float, ...]
    length: float
    periodic: bool
    mesh: MeshSettings
    polymer: Polymer | None = None
    boundary_velocity: BoundaryVelocity = poiseuille
    newton: NewtonOptions = STEADY
    narrowest: float = np.inf

    def nominal(self, gaps: tuple[float, ...]) -> tuple[float, ...]:
        """The distances that a mesh around spheres is made for, near the given ones."""
        rounded = tuple(float(10 ** (round(np.log10(d) * PER_DECADE) / PER_DECADE)) for d in gaps)
        free = self.length - sum(self.betas) - sum(gaps)
        return rounded if sum(rounded) - sum(gaps) < free / 4 else gaps
