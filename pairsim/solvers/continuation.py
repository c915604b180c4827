"""Following quasi-steady solutions through their parameters: steps chosen from Newton's behaviour, folds recognised."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.solvers.bordered import solve_with
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.pseudo_time import relax
from pairsim.solvers.steady import Steady

# What a predictor may change at once: positions of the outline (largest diameters), log-conformation, in the largest
# node; a distance as a part of itself.
MOST_APART = 0.4
MOST_SHAPE = 0.15
MOST_STRESS = 1.0
SMALLEST = 2e-3  # of the way; below it natural continuation gives up
EASY, HARD = 4, 8  # Newton iterations that let the step grow, or shrink
MOST_RELAXED = 3  # steps through pseudo-time, one after the other: near a limit they would come closer for ever
ARC = 0.1
MOST_ARCS = 60
COLD_CAPILLARY = 0.01
COLD_DEBORAH = 0.02  # from .05 Newton takes up to ten iterations, and on N_p 28 log c overflows
STIFFER = (1.0, 0.2, 0.04, 0.008)  # factors of Ca_e where spheres are too soft for a first solution


def towards(start: Parameters, end: Parameters) -> Callable[[float], Parameters]:
    """The line from one place to another: De geometric, all else linear.

    The liquid's mesh follows the distances linearly, so that a tangent along a straight line foretells it exactly.
    """

    def along(tau: float) -> Parameters:
        return Parameters(
            tuple(a + (b - a) * tau for a, b in zip(start.gaps, end.gaps, strict=True)),
            tuple(a + (b - a) * tau for a, b in zip(start.Ca_es, end.Ca_es, strict=True)),
            start.De * (end.De / start.De) ** tau if start.De > 0 else 0.0,
            start.size,
        )

    return along


def cold_start(parameters: Parameters) -> Parameters:
    """Where a first solution is found from undeformed spheres in the developed flow."""
    largest = max(parameters.Ca_es, default=0.0)
    factor = min(1.0, COLD_CAPILLARY / largest) if largest else 1.0
    return replace(
        parameters,
        Ca_es=tuple(Ca_e * factor for Ca_e in parameters.Ca_es),
        De=min(parameters.De, COLD_DEBORAH),
    )


def begin(steady: Steady) -> None:
    """The first solution, at the parameters that the scene was made with (see `cold_start`) or of stiffer spheres.

    How much a sphere of some stiffness deforms depends on how narrow its gaps are.

    Raises:
        NoSteadyState: None was found.
    """
    wanted = steady.parameters
    for factor in STIFFER if any(wanted.Ca_es) else (1.0,):
        report = steady.solve(replace(wanted, Ca_es=tuple(Ca_e * factor for Ca_e in wanted.Ca_es)))
        if report.converged:
            break
    if not report.converged and steady.problem.law is not None:
        report = relax(steady, steady.parameters)
    if not report.converged:
        raise NoSteadyState(f"no first solution: {report.reason}", advice="a larger mesh.Np")
    if steady.distorted():
        new_mesh(steady)


def new_mesh(steady: Steady, *, afresh: bool = False) -> None:
    """The same solution on a new mesh, around spheres again if `afresh` and if their shapes allow it.

    Raises:
        NoSteadyState: It was lost.
    """
    steady.remesh(afresh=afresh)
    report = steady.solve(steady.parameters)
    if not report.converged and steady.problem.law is not None:
        report = relax(steady, steady.parameters)
    if not report.converged:
        raise NoSteadyState(f"the solution was lost at a remeshing: {report.reason}", advice="a larger mesh.Np")


def reach(steady: Steady, tangent: Array, rates: Array) -> float:
    """How far along the line the tangent may be trusted; `rates` are those of the distances."""
    fields = steady.constraints.fields
    step = min(
        (MOST_APART * d / abs(rate) for d, rate in zip(steady.parameters.gaps, rates, strict=True) if rate),
        default=np.inf,
    )
    for name, most in (("h", MOST_SHAPE * max(steady.problem.betas)), ("s", MOST_STRESS)):
        rate = tangent[fields[name]] if name in fields else np.empty(0)
        if rate.size and (largest := float(np.abs(rate).max())) > 0:
            step = min(step, most / largest)
    return float(steady.comm.bcast(step))


def follow(steady: Steady, target: Parameters) -> None:
    """Carry the scene's solution to other parameters.

    Raises:
        NoSteadyState: The way ends at a fold or Newton is lost; the scene stays at the last solution, and the
            message tells the parameters reached.
    """
    start = steady.parameters
    if start == target:
        return
    along = towards(start, target)
    tau, longest, refused, relaxed = 0.0, 1.0, "", 0
    while tau < 1.0:
        steady.factor()
        tangent = steady.tangent(lambda change, at=tau: along(at + change))  # type: ignore[misc]
        step = min(longest, reach(steady, tangent, np.subtract(target.gaps, start.gaps)))
        if step > 0.9 * (1.0 - tau):
            step = 1.0 - tau
        while True:
            to = 1.0 if tau + step > 1 - 1e-9 else tau + step
            there, before = along(to), steady.snapshot
            try:
                report = steady.solve(there, prepared(steady, there, steady.y + (to - tau) * tangent))
                refused = report.reason
                if report.converged:
                    longest = step * (2.0 if report.iterations <= EASY else 1.0 if report.iterations < HARD else 0.5)
                    relaxed = 0
                    break
            except MeshFailure as failure:
                refused = str(failure)
            steady.recall(before)
            step /= 3
            if step < SMALLEST:
                elastic, relaxed = steady.problem.law is not None, relaxed + 1
                if elastic and relaxed <= MOST_RELAXED and relax(steady, there).converged:
                    longest = 3 * SMALLEST
                    break
                raise _lost(steady, target, refused)
        tau = to


def _lost(steady: Steady, target: Parameters, refused: str) -> NoSteadyState:
    """Why the way to other parameters ends here: at a fold, or because Newton's method fails."""
    reached = steady.parameters
    fold, last = None, steady.snapshot
    if any(target.Ca_es):
        with suppress(MeshFailure, NoSteadyState):
            fold = find_fold(steady, target)
        steady.recall(last)
    if fold is not None and fold.passed:
        return NoSteadyState(
            f"the steady shapes end in a fold at {where(fold.parameters)}; there are none at {where(target)}"
        )
    return NoSteadyState(f"{where(reached)} was reached, {where(target)} not: {refused}", advice="a larger mesh.Np")


