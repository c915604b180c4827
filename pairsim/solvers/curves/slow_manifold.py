"""Velocities of moving particles: the slow manifold, as a series in the rates that are dropped at held distances.

On the slow manifold shapes and stresses are functions Y(d) of the distances, which change at rates g. The relative
velocities dU are the rates of the distances C(Y(d)) between centres of volume, so that C' g = dU, and g differs from dU
where shapes change. With the unsteady residual R(y; y_t, d_t) of `pairsim.solvers.steady.motion` and the adjoints z of
the velocities:

    held distances:  R(Y0; 0, 0) = 0,               V0 = dU(Y0),                           g0 = V0 / C',
    first order:     Y1 = Y0 - J^-1 R(Y0; Y0' g0, g0),  V1 = V0 - z . R(Y0; Y0' g0, g0),       g1 = V1 / C',
    second order:                                   V2 = dU(Y1) - z . R(Y1; Y1' g1, g1),

where ' is the derivative along the motion. dU(Y1) = V1, as dU is linear in the unknowns; docs/explanation/numerics.md
writes the rates g as time derivatives of d. Y0'' and Y1' follow from differences of the residual along the tangent,
solved with the factors of J. Each term is smaller than the one before by about the fraction of the distance that the
pair moves within t_relax. The second-order term is added where it is smaller than the first-order one, and its size is
the estimate of the remainder. Elsewhere the series is of no use: the first-order term is then taken at rates of no more
than d/t_relax, and the second-order one is not added but counts as the remainder, up to half of dU or to the
first-order term, whichever is larger.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from pairsim.fem.algebra.constraints import PositionUpdate
from pairsim.fem.diagnostics import centres
from pairsim.physics.fields import DISPLACEMENT
from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.adjoints import Adjoints
from pairsim.solvers.nonlinear.factors import LAST
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.linearisation import Linearisation
from pairsim.solvers.steady.motion import moving_residual, rate_terms
from pairsim.solvers.steady.scene import SteadySolver

# Bound on the ratio of the second-order term to varepsilon times the larger one of the first-order term and varepsilon
# dU, where varepsilon is t_relax times the largest relative rate of change of a distance or of dU. In 25 scenes this
# ratio was .04 to 4.6.
BOUND = 4.0
NEGLIGIBLE = 0.1  # fraction of the other errors of dU below which the bound replaces the second-order term; chosen
MOST = 0.5  # bound on the fraction of dU that depends on the start if there is no slow manifold; .15 in eight scenes
STEP = 1e-2  # step of differences along the motion, relative to the smallest distance; chosen
PROBE = 1e-6  # least dU at which the first order is evaluated [U_av]; chosen
# Bound on the effect of a start from rest, relative to its value to first order. This ratio was .98 to 1.08 in three
# Newtonian runs, and 1.8 with a polymer at De 1, whose log c is far from that at rest.
REST, ELASTIC_REST = 1.1, 2.0


@dataclass(frozen=True)
class SlowMotion:
    """Effect of motion on the velocities at held distances.

    Attributes:
        U: Change of the velocities of the particles by their motion [U_av], shape (N,).
        remainder: Bound on, or estimate of, the further terms of the series in every dU [U_av], shape (N-1,).
        by_rates: Derivatives of the velocities (rows) with respect to the rates of the distances (columns), to first
            order, (N, N-1).
        centres_by_gaps: Derivatives of the distances between centres (rows) with respect to those between surfaces
            (columns), (N-1, N-1).
        from_rest: Bound on how much the distances between centres finally differ if particles start from rest, and not
            from the slow manifold, at the same distances between surfaces [D_c], (N-1,).
    """

    U: Array
    remainder: Array
    by_rates: Array
    centres_by_gaps: Array
    from_rest: Array

    @property
    def stretch(self) -> Array:
        """Derivatives of the distances between centres when all those between surfaces change equally, (N-1,)."""
        return self.centres_by_gaps.sum(axis=1)

    def slopes(self, held: Array) -> Array:
        """Derivatives of the velocities on the slow manifold, from those at held distances, (N, N-1) both.

        Changes of the distances change the rates by G = (C' - D E)^-1 D A, where D takes differences of neighbours, A
        are the slopes at held distances and E is `by_rates`. The changes of E and C' with the distances are neglected:
        their effect is as small as the rates themselves, and vanishes where no distance changes.
        """
        rates = np.linalg.solve(self.centres_by_gaps - np.diff(self.by_rates, axis=0), np.diff(held, axis=0))
        return np.asarray(held + self.by_rates @ rates)


@dataclass(frozen=True)
class FirstOrder:
    """The effect of motion on velocities to first order; `slow_motion` continues the series to second order.

    Attributes:
        at: The solution Y0 at held distances.
        dU: V0, relative velocities at held distances, with the estimates of their errors where these are added [U_av],
            shape (N-1,).
        adjoints: The adjoints z of the solution.
        motion: The first order, with `remainder` and `from_rest` still 0.
        rates: g0, rates of the distances [U_av], shape (N-1,); None where particles do not move relative to each other,
            or hardly do.
        neglected: R(Y0; Y0' g0, g0) - R(Y0; 0, 0), the terms that are dropped at held distances, shape (n_y,).
    """

    at: Linearisation
    dU: Array
    adjoints: Adjoints
    motion: SlowMotion
    rates: Array | None = None
    neglected: Array = field(default_factory=lambda: np.zeros(0))

    @staticmethod
    def of(at: Linearisation, dU: Array, adjoints: Adjoints) -> FirstOrder:
        """Evaluate the first order; the arguments are the attributes."""
        count = len(dU)
        still = SlowMotion(
            np.zeros(count + 1), np.zeros(count), np.zeros((count + 1, count)), np.eye(count), np.zeros(count)
        )
        if count == 0 or not at.steady.problem.drive.free:
            return FirstOrder(at, dU, adjoints, still)
        fastest = float(np.abs(dU).max())
        scale = max(1.0, PROBE / fastest) if fastest else 0.0  # the linear effect of small dU, well above rounding
        probe = scale * dU if scale else np.full(count, PROBE)
        tangents, stretch = at.gap_tangents, _centres_by_gaps(at)
        rates = np.linalg.solve(stretch, probe)

        def dropped(rates: Array) -> Array:
            """Contribution of rates of the distances to the residual, which is dropped at held distances."""
            return rate_terms(at, rates @ tangents, rates)

        neglected = dropped(rates)
        first = -adjoints.velocities @ neglected
        each = float(np.abs(rates).max()) * np.eye(count)  # the rates of one distance after the other
        changes = [neglected * each[0, 0] / rates[0]] if count == 1 else [dropped(rate) for rate in each]
        by_rates = -adjoints.velocities @ np.transpose(changes) / each[0, 0]
        still = replace(still, by_rates=by_rates, centres_by_gaps=stretch)
        if scale != 1.0:
            return FirstOrder(at, dU, adjoints, replace(still, U=first / scale if scale else 0 * first))
        return FirstOrder(at, dU, adjoints, replace(still, U=first), rates, neglected)

    def slow_motion(self, t_relax: float, error: float) -> SlowMotion:
        """The series to second order, where that is needed and helps, with a bound on the remainder.

        Args:
            t_relax: Relaxation time of the scene [D_c/U_av].
            error: Smallest of the other errors of all dU [U_av]; a second-order term far below it is not computed.
        """
        at, dU, rates = self.at, self.dU, self.rates
        if not len(dU) or not at.steady.problem.drive.free:
            return self.motion
        still, first = replace(self.motion, from_rest=_from_rest(at, self.adjoints)), self.motion.U
        if rates is None:
            return still
        fastest, fields = float(np.abs(dU).max()), at.steady.constraints.fields["U_p"]
        slopes = np.diff(at.gap_tangents[:, fields], axis=1)  # of each dU (columns) with each distance (rows)
        # t_relax |d_t|/d, and the larger one of it and t_relax |d dU/d d|, varepsilon of docs/explanation/numerics.md.
        covered = t_relax * float(np.abs(rates / at.parameters.gaps).max())
        passed = max(covered, t_relax * float(np.abs(rates @ slopes).max()) / fastest)
        bound = BOUND * passed * max(passed * fastest, float(np.abs(np.diff(first)).max()))
        if bound <= NEGLIGIBLE * error:
            return replace(still, remainder=np.full(len(dU), bound))
        second = _second(at, dU, self.adjoints, self.neglected, rates, np.diff(first), still.centres_by_gaps)
        sizes = np.abs(np.diff(first)), np.abs(np.diff(second))
        if sizes[1].max() < sizes[0].max():
            return replace(still, U=first + second, remainder=sizes[1])
        # Here dU depends on the start. At the rates of the held state a gap might open by more than its own size within
        # t_relax, which no gap does.
        first = first / max(covered, 1.0)
        most = max(float(np.abs(np.diff(first)).max()), MOST * min(passed, 1.0) * fastest)
        return replace(still, U=first, remainder=np.minimum(sizes[1], most))


def centres_at(steady: SteadySolver, parameters: Parameters, y: Array) -> Array:
    """Distances between the centres of volume of neighbours at free unknowns y [D_c], shape (N-1,)."""
    h = steady.constraints.positions(y, PositionUpdate(steady.h_star(parameters)))
    return np.diff(centres(steady.bodies, h))


def _from_rest(at: Linearisation, adjoints: Adjoints) -> Array:
    """The bound `SlowMotion.from_rest` [D_c], (N-1,).

    To first order the deviation e of shapes and stresses from those of the solution obeys R' e + R_t e_t = 0. Its
    integral over all times therefore follows from its initial value, the difference between the state at rest and the
    solution. With the adjoints z of the velocities, the integral of the deficit of dU is -z . R_t(Y0 - Y_rest). In
    addition, the centres of undeformed spheres are at another distance than those of the solution if the distance
    between their surfaces is the same.
    """
    y, steady, parameters, fields = at.y, at.steady, at.parameters, at.steady.constraints.fields
    more, at_rest = np.zeros(len(y)), {field.unknowns: field.rest for field in parameters.liquid.transported}
    for name, rest in {"h": 0.0, DISPLACEMENT.unknowns: 0.0, **at_rest}.items():
        if name in fields:
            more[fields[name]] = y[fields[name]] - rest
    lost = rate_terms(at, more, np.zeros(len(parameters.gaps)))
    first = centres_at(steady, parameters, np.zeros(len(y))) - centres_at(steady, parameters, y)
    bound = ELASTIC_REST if parameters.liquid.has_memory else REST
    return np.asarray(bound * np.maximum(np.abs(first), np.abs(first - np.diff(adjoints.velocities @ lost))))


def _centres_by_gaps(at: Linearisation) -> Array:
    """`SlowMotion.centres_by_gaps`, C', shape (N-1, N-1)."""
    here, step = at.parameters, STEP * min(at.parameters.gaps)
    columns = []
    for i, tangent in enumerate(at.gap_tangents):
        ends = [centres_at(at.steady, here.with_longer_gap(i, s), at.y + s * tangent) for s in (step, -step)]
        columns.append((ends[0] - ends[1]) / (2 * step))
    return np.array(columns).T


def _second(
    at: Linearisation, dU: Array, adjoints: Adjoints, neglected: Array, rates: Array, first: Array, stretch: Array
) -> Array:
    """The second-order term of every velocity, -z . R(Y1; Y1' g1, g1) [U_av], shape (N,).

    Derivatives ' along the motion are with respect to its length s in the space of distances, which grows at the speed
    max |g0|.

    Args:
        at: The solution Y0 at held distances.
        dU: V0 [U_av], shape (N-1,).
        adjoints: The adjoints z of the solution.
        neglected: R(Y0; Y0' g0, g0) - R(Y0; 0, 0), shape (n_y,).
        rates: g0 [U_av], shape (N-1,).
        first: V1 - V0 [U_av], shape (N-1,).
        stretch: C', as in `SlowMotion.centres_by_gaps`, shape (N-1, N-1).
    """
    steady, y, here, tangents = at.steady, at.y, at.parameters, at.gap_tangents
    solve, fields = partial(at.solve, tolerance=LAST), steady.constraints.fields["U_p"]
    speed = float(np.abs(rates).max())
    along = rates / speed
    tangent, step = along @ tangents, STEP * min(here.gaps)

    def places(s: float) -> Parameters:  # farther by s along the motion
        return replace(here, gaps=tuple(np.add(here.gaps, s * along)))

    def still(s: float) -> Array:  # the residual at held distances, along the tangent
        return steady.residual_at(places(s), y + s * tangent)

    # Y0'', from the second-order part of the residual along the tangent.
    bend = -solve((still(step) + still(-step) - 2 * at.residual) / step**2)

    def apart(s: float) -> Array:  # C along the motion
        return centres_at(steady, places(s), y + s * tangent + s**2 / 2 * bend)

    turn = (apart(step) + apart(-step) - 2 * apart(0.0)) / step**2  # C''
    change = np.linalg.solve(stretch, np.diff(tangent[fields]) - speed * turn)  # g0'
    corrected = y - solve(neglected)  # Y1
    y_t, y_t_change = rates @ tangents, speed * bend + change @ tangents

    def moving(s: float) -> Array:  # the residual with rates, Y1 and its rates moved along the tangent of Y0
        shifted = corrected + s * tangent, y_t + s * y_t_change, rates + s * change
        return moving_residual(steady, places(s), *shifted)

    # Y1', from the derivative of the residual along the motion.
    along_motion = tangent - solve((moving(step) - moving(-step)) / (2 * step))
    ends = [centres_at(steady, places(s), corrected + s * along_motion) for s in (step, -step)]
    stretched = (ends[0] - ends[1]) / (2 * step) - stretch @ along  # C' of Y1 minus that of Y0
    faster = np.linalg.solve(stretch, dU + first - speed * stretched)  # g1
    scale = float(faster @ along) / float(along @ along)
    y_t = scale * along_motion + (faster - scale * along) @ tangents
    return np.asarray(-adjoints.velocities @ moving_residual(steady, here, corrected, y_t, faster))
