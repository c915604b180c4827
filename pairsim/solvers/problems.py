"""Definitions of time-dependent and quasi-steady problems, as the solvers receive them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, Self

import numpy as np

from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.drive import DEVELOPED, PER_PARTICLE, Drive, repeated
from pairsim.physics.liquids import NEWTONIAN, Liquid
from pairsim.physics.solids import Solid
from pairsim.runtime.arrays import Array
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.nonlinear.newton import STEADY, TRANSIENT, NewtonOptions
from pairsim.solvers.stepping.step_size import StepControl

# Number of distances per decade for which meshes are made. The mesh then depends on the distance alone, not on the
# order in which distances are solved. Chosen such that neighbouring meshes differ by less than GAP_RATIO.
PER_DECADE = 5
# Largest change of a distance by which cells around spheres follow it [D_c]. Of rigid pairs of beta 0.2 and 0.4 at
# distances of 1 to 9 the cells were distorted to 0.61 or less by up to this, below 0.52 by more, and inverted by 2.
MOST_MOVED = 0.6


@dataclass(frozen=True, kw_only=True)
class Setup:
    """What runs in time and quasi-steady problems have in common: what a scene and its meshes are made of.

    Attributes:
        betas: Diameters of the particles from upstream [D_c], N values.
        length: Length of the tube [D_c].
        periodic: Whether the ends are periodic; otherwise the velocity on them is prescribed.
        mesh: Cell sizes.
        newton: Options of Newton's method.
        drive: What drives the liquid and the particles.
        closed: Whether the tube is a period of an infinite row of equal particles.
        volume_modulus: Whether soft particles resist changes of volume within cells, as strongly compressed surfaces
            ask for; takes more iterations.
        monitor: Ends the computation; setups that differ in it alone are equal.
    """

    betas: tuple[float, ...] = field(metadata=PER_PARTICLE)
    length: float
    periodic: bool
    mesh: MeshSettings
    newton: NewtonOptions = STEADY
    drive: Drive = DEVELOPED
    closed: bool = False
    volume_modulus: bool = False
    monitor: Monitor = field(default_factory=Monitor, compare=False, repr=False)

    def of_kind[P: Setup](self, kind: type[P], **own: Any) -> P:
        """A problem of some kind in this setup; options of Newton's method, and what is given, are its own."""
        shared = {each.name: getattr(self, each.name) for each in fields(Setup) if each.name != "newton"}
        return kind(**{**shared, **own})

    def repeated(self, count: int) -> Self:
        """This set-up with its particles repeated `count` times; the length is left to the caller."""
        return replace(repeated(self, count), drive=repeated(self.drive, count))


@dataclass(frozen=True, kw_only=True)
class Problem(Setup):
    """A time-dependent problem, in which no force acts on the particles.

    Attributes:
        solids: What the particles are made of, None for rigid ones, N entries.
        gaps: Initial distances between facing surfaces [D_c], N-1 values.
        control: Control of the step size.
        first_step: Size of the first step [D_c/U_av].
        U_m: Velocity of the frame in the first step, at unit flow [U_av].
        start: Initial positions of the material as a function of the undeformed ones, (k, 2) -> (k, 2); None for
            undeformed particles.
        from_steady: Whether the run starts from the quasi-steady state of the first distances, in the developed flow;
            otherwise from rest.
        extrapolated: Number of earlier solutions, at most four, from which the first guess is extrapolated.
        liquid: The liquid.
        t_end: Time at which the run ends, up to which the flow without particles is computed [D_c/U_av].
        min_gap: Distance below which it ends before that [D_c].
        max_gap: Distance above which it does, too [D_c]; None for no limit.
        least_room: Length of tube on each side of the particles below which it does, too [D_c].
        dU_error: Whether the discretisation error of dU is estimated.
        held: Whether the distances are kept, as if forces of no effect on the flow held the particles apart.
        until_known: Part of the largest |dU| up to which the drift of the distances over a cycle of the flow is to be
            known; the run ends when it is. None: it does not end then.
    """

    newton: NewtonOptions = TRANSIENT
    solids: tuple[Solid | None, ...]
    gaps: tuple[float, ...]
    control: StepControl
    first_step: float
    U_m: float = 2.0
    start: Callable[[Array], Array] | None = None
    from_steady: bool = False
    extrapolated: int = 4
    liquid: Liquid = NEWTONIAN
    t_end: float = 1000.0
    min_gap: float = 0.0
    max_gap: float | None = None
    least_room: float = 0.0
    dU_error: bool = False
    held: bool = False
    until_known: float | None = None

    def room(self, gaps: Sequence[float]) -> float:
        """Length of tube on each side of the particles at given distances [D_c]."""
        return (self.length - sum(self.betas) - sum(gaps)) / 2


@dataclass(frozen=True, kw_only=True)
class SteadyProblem(Setup):
    """A quasi-steady problem: everything that does not vary along a branch; materials are among the `Parameters`.

    Attributes:
        narrowest: Smallest distance of the branch, for which the outlines are divided into arcs [D_c].
    """

    narrowest: float = np.inf

    def nominal(self, gaps: tuple[float, ...]) -> tuple[float, ...]:
        """Distances for which a mesh around spheres is made: the nearest of `PER_DECADE` values in each decade.

        The given distances themselves are returned if the rounded ones would take too much of the free length, or
        cells would have to follow them too far. Spheres of a closed row are equally far apart.
        """
        if self.closed:
            return ((self.length - sum(self.betas)) / len(self.betas),) * len(gaps)
        rounded = tuple(float(10 ** (round(np.log10(d) * PER_DECADE) / PER_DECADE)) for d in gaps)
        free = self.length - sum(self.betas) - sum(gaps)
        near = all(abs(there - d) < MOST_MOVED for there, d in zip(rounded, gaps, strict=True))
        return rounded if near and sum(rounded) - sum(gaps) < free / 4 else gaps