def prepared(steady: Steady, there: Parameters, guess: Array) -> Array:
    """A guess for other parameters, on a mesh made for it where the present one would be distorted there.

    Raises:
        MeshFailure: The guess is too far away: a cell is turned over there.
    """
    if steady.folded(there, guess):
        raise MeshFailure("a cell turned over")
    if steady.distorted(there, guess):
        steady.remesh(there, guess)
        return steady.y
    return guess


def where(parameters: Parameters) -> str:
    """A place in words."""

    def shown(values: tuple[float, ...]) -> str:
        return ", ".join(f"{v:.5g}" for v in dict.fromkeys(values))

    parts = [f"De = {parameters.De:.5g}"] if parameters.De else []
    parts += [f"Ca_e = {shown(parameters.Ca_es)}"] if any(parameters.Ca_es) else []
    parts += [f"d = {shown(parameters.gaps)}"] if parameters.gaps else []
    return ", ".join(parts)


@dataclass(frozen=True)
class Fold:
    """A turning point of a branch.

    Attributes:
        parameters: Its place.
        passed: Whether the branch was seen to turn back, or only stopped before it.
    """

    parameters: Parameters
    passed: bool


def find_fold(steady: Steady, target: Parameters) -> Fold:
    """Follow the branch by its arc length until the parameter turns back.

    Args:
        steady: A solution before the fold.
        target: Parameters beyond it; the fold is looked for on the straight way there.
    """
    along = towards(steady.parameters, target)
    tau, direction, arc = 0.0, 1.0, ARC
    places: list[tuple[float, float]] = [(0.0, 0.0)]
    most = MOST_SHAPE * max(steady.problem.betas)
    old: Array | None = None
    for _ in range(MOST_ARCS):
        steady.factor()
        slope = steady.tangent(lambda change, at=tau: along(at + change))  # type: ignore[misc]
        # Arc length is measured on the shapes, which all meshes share, and on the parameter.
        shape = steady.constraints.fields["h"]
        weight = 1 / (most**2 * len(shape))
        length = float(np.sqrt(weight * slope[shape] @ slope[shape] + 1))
        slope, tau_s = slope / length, 1 / length
        if old is not None and weight * float(slope[shape] @ old) + tau_s * direction < 0:
            slope, tau_s = -slope, -tau_s
        arc = min(arc, most / max(float(np.abs(slope[shape]).max()), 1e-9))
        before, value = steady.snapshot, weight * float(slope[shape] @ steady.y[shape]) + tau_s * tau
        while True:
            at, found, count = tau + arc * tau_s, None, 0
            try:
                guess = prepared(steady, along(at), steady.y + arc * slope)
                row = np.zeros(steady.constraints.size)
                row[steady.constraints.fields["h"]] = weight * slope[shape]
                found, count = solve_with(steady, along, at, guess, row, tau_s, value + arc)
            except MeshFailure:
                pass
            if found is not None:
                break
            steady.recall(before)
            arc /= 2
            if arc < ARC / 500:
                return Fold(steady.parameters, False)
        places.append((places[-1][0] + arc, found))
        tau, old, direction = found, slope[shape], tau_s
        if len(places) >= 3 and tau < places[-2][1]:
            (s0, t0), (s1, t1), (s2, t2) = places[-3:]
            a, b, c = np.polyfit([s0, s1, s2], [t0, t1, t2], 2)
            return Fold(along(float(c - b * b / (4 * a))), True)
        if tau >= 1:
            return Fold(steady.parameters, False)
        if count <= EASY:
            arc *= 1.5
    return Fold(steady.parameters, False)
