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
# Largest difference between a distance and the one that a mesh around spheres was made for [D_c]. For rigid pairs of
# beta 0.2 and 0.4 at distances of 1 to 9 the smallest Jacobian of a cell, relative to that of the mesh as made, stayed
# at 0.61 or above up to this difference, and fell below 0.52 beyond it; at a difference of 2 cells were inverted.
MOST_MOVED = 0.6


@dataclass(frozen=True, kw_only=True)
class Setup:
    """The part of a problem that runs in time and quasi-steady problems share: what scene and meshes are made of.

    Attributes:
        betas: Diameters of the particles from upstream [D_c], N values.
        length: Length of the tube [D_c].
        periodic: Whether the ends are periodic; otherwise the velocity on them is prescribed.
        mesh: Cell sizes.
        newton: Options of Newton's method.
        drive: What drives the liquid and the particles.
        closed: Whether the tube is a period of an infinite row of equal particles.
        volume_modulus: Whether an augmented-Lagrangian penalty in soft particles resists changes of volume within
            cells, which strongly compressed surfaces need; Newton's method then takes more iterations.
        monitor: Tells solvers when the computation is to end. Setups that differ only in it compare equal.
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
        """A problem of the class `kind` with the fields of this setup, except for the options of Newton's method.

        Args:
            kind: `Problem` or `SteadyProblem`.
            **own: Other fields of the problem, or fields in place of those of this setup.
        """
        shared = {each.name: getattr(self, each.name) for each in fields(Setup) if each.name != "newton"}
        return kind(**{**shared, **own})

    def repeated(self, count: int) -> Self:
        """This setup with its particles repeated `count` times; the length of the tube is left to the caller."""
        return replace(repeated(self, count), drive=repeated(self.drive, count))


@dataclass(frozen=True, kw_only=True)
class Problem(Setup):
    """A time-dependent problem, in which no force acts on the particles.

    Attributes:
        solids: The particles' materials, None for rigid particles, N entries.
        gaps: Initial distances between facing surfaces [D_c], N-1 values.
        control: Control of the step size.
        first_step: Size of the first step [D_c/U_av].
        U_m: Velocity of the frame in the first step, for a mean velocity of the liquid of 1 [U_av].
        start: Initial positions of the material as a function of the undeformed ones, (k, 2) -> (k, 2); None for
            undeformed particles.
        from_steady: Whether the run starts from the quasi-steady state of the first distances, in the developed flow;
            otherwise from rest.
        extrapolated: Number of earlier solutions, at most four, from which the first guess of a step is extrapolated.
        liquid: The liquid.
        t_end: Time at which the run ends, up to which the flow without particles is computed [D_c/U_av].
        min_gap: The run ends earlier when a distance falls below this [D_c].
        max_gap: The run ends earlier when a distance exceeds this [D_c]; None for no limit.
        least_room: The run ends earlier when less than this length of tube is left on each side of the particles [D_c].
        dU_error: Whether the discretisation errors of dU and of the other goals are estimated.
        held: Whether the distances are kept constant, as if the particles were held apart without any effect on the
            flow.
        until_known: In a flow that varies, the run ends when its cycles have become periodic and the drift of the
            distances over a cycle is known, both to this fraction of the largest |dU| (`Cycles.are_known`). None: the
            run goes on.
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
        """Length of tube on each side of the particles [D_c], at given distances [D_c], N-1 values."""
        return (self.length - sum(self.betas) - sum(gaps)) / 2


@dataclass(frozen=True, kw_only=True)
class SteadyProblem(Setup):
    """A quasi-steady problem: everything that does not vary along a branch; what may vary is in `Parameters`.

    Attributes:
        narrowest: Smallest distance of the branch [D_c]: the outlines are divided into arcs that are short enough for
            it.
    """

    narrowest: float = np.inf

    def nominal(self, gaps: tuple[float, ...]) -> tuple[float, ...]:
        """Distances for which a mesh around spheres is made [D_c]: the nearest of `PER_DECADE` values in each decade.

        The given distances themselves are returned if the rounded ones would take up too much of the free length of the
        tube, or if they differ so much that cells would be distorted (`MOST_MOVED`). In a periodic row, which is
        `closed`, they are the equal distances of undeformed spheres.
        """
        if self.closed:
            return ((self.length - sum(self.betas)) / len(self.betas),) * len(gaps)
        rounded = tuple(float(10 ** (round(np.log10(d) * PER_DECADE) / PER_DECADE)) for d in gaps)
        free = self.length - sum(self.betas) - sum(gaps)
        near = all(abs(there - d) < MOST_MOVED for there, d in zip(rounded, gaps, strict=True))
        return rounded if near and sum(rounded) - sum(gaps) < free / 4 else gaps
