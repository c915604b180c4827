"""A quasi-steady solution as a point of a branch: its quantities, their errors, and what moving adds to them."""

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
        discrete: Quantities evaluated from the solution, with the distances held.
        held: The same with the estimates of their errors added, where these are trusted.
        motion: What the motion of the particles adds to the velocities at held distances.
        t_relax: Relaxation time, a mean decay time of dU at held distances, as of `relaxation_time` [D_c/U_av].
        slopes: Derivative of every dU at held distances when all, or the only one that varies, change equally, (N-1,).
        held_slopes: Derivatives of the velocities (rows) at held distances by each distance (columns), (N, N-1).
        sensitivities: Derivatives of dU on the slow manifold with respect to parameters, by name; empty unless
            requested.
        estimate: Estimate of the discretisation errors.
        values: Values of the goals of the branch.
        unyielded: What unyielded liquid does to neighbours.
        newton: Newton iterations since the previous point.
        meshes: Number of meshes generated so far.
        distortion: Smallest ratio of a liquid cell's current to its reference Jacobian.
        by_particle: Derivatives of the velocities by size and softness of each particle, as of `by_each_particle`;
            empty unless requested.
        complete: Whether all of this is known. A point that only decides what is computed next lacks `t_relax`,
            sensitivities, and what moving adds beyond the first order.
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
        """The distance that varies along a curve, or the first one of all, which are equal there."""
        return self.gaps[self.parameters.varied or 0]

    @property
    def observation(self) -> Observation:
        """The quantities of the solution with the velocities of particles that move, on the slow manifold."""
        return moving(self.held, self.motion)

    @property
    def dUs(self) -> Array:
        """Relative velocities of neighbouring particles that move, on the slow manifold, shape (N-1,)."""
        return np.diff(self.held.U + self.motion.U)

    @property
    def held_dUs(self) -> Array:
        """Relative velocities of neighbouring particles at held distances, shape (N-1,)."""
        return self.held.dU

    @property
    def dU(self) -> float:
        """First relative velocity, that of a pair."""
        return float(self.dUs[0])

    @property
    def correction(self) -> Array:
        """What was added to every dU of the solution, (N-1,); zeros where the estimate is not trusted."""
        return self.held.dU - self.discrete.dU

    @property
    def dU_errors(self) -> Array:
        """Errors of the relative velocities, half-widths of intervals, (N-1,)."""
        return self.estimate[dU].half_width + self.motion.remainder

    @property
    def velocity_slopes(self) -> Array:
        """Derivatives of the velocities (rows) by each distance (columns) on the slow manifold, (N, N-1)."""
        return self.motion.slopes(self.held_slopes)

    @property
    def arrested(self) -> bool:
        """Whether unyielded liquid holds all particles together."""
        each = arrested(self.dUs, self.dU_errors, self.unyielded.bridge, self.unyielded.creep)
        return len(each) > 0 and bool(each.all())

    @property
    def slope_at_rest(self) -> float:
        """Derivative of the dU of a pair by its distance where dU vanishes, to first order in what moving adds."""
        by_rate = np.diff(self.motion.by_rates, axis=0)[0, 0]
        return float(self.slopes[0] * (1 + by_rate / self.motion.centres_by_gaps[0, 0]))

    @property
    def zero_error(self) -> float:
        """Half-width of the interval of a distance at which the dU of a pair vanishes, at a zero [D_c]."""
        return max(float(self.dU_errors[0]), abs(self.dU)) / abs(self.slope_at_rest)


def moving(held: Observation, motion: SlowMotion) -> Observation:
    """Quantities of a solution at held distances, with the velocities of particles that move."""
    return replace(held, U=held.U + motion.U)
