"""A branch of quasi-steady solutions of short rows, with points that contain only what the model of rows needs."""

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

RECALLED = 1.0  # cost of restoring a stored solution, in steps of a continuation; chosen


class RowBranch(Branch):
    """A branch that computes the decay time of a point (`Point.t_relax`) only if the velocities depend on it.

    Each row is continued from the stored solution from which it takes the fewest steps. Steps are longer where
    distances shrink, and shortest where one distance grows while another one shrinks.

    The decay time is left out if possible, as it takes as many successive linear solves as everything else about a row.
    It decides two things about the effect of motion on the velocities (`FirstOrder.slow_motion`): whether the second
    order is so small that it need not be computed, and how both orders are used where the series does not converge. In
    a liquid with a memory the decay time is at least that memory, which usually is long enough for the second order to
    be needed. Then, if the series converges, velocities no longer depend on the decay time.
    """

    def completed(self, point: Point) -> Point:
        """The point, completed only as far as rows need it: its decay time is NaN."""
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
        """`Row.lag` at the last point, by which the distances between centres are longer than for held particles.

        Shapes lag behind distances that change: to first order the unknowns are Y0 - J^-1 R(Y0; Y0' g0, g0), as in
        `pairsim.solvers.curves.slow_manifold`.

        Returns:
            The lag [D_c], shape (N-1,); None for rigid or single particles, or if they do not move relative to each
            other.
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
        """Restore the stored solution from which the fewest steps lead to given parameters, if this saves steps."""
        nearest = min(self._known, key=lambda snapshot: _steps(snapshot.parameters, parameters))
        if _steps(self.solver.parameters, parameters) > RECALLED + _steps(nearest.parameters, parameters):
            self.solver.recall(nearest)


def _slow_motion(first: FirstOrder, error: float) -> SlowMotion:
    """The result of `FirstOrder.slow_motion`; the decay time is computed only if the result depends on it."""
    least = first.slow_motion(_least_decay_time(first.at.parameters), inf)  # its remainder is the bound on second order
    if least.remainder.max() > NEGLIGIBLE * error:
        motion = first.slow_motion(inf, error)
        if motion.U.any():  # with an infinite decay time U would be 0 where the series does not converge
            return motion
    return first.slow_motion(relaxation_time(first.at), error)


def _least_decay_time(parameters: Parameters) -> float:
    """A lower bound on the decay time of a row, the longest relaxation time of its liquid [D_c/U_av]."""
    liquid = parameters.liquid
    return max((float(liquid.relaxation_time(mode)) for mode in liquid.modes), default=float(liquid.solvent.memory))


def _steps(start: Parameters, end: Parameters) -> float:
    """Approximate number of steps on a straight line from one set of distances to another.

    A step changes no distance by more than a given fraction of it. If some distances grow and others shrink, steps are
    therefore short at both ends of the line.
    """
    changes = [log(after / before) for before, after in zip(start.gaps, end.gaps, strict=True)]
    longer, shorter = max(changes, default=0.0), -min(changes, default=0.0)
    return max(longer, 0.0) / log(1 + MOST_APART) - max(shorter, 0.0) / log(1 - MOST_APART)
