"""A branch of quasi-steady solutions of short rows, whose points have no more than the model of rows needs."""

from __future__ import annotations

from dataclasses import replace
from math import inf, log

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.curves.point import Point
from pairsim.solvers.curves.sensitivities import by_each_particle
from pairsim.solvers.curves.slow_manifold import NEGLIGIBLE, FirstOrder, SlowMotion, centres_at
from pairsim.solvers.goals import dU
from pairsim.solvers.nonlinear.factors import LAST
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.continuation import MOST_APART
from pairsim.solvers.steady.relaxation import relaxation_time

RECALLED = 1.0  # how many steps of a continuation take as long as putting a known solution back; chosen


class RowBranch(Branch):
    """A branch that computes the decay time of a point (`Point.t_relax`) only where the velocities depend on it.

    Each row is continued from that known solution from which it takes the fewest steps. Steps are longer where
    distances shrink, and shortest where one distance grows while another one shrinks.

    The decay time is left out where it can be, as it needs as many linear systems, one after another, as all else that
    is known of a row. It decides two things about what moving adds to the velocities (`FirstOrder.slow_motion`):
    whether the second order is so small that it need not be computed, and what is made of both orders where no slow
    manifold is near. In a liquid with a memory the decay time is at least that memory, which usually is long enough for
    the second order to be computed. Then, if a slow manifold is near, velocities do not depend on the decay time any
    more.
    """

    def completed(self, point: Point) -> Point:
        """A point with what rows need of it; its decay time is nan."""
        if point.complete:
            return point
        first, errors = self._first, point.estimate[dU].half_width
        assert first is not None
        assert first.at is self.solver.linearised, "the solver has gone on to another point"
        motion = _slow_motion(first, float(errors.min())) if point.gaps else first.motion
        known = first.at, first.adjoints, first.dU, motion
        by_particle = by_each_particle(*known) if self._by_particle else point.by_particle
        return replace(point, motion=motion, by_particle=by_particle, complete=True)

    def lag(self) -> Array | None:
        """By how much the distances between centres at the last point are longer than those of held particles.

        Shapes lag behind distances that change: to first order the unknowns are Y0 - J^-1 R(Y0; Y0' g0, g0), as in
        `pairsim.solvers.curves.slow_manifold`.

        Returns:
            Shape (N-1,) [D_c]; None where particles are rigid, alone, or do not move beside each other.
        """
        first = self._first
        assert first is not None
        if first.rates is None or not any(self.solver.parameters.solids):
            return None
        at = first.at
        moving = at.y - at.solve(first.neglected, tolerance=LAST)
        ends = [centres_at(at.steady, at.parameters, y) for y in (moving, at.y)]
        return np.asarray(ends[0] - ends[1])

    def _nearest(self, parameters: Parameters) -> None:
        """Restore the known solution from which fewer steps lead to given parameters than from the present one."""
        nearest = min(self._known, key=lambda snapshot: _steps(snapshot.parameters, parameters))
        if _steps(self.solver.parameters, parameters) > RECALLED + _steps(nearest.parameters, parameters):
            self.solver.recall(nearest)


def _slow_motion(first: FirstOrder, error: float) -> SlowMotion:
    """What `FirstOrder.slow_motion` gives for the decay time, which is computed only if the result depends on it."""
    least = first.slow_motion(_least_decay_time(first.at.parameters), inf)  # with a bound on the second order alone
    if least.remainder.max() > NEGLIGIBLE * error:
        motion = first.slow_motion(inf, error)
        if motion.U.any():  # with an endless memory nothing is left where no slow manifold is near
            return motion
    return first.slow_motion(relaxation_time(first.at), error)


def _least_decay_time(parameters: Parameters) -> float:
    """A lower bound of the decay time of a row: the longest memory of its liquid [D_c/U_av]."""
    liquid = parameters.liquid
    return max((float(liquid.relaxation_time(mode)) for mode in liquid.modes), default=float(liquid.solvent.memory))


def _steps(start: Parameters, end: Parameters) -> float:
    """About how many steps lead from one set of distances to another on a straight line.

    A step changes no distance by more than a given part of it. Where some distances grow and others shrink, steps are
    therefore short at both ends of the line.
    """
    changes = [log(after / before) for before, after in zip(start.gaps, end.gaps, strict=True)]
    longer, shorter = max(changes, default=0.0), -min(changes, default=0.0)
    return max(longer, 0.0) / log(1 + MOST_APART) - max(shorter, 0.0) / log(1 - MOST_APART)
