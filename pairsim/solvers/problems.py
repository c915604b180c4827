"""What the solvers are given of a case: in time, quasi-steady, and what both have in common."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pairsim.fem.geometry import MeshSettings
from pairsim.fem.scene import BoundaryVelocity, poiseuille
from pairsim.physics.materials.polymer import Law, Polymer
from pairsim.runtime.arrays import Array
from pairsim.solvers.newton_options import STEADY, TRANSIENT, NewtonOptions
from pairsim.solvers.step_size import StepControl

# Distances that meshes are made for, in a decade: the mesh of a place depends on the place alone, not on the way to it.
PER_DECADE = 5


class SceneProblem(Protocol):
    """What the problems in time and the quasi-steady ones have in common."""

    @property
    def betas(self) -> tuple[float, ...]: ...
    @property
    def length(self) -> float: ...
    @property
    def periodic(self) -> bool: ...
    @property
    def mesh(self) -> MeshSettings: ...
    @property
    def boundary_velocity(self) -> BoundaryVelocity: ...
    @property
    def newton(self) -> NewtonOptions: ...


@dataclass(frozen=True)
class Problem:
    """What a transient needs to know of a case.

    Attributes:
        betas, Ca_es, gaps, length: The scene.
        periodic: Kind of the ends.
        mesh: Cell sizes.
        control: Step control.
        first_step: Size of the first step.
        boundary_velocity: Velocity on wall and ends when they are not periodic.
        U_m: First guess of the particles' velocity.
        start: Starting positions of the material, from the undeformed ones (None: undeformed).
        newton: Options of Newton's method.
        extrapolated: Earlier solutions, four at most, that the first guess of a step extrapolates.
        polymer: Viscoelastic part of the liquid.
        t_end: Time up to which the flow without particles is needed.
    """

    betas: tuple[float, ...]
    Ca_es: tuple[float, ...]
    gaps: tuple[float, ...]
    length: float
    periodic: bool
    mesh: MeshSettings
    control: StepControl
    first_step: float
    boundary_velocity: BoundaryVelocity = poiseuille
    U_m: float = 2.0
    start: Callable[[Array], Array] | None = None
    newton: NewtonOptions = TRANSIENT
    extrapolated: int = 4
    polymer: Polymer | None = None
    t_end: float = 1000.0


@dataclass(frozen=True)
class SteadyProblem:
    """What does not change along a branch.

    Attributes:
        betas: Diameters.
        length: Length of the tube.
        periodic: Kind of the ends.
        mesh: Cell sizes.
        law: Constitutive law of a viscoelastic liquid, None for a Newtonian one; `Parameters` have the De.
        boundary_velocity: Velocity on wall and ends when they are not periodic.
        newton: Options of Newton's method.
        narrowest: Distance that the arcs of the outlines are cut for, where it is below the first one.
    """

    betas: tuple[float, ...]
    length: float
    periodic: bool
    mesh: MeshSettings
    law: Law | None = None
    boundary_velocity: BoundaryVelocity = poiseuille
    newton: NewtonOptions = STEADY
    narrowest: float = np.inf

    def nominal(self, gaps: tuple[float, ...]) -> tuple[float, ...]:
        """The distances that a mesh around spheres is made for, near the given ones."""
        rounded = tuple(float(10 ** (round(np.log10(d) * PER_DECADE) / PER_DECADE)) for d in gaps)
        free = self.length - sum(self.betas) - sum(gaps)
        return rounded if sum(rounded) - sum(gaps) < free / 4 else gaps
