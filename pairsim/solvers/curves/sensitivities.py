"""Sensitivities of a quasi-steady solution to its parameters.

See "Sensitivities" in docs/explanation/numerics.md.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.curves.slow_manifold import PROBE, STEP, SlowMotion, centres_at
from pairsim.solvers.errors.adjoints import Adjoints
from pairsim.solvers.nonlinear.factors import LAST
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.linearisation import Linearisation
from pairsim.solvers.steady.motion import moving_residual, rate_terms

CHANGE = 1e-3  # relative change of a parameter in mixed differences; chosen
PART = 0.1  # fraction of the correction for motion that is the step of differences along it; chosen
ALL = ("Ca_e", "De", "xi", "beta", "difference")
STIFFNESS = "stiffness"  # the difference of two moduli, which is not in `ALL`
Line = Callable[[float], Parameters]
"""Parameters as a function of tau, the present ones at tau = 0."""


class VelocityChange(NamedTuple):
    """Derivatives of the velocities of all particles along a line of parameters, shape (N,) each."""

    held: Array  # at held distances [U_av]
    moving: Array  # of the first-order effect of motion on them [U_av]


def sensitivities(
    at: Linearisation, adjoints: Adjoints, dU: Array, motion: SlowMotion, names: Collection[str] = ALL
) -> dict[str, Array]:
    """Derivatives of dU on the slow manifold with respect to Ca_e, De, xi, beta and differences between two particles.

    If Ca_e or beta differ between particles, their ratios are fixed, and the derivative is with respect to the largest
    value. One adjoint for each velocity gives the derivatives at held distances with respect to all parameters (Giles
    and Pierce 2000). Those of the first-order effect of motion come from `_changes_by_moving`.

    Args:
        at: The solution.
        adjoints: The adjoints of the solution.
        dU: Relative velocities at held distances [U_av], shape (N-1,).
        motion: Effect of motion on the velocities.
        names: Names of the parameters wanted.

    Returns:
        Derivatives by name of the parameter, shape (N-1,) each: "beta"; "Ca_e" for soft particles; "De" and "xi" for
        liquids with modes; "difference" for a pair, with respect to the leading particle's diameter minus the trailing
        one's over their mean; and "stiffness" for a pair of soft particles, with respect to the same difference of
        their moduli.
    """
    now = at.parameters
    lines: dict[str, tuple[float, Line]] = {}
    if any(now.Ca_es):
        lines["Ca_e"] = max(now.Ca_es), lambda tau: now.softer(1 + tau)
    if now.liquid.modes:
        lines["De"] = now.De, lambda tau: now.with_De(now.De * (1 + tau))
        xi = float(now.liquid.xi)
        lines["xi"] = xi, lambda tau: replace(now, liquid=replace(now.liquid, xi=xi * (1 + tau)))
    n = len(now.solids)
    lines["beta"] = max(at.steady.problem.betas), lambda tau: now.resized([1 + tau] * n)
    if n == 2:
        lines["difference"] = 1.0, lambda tau: now.resized([1 - tau / 2, 1 + tau / 2])
        if all(now.Ca_es):
            lines[STIFFNESS] = 1.0, lambda tau: now.softened([1 + tau / 2, 1 - tau / 2])
    asked = {name: line for name, line in lines.items() if name in names}
    changes = _velocity_changes(at, adjoints, [line for _, line in asked.values()], dU, motion)
    return {
        name: (np.diff(change.held) + np.diff(change.moving)) / value
        for (name, (value, _)), change in zip(asked.items(), changes, strict=True)
    }


def by_each_particle(at: Linearisation, adjoints: Adjoints, dU: Array, motion: SlowMotion) -> Array:
    """Derivatives of the velocities of all particles with respect to the diameter and the Ca_e of each of them.

    Args:
        at, adjoints, dU, motion: As for `sensitivities`.

    Returns:
        Derivatives [U_av], shape (N, N, 2, 2). The indices are: the particle whose velocity is differentiated; the
        particle with respect to which it is; the logarithm of its diameter (0) or of its Ca_e (1; zeros for rigid
        particles); the velocity at held distances (0) or the first-order effect of motion on it (1).

    Raises:
        ValueError: The scene has a single rigid particle, whose mesh does not move with its diameter;
            `pairsim.solvers.rows.short_rows` finds this derivative by differences.
    """
    now, n = at.parameters, len(at.parameters.solids)
    if n == 1 and not any(now.Ca_es):
        raise ValueError("the mesh of a rigid particle alone does not move with its diameter")
    found, lines = np.zeros((n, n, 2, 2)), dict[tuple[int, int], Line]()
    for j, own in enumerate(np.eye(n)):
        lines[j, 0] = lambda tau, own=own: now.resized(1 + tau * own)  # type: ignore[misc]
        if now.Ca_es[j]:
            lines[j, 1] = lambda tau, own=own: now.softened(1 + tau * own)  # type: ignore[misc]
    changes = _velocity_changes(at, adjoints, list(lines.values()), dU, motion)
    for (j, k), change in zip(lines, changes, strict=True):
        found[:, j, k] = np.transpose(change)
    return found


def _velocity_changes(
    at: Linearisation, adjoints: Adjoints, lines: Sequence[Line], dU: Array, motion: SlowMotion
) -> list[VelocityChange]:
    """Derivatives of the velocities along each of `lines`; the other arguments are those of `sensitivities`."""
    changes = np.array([at.residual_change(line) for line in lines]).reshape(-1, len(at.y))
    held = -changes @ adjoints.velocities.T
    moving = np.zeros_like(held)
    if motion.U.any() and lines:
        moving = _changes_by_moving(at, adjoints, lines, changes, dU, np.diff(held), motion)
    return [VelocityChange(*each) for each in zip(held, moving, strict=True)]


def _changes_by_moving(
    at: Linearisation,
    adjoints: Adjoints,
    lines: Sequence[Line],
    changes: Array,
    dU: Array,
    dU_changes: Array,
    motion: SlowMotion,
) -> Array:
    """Derivatives along lines of the first-order effect of motion on velocities, V1 - V0 = -z . R_m, (lines, N).

    R_m is the contribution of rates of change to the residual. As the adjoint z changes along a line with the matrix J,
    the derivative is -z . d(J c + R_m), in which d is the derivative at a fixed correction c = -J^-1 R_m.

    Args:
        at, adjoints, dU, motion: As for `sensitivities`.
        lines: Parameters as functions of tau.
        changes: Derivatives of the residual along the lines, shape (lines, n_y).
        dU_changes: Derivatives of dU at held distances along the lines, shape (lines, N-1).
    """
    steady, y, tangents, stretch = at.steady, at.y, at.gap_tangents, motion.centres_by_gaps
    fastest = float(np.abs(dU).max())
    scale = max(1.0, PROBE / fastest) if fastest else 1.0  # the linear effect of small dU, well above rounding errors
    rates = scale * np.linalg.solve(stretch, dU)
    speed = float(np.abs(rates).max())
    along = rates / speed if speed else np.ones_like(rates)
    tangent, step = along @ tangents, STEP * min(at.parameters.gaps)
    y_t = rates @ tangents

    def place(line: Line, tau: float, s: float) -> Parameters:
        there = line(tau)
        return replace(there, gaps=tuple(np.add(there.gaps, s * along)))

    def mixed(value: Callable[[float, float], Array]) -> Array:
        ends = [a * b * value(a * CHANGE, b * step) for a in (1, -1) for b in (1, -1)]
        return np.asarray(np.sum(ends, axis=0) / (4 * CHANGE * step))

    def still(line: Line, y_change: Array, tau: float, s: float) -> Array:
        return steady.residual_at(place(line, tau, s), y + tau * y_change + s * tangent)

    y_changes = -at.solve(changes)  # exactly, as residuals left here would count as effects of motion, which are small
    unbalanced = [mixed(partial(still, *each)) for each in zip(lines, y_changes, strict=True)]
    *bends, correction = -at.solve(np.array([*unbalanced, rate_terms(at, y_t, rates)]), tolerance=LAST)

    def moves(line: Line, y_change: Array, bend: Array, dU_change: Array) -> Array:
        """The derivative along one line, shape (N,)."""

        def centres(tau: float, s: float) -> Array:
            there = y + tau * y_change + s * tangent + tau * s * bend
            return centres_at(steady, place(line, tau, s), there)

        rates_change = np.linalg.solve(stretch, scale * dU_change - speed * mixed(centres))
        y_t_change = speed * bend + rates_change @ tangents

        def corrected(tau: float) -> Array:
            """J c + R_m at tau along the line, with a fixed correction c, shape (n_y,)."""
            there, here = y + tau * y_change, line(tau)
            moving = moving_residual(steady, here, there, y_t + tau * y_t_change, rates + tau * rates_change)
            ends = [steady.residual_at(here, there + s * correction) for s in (PART, -PART)]
            return moving + (ends[0] - ends[1]) / (2 * PART)

        by_tau = (corrected(CHANGE) - corrected(-CHANGE)) / (2 * CHANGE)
        return np.asarray(-adjoints.velocities @ by_tau) / scale

    return np.array([moves(*each) for each in zip(lines, y_changes, bends, dU_changes, strict=True)])
