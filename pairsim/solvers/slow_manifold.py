"""Velocities of a pair that moves: the slow manifold, as a series in the rates that holding the distances drops.

On the slow manifold shapes and stresses are functions Y(d) of the distances, which change with the velocities dU(d).
With the complete residual R(y; y_t, d_t) of `pairsim.solvers.motion` and the adjoints z of the velocities:

    held distances:  R(Y0; 0, 0) = 0,                   V0 = dU(Y0),
    first order:     V1 = V0 - z . R(Y0; Y0' V0, V0),
    second order:    Y1 = Y0 - J^-1 R(Y0; Y0' V0, V0),  V2 = dU(Y1) - z . R(Y1; Y1' V1, V1),

where ' is the derivative along the motion. Y0'' and Y1' follow from differences of the residual along the tangent and
the factors in hand. The terms fall off by the part of the distance that the pair moves while it remembers, so that the
size of the last one estimates what remains.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.adjoints import Adjoints
from pairsim.solvers.factors import ACCURATE
from pairsim.solvers.motion import moving_residual
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady import Steady

# Bound on the term of second order, relative to t_relax rate times the larger of the first and t_relax rate dU, with
# the largest relative rate at which distance or dU change (measured in 25 scenes: 0.04 to 4.6), and the part of the
# other errors of dU below which this bound is taken instead of the term (chosen).
BOUND, PART = 4.0, 0.1
STEP = 1e-2  # of differences along the motion, relative to the smallest distance; chosen
PROBE = 1e-6  # least rate of the distances at which the first order is evaluated [U_av]; chosen


@dataclass(frozen=True)
class SlowMotion:
    """What moving adds to the velocities at held distances.

    Attributes:
        U: Change of the velocities of the particles [U_av], shape (N,).
        remainder: What the next terms of the series may add to every dU [U_av], shape (N-1,).
        response: For a pair, the change of dU to first order over the rate of the distance; else 0.
    """

    U: Array
    remainder: Array
    response: float


def slow_motion(steady: Steady, adjoints: Adjoints, t_relax: float, error: float) -> SlowMotion:
    """Go on from velocities at held distances to those of particles that move.

    Args:
        steady: The scene, at a solution; its matrix must have been assembled by `Steady.factor`.
        adjoints: The adjoints of the solution.
        t_relax: How long the scene remembers [D_c/U_av].
        error: Smallest other error of a dU [U_av]; terms far below it are not computed.
    """
    y, fields = steady.y, steady.constraints.fields["U_p"]
    rates = np.diff(y[fields])
    count = len(rates)
    still = SlowMotion(np.zeros(count + 1), np.zeros(count), 0.0)
    if count == 0 or steady.problem.velocity is not None:
        return still
    fastest = float(np.abs(rates).max())
    probe = rates if fastest > PROBE or count > 1 else np.array([PROBE])
    tangents = steady.gap_tangents()
    neglected = moving_residual(steady, steady.parameters, y, probe @ tangents, probe) - steady.residual()
    first = -adjoints.velocities @ neglected
    response = float(np.diff(first)[0] / probe[0]) if count == 1 else 0.0
    if fastest <= PROBE:
        return replace(still, U=first * (rates[0] / probe[0]) if count == 1 else first, response=response)
    slopes = np.diff(tangents[:, fields], axis=1)  # of every dU (columns) by every distance (rows)
    rate = max(float(np.abs(rates / steady.parameters.gaps).max()), float(np.abs(rates @ slopes).max()) / fastest)
    passed = t_relax * rate
    bound = BOUND * passed * max(passed * fastest, float(np.abs(np.diff(first)).max()))
    if bound <= PART * error:
        return SlowMotion(first, np.full(count, bound), response)
    second = _second(steady, adjoints, neglected, rates, np.diff(first))
    if np.abs(np.diff(second)).max() > max(float(np.abs(np.diff(first)).max()), bound):  # the series does not converge
        return SlowMotion(first, np.abs(np.diff(second)), response)
    return SlowMotion(first + second, np.abs(np.diff(second)), response)


def _second(steady: Steady, adjoints: Adjoints, neglected: Array, rates: Array, first: Array) -> Array:
    """The term of second order in every velocity [U_av], shape (N,).

    Args:
        steady: The scene, at a solution.
        adjoints: The adjoints of the solution.
        neglected: Residual at the rates of the solution, shape (n_y,).
        rates: Rates of the distances in the solution [U_av], shape (N-1,).
        first: The terms of first order in every dU [U_av], shape (N-1,).
    """
    y, here = steady.y, steady.parameters
    solve = partial(steady.newton.linear_solve, tolerance=ACCURATE)
    fields, tangents = steady.constraints.fields["U_p"], steady.gap_tangents()
    speed = float(np.abs(rates).max())
    along = rates / speed
    tangent, turn = along @ tangents, np.diff((along @ tangents)[fields])
    step = STEP * min(here.gaps)

    def difference(residual: Callable[[float, Parameters], Array]) -> tuple[Array, Array]:
        return tuple(  # type: ignore[return-value]
            residual(s, replace(here, gaps=tuple(np.add(here.gaps, s * along)))) for s in (step, -step)
        )

    def held(s: float, there: Parameters) -> Array:
        steady.apply(there)
        return steady.newton.residual_at(y + s * tangent)

    ahead, behind = difference(held)
    bend = -solve((ahead + behind - 2 * steady.residual()) / step**2)
    corrected = y - solve(neglected)
    y_t, change = rates @ tangents, speed * bend + turn @ tangents

    def moving(s: float, there: Parameters) -> Array:
        return moving_residual(steady, there, corrected + s * tangent, y_t + s * change, rates + s * turn)

    ahead, behind = difference(moving)
    along_motion = tangent - solve((ahead - behind) / (2 * step))
    faster = rates + first
    scale = float(faster @ along) / float(along @ along)
    y_t = scale * along_motion + (faster - scale * along) @ tangents
    steady.apply(here)
    return np.asarray(-adjoints.velocities @ moving_residual(steady, here, corrected, y_t, faster))
