"""A quasi-steady solution as a point of a branch: its quantities, their errors, and the effect of motion on them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from pairsim.fem.diagnostics import Observation
from pairsim.runtime.arrays import Array
from pairsim.solvers.curves.arrest import arrested
from pairsim.solvers.curves.slow_manifold import SlowMotion
from pairsim.solvers.curves.unyielded_bridge import UnyieldedBridge
from pairsim.solvers.errors.estimate import ErrorEstimate
from pairsim.solvers.goals import Goal, dU
from pairsim.solvers.parameters import Parameters


@dataclass(frozen=True)
class Point:
    """A quasi-steady solution.

    Attributes:
        parameters: Parameters of the solution.
        discrete: Quantities evaluated from the discrete solution, at held distances.
        held: The same with the estimates of their errors added, where these are trusted.
        motion: Effect of the motion of the particles on the velocities at held distances.
        t_relax: Relaxation time, a mean decay time of dU at held distances, from `relaxation_time` [D_c/U_av].
        slopes: Derivatives of every dU at held distances with respect to the distance that varies along a curve, which
            is all distances together or a single one, (N-1,).
        held_slopes: Derivatives of the velocities (rows) at held distances with respect to each distance (columns),
            (N, N-1).
        sensitivities: Derivatives of dU on the slow manifold with respect to parameters, by name; empty unless
            requested.
        estimate: Estimates of the discretisation errors.
        values: Values of the goals of the branch.
        unyielded: Unyielded liquid between neighbours.
        newton: Newton iterations since the previous point.
        meshes: Number of meshes generated so far.
        distortion: Smallest ratio of a liquid cell's current to its reference Jacobian.
        by_particle: Derivatives of the velocities with respect to diameter and Ca_e of each particle, as in
            `by_each_particle`; empty unless requested.
        complete: Whether all attributes are known. A point that only decides what is computed next lacks `t_relax`,
            `sensitivities`, `by_particle`, `unyielded`, and the effect of motion beyond the first order.
    """

    parameters: Parameters
    discrete: Observation
    held: Observation
    motion: SlowMotion
    t_relax: float
    slopes: Array
    held_slopes: Array
    sensitivities: dict[str, Array]
    estimate: ErrorEstimate
    values: Mapping[Goal, Array]
    unyielded: UnyieldedBridge
    newton: int
    meshes: int
    distortion: float
    by_particle: Array = field(default_factory=lambda: np.zeros(0))
    complete: bool = True

    @property
    def gaps(self) -> tuple[float, ...]:
        """Distances between facing surfaces, N-1 values."""
        return self.parameters.gaps

    @property
    def d(self) -> float:
        """The distance that varies along a curve [D_c]; where all vary and are equal, the first one."""
        return self.gaps[self.parameters.varied or 0]

    @property
    def observation(self) -> Observation:
        """The quantities of the solution, with the velocities of moving particles on the slow manifold."""
        return moving(self.held, self.motion)

    @property
    def dUs(self) -> Array:
        """Relative velocities of neighbouring particles on the slow manifold [U_av], shape (N-1,)."""
        return np.diff(self.held.U + self.motion.U)

    @property
    def held_dUs(self) -> Array:
        """Relative velocities of neighbouring particles at held distances [U_av], shape (N-1,)."""
        return self.held.dU

    @property
    def dU(self) -> float:
        """First relative velocity, that of a pair [U_av]."""
        return float(self.dUs[0])

    @property
    def correction(self) -> Array:
        """The estimate of its error that was added to every dU, (N-1,); zeros where the estimate is not trusted."""
        return self.held.dU - self.discrete.dU

    @property
    def dU_errors(self) -> Array:
        """Half-widths of the relative velocities `dUs` [U_av], (N-1,)."""
        return self.estimate[dU].half_width + self.motion.remainder

    @property
    def velocity_slopes(self) -> Array:
        """Derivatives of velocities (rows) on the slow manifold with respect to each distance (columns), (N, N-1)."""
        return self.motion.slopes(self.held_slopes)

    @property
    def arrested(self) -> bool:
        """Whether unyielded liquid holds all particles together."""
        each = arrested(self.dUs, self.dU_errors, self.unyielded.bridge, self.unyielded.creep)
        return len(each) > 0 and bool(each.all())

    @property
    def slope_at_rest(self) -> float:
        """Derivative of a pair's dU with respect to the distance where dU vanishes, to first order in the motion."""
        by_rate = np.diff(self.motion.by_rates, axis=0)[0, 0]
        return float(self.slopes[0] * (1 + by_rate / self.motion.centres_by_gaps[0, 0]))

    @property
    def zero_error(self) -> float:
        """Half-width of the distance at which the dU of a pair vanishes, for a point at a zero [D_c]."""
        return max(float(self.dU_errors[0]), abs(self.dU)) / abs(self.slope_at_rest)


def moving(held: Observation, motion: SlowMotion) -> Observation:
    """Quantities at held distances, with the velocities replaced by those of moving particles."""
    return replace(held, U=held.U + motion.U)
