"""Continuation of quasi-steady solutions in their parameters, with step size control and detection of folds.

See "Continuation" in docs/explanation/numerics.md. Constants without another origin were chosen.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from pairsim.quantities.kinds import LENGTH, PURE
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import BranchEnd, BudgetSpent, MeshFailure, NoSteadyState
from pairsim.runtime.message import Message, Text
from pairsim.solvers.nonlinear.convergence import Report
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.ends import LAST, Ended, Passed, SpentOnTheWay, end_after
from pairsim.solvers.steady.predictors import place_undeformed
from pairsim.solvers.steady.pseudo_time import relax
from pairsim.solvers.steady.scene import Snapshot, SteadySolver

# Largest changes in one predictor step; those of fields of the liquid are in the declarations of the fields.
MOST_APART = 0.4  # of a distance, relative to itself
MOST_SHAPE = 0.15  # of a nodal position of a particle, relative to the largest diameter
SMALLEST = 2e-3  # step, as a fraction of the whole way, below which natural continuation stops
# Factor of change of a parameter above which a solve begins with a new matrix, at the predicted state. Where a distance
# changes by a fifth, the matrix of the last solution would contract by 0.14, that of the predicted state does by 0.01.
FAR = 1.05
# Advice where continuation fails: a run does not need a steady state, and shows whether it approaches one.
IN_TIME = "pairsim run from this distance, which shows whether a steady state is approached"
ON_OTHER_CELLS = "another mesh.Np"  # the same for particles at a prescribed velocity, which runs do not have
ROUNDER = (0.03, 1e-3)  # factors of the regularisation m, tried where a guess from another mesh fails; chosen
FIRST_SHARPER = 50.0  # largest factor of m in a first step; the whole way in one step took 30 iterations and failed
FEW_ITERATIONS = 2  # Newton iterations up to which the step is doubled
MANY_ITERATIONS = 5  # Newton iterations from which it is halved
OF_KINK = 4  # factor of both numbers in liquids with a yield stress, where a solve takes more iterations; chosen
MOST_RELAXED = 3  # consecutive steps by pseudo-time; without a limit they could approach a fold in ever smaller steps
# Difference of the end of a branch between meshes, relative to the parameter followed, rounded up from the largest
# differences that were measured (docs/explanation/decisions.md, "Laws").
MESH_SPREAD = 0.3  # where the end is known on one mesh
SPREAD_OF_SEVERAL = 0.1  # where it is known on several; the differences at beta up to 0.5
CLOSER = 0.7  # step towards a fold, as a fraction of the distance to it
NEAR_ENOUGH = 2e-3  # step towards a fold, as a fraction of the way to it, below which it is close enough
COLD_CAPILLARY = 0.01
STIFFER = (1.0, 0.2, 0.04, 0.008)  # factors of Ca_e that are tried in turn for the first solution


def cold_start(parameters: Parameters) -> Parameters:
    """Parameters of nearly rigid particles in an easier liquid, for which undeformed spheres are a good first guess."""
    largest = max(parameters.Ca_es, default=0.0)
    factor = min(1.0, COLD_CAPILLARY / largest) if largest else 1.0
    return replace(parameters.softer(factor), liquid=parameters.liquid.easier())


def begin(steady: SteadySolver) -> None:
    """Find a first solution, at the present parameters of the scene (see `cold_start`) or with stiffer particles.

    Stiffer particles are tried because the deformation at a given Ca_e increases as the gaps narrow.

    Raises:
        NoSteadyState: No solution was found.
    """
    report = _from_spheres(steady)
    if not report.converged and steady.parameters.liquid.has_memory:
        report = relax(steady, steady.parameters)
    if not report.converged:
        found_none = "no solution was found from undeformed spheres{}: {}"
        message = Message(found_none, place(steady.parameters), report.reason)
        raise NoSteadyState(message, advice=_advice(steady))
    if steady.distorted():
        new_mesh(steady)


def _from_spheres(steady: SteadySolver) -> Report:
    """Solve from undeformed spheres, at the present parameters or with stiffer particles."""
    wanted, liquid = steady.parameters, steady.parameters.liquid
    # With a thinning liquid, flow through a narrow gap is found from a liquid at rest, flow past a single large sphere
    # from the developed flow.
    thinning = not liquid.has_memory and not liquid.newtonian
    for at_rest in (True, False) if thinning else (False,):
        place_undeformed(steady, at_rest=at_rest)
        for factor in STIFFER if any(wanted.Ca_es) else (1.0,):
            steady.forget()
            report = steady.solve(wanted.softer(factor))
            if report.converged:
                return report
    return report


def new_mesh(steady: SteadySolver, *, afresh: bool = False) -> None:
    """Solve at the same parameters on a new mesh.

    Args:
        steady: The scene, at a solution.
        afresh: Whether a mesh around undeformed spheres is tried even if an earlier one was too distorted.

    Raises:
        NoSteadyState: No solution was found on the new mesh.
        MeshFailure: The mesh could not be generated.
    """
    steady.remesh(afresh=afresh)
    report = solve_on_mesh(steady, steady.parameters, steady.y)
    if not report.converged and steady.parameters.liquid.has_memory:
        report = relax(steady, steady.parameters)
    if not report.converged:
        message = Message("no solution was found after remeshing{}: {}", place(steady.parameters), report.reason)
        raise NoSteadyState(message, advice=IN_TIME)


def reach(steady: SteadySolver, tangent: Array, rates: Array) -> float:
    """Largest step along a tangent at which distances, shapes and fields of the liquid change by no more than allowed.

    Args:
        steady: The scene, at a solution.
        tangent: Derivative of y along the line, shape (n_y,).
        rates: Derivatives of the distances along the line, shape (N-1,).
    """
    fields = steady.constraints.fields
    step = min(
        (MOST_APART * d / abs(rate) for d, rate in zip(steady.parameters.gaps, rates, strict=True) if rate),
        default=np.inf,
    )
    limits = {field.unknowns: field.most_change for field in steady.parameters.liquid.fields}
    limits["h"] = MOST_SHAPE * max(steady.problem.betas, default=0.0)
    for name, most in limits.items():
        rate = tangent[fields[name]] if name in fields else np.empty(0)
        if rate.size and (largest := float(np.abs(rate).max())) > 0:
            step = min(step, most / largest)
    return float(step)


def follow(steady: SteadySolver, target: Parameters) -> Ended | None:
    """Continue the solution of a scene to other parameters, with tangent predictors.

    Args:
        steady: The scene, at a solution. It is left at the target, or at the last solution if the target is not
            reached.
        target: Parameters to reach.

    Returns:
        None if the target is reached; otherwise the reason why not, which is the end of the branch or a failure of
        Newton's method. Its message contains the parameters reached.

    Raises:
        NoSteadyState: The matrix is singular, or there is no developed flow.
        SpentOnTheWay: The time given to the computation is over.
    """
    way: list[Passed] = []
    try:
        return _continued(steady, target, way)
    except BudgetSpent as spent:
        on_the_way = SpentOnTheWay(spent.message, advice=spent.advice)
        on_the_way.way = way
        raise on_the_way from spent


def _continued(steady: SteadySolver, target: Parameters, way: list[Passed], *, sharpens: bool = False) -> Ended | None:
    """Continue as `follow` does, and append the solutions passed to `way`.

    With `sharpens` this is the continuation of `solve_on_mesh` from a rounder kink of the stress to the one wanted,
    which must not try rounder kinks again on its own new meshes.
    """
    start = steady.parameters
    if start == target:
        return None
    along = partial(start.towards, target)
    refused: Text = ""
    tau, longest, relaxed = 0.0, _first_step(start, target), 0
    trail: deque[tuple[float, Snapshot]] = deque(maxlen=LAST)
    while tau < 1.0:
        here = steady.linearise()
        trail.append((tau, steady.snapshot))
        way.append(Passed.of(steady))
        steady.problem.monitor.at(where(steady.parameters))
        if replace(start, gaps=target.gaps) == target:
            tangent = np.subtract(target.gaps, start.gaps) @ here.gap_tangents
        else:
            tangent = here.tangent(lambda change, at=tau: along(at + change))  # type: ignore[misc]
        step = min(longest, reach(steady, tangent, np.subtract(target.gaps, start.gaps)))
        if step > 0.9 * (1.0 - tau):
            step = 1.0 - tau
        while True:
            to = 1.0 if tau + step > 1 - 1e-9 else tau + step
            there, before = along(to), steady.snapshot
            try:
                guess = prepared(steady, there, steady.y + (to - tau) * tangent)
                if _far(before.parameters, there):
                    steady.forget()
                new = guess is steady.y and not sharpens  # as interpolated to a new mesh
                report = solve_on_mesh(steady, there, guess, new=new)
                refused = report.reason
                if report.converged:
                    longest = step * _growth(report.iterations, kinked=bool(target.liquid.regularisation))
                    relaxed = 0
                    break
            except MeshFailure as failure:
                refused = failure.sentence
            steady.recall(before)
            step /= 3
            if step < SMALLEST:
                found = _end(steady, along, trail, refused)
                if steady.parameters != way[-1].parameters:  # a solution nearer to the end was found
                    way.append(Passed.of(steady))
                remembers, relaxed = target.liquid.has_memory, relaxed + 1
                if found.proven or not remembers or relaxed > MOST_RELAXED or not relax(steady, there).converged:
                    return replace(found, way=[*way], last=steady)
                longest = 3 * SMALLEST
                break
        tau = to
    return None


def solve_on_mesh(steady: SteadySolver, there: Parameters, guess: Array, *, new: bool = True) -> Report:
    """Solve at given parameters; if that fails on a new mesh, solve with a rounder kink of the stress first.

    From the solution with the rounder kink, continuation in the regularisation leads to the one wanted.

    Args:
        steady: The scene.
        there: Parameters at which to solve.
        guess: First guess, shape (n_y,).
        new: Whether the mesh is new, and the guess was interpolated to it.
    """
    report = steady.solve(there, guess)
    for factor in ROUNDER if new and there.liquid.regularisation and not report.converged else ():
        rounder = steady.solve(there.less_regularised(factor), guess)
        if rounder.converged:
            arrived = _continued(steady, there, [], sharpens=True) is None
            return replace(rounder, converged=arrived, reason="converged" if arrived else report.reason)
    return report


def _first_step(start: Parameters, target: Parameters) -> float:
    """Largest first step, as a fraction of the way."""
    name = target.liquid.regularisation
    sharper = target.liquid.numbers[name] / start.liquid.numbers[name] if name else 1.0
    return min(1.0, math.log(FIRST_SHARPER) / abs(math.log(sharper))) if sharper != 1.0 else 1.0


def _growth(iterations: int, *, kinked: bool) -> float:
    """Factor of the next step after a number of Newton iterations; a stress with a kink usually takes more of them."""
    more = OF_KINK if kinked else 1
    if iterations <= more * FEW_ITERATIONS:
        return 2.0
    return 1.0 if iterations < more * MANY_ITERATIONS else 0.5


def _far(here: Parameters, there: Parameters) -> bool:
    """Whether a step is so long that the matrix of the last solution is of no use at the new parameters."""
    pairs = zip(*((*at.gaps, *at.Ca_es, *at.liquid.numbers.values()) for at in (here, there)), strict=True)
    return any(max(old / new, new / old) > FAR for old, new in pairs if old and new)


def _end(
    steady: SteadySolver, along: Callable[[float], Parameters], trail: deque[tuple[float, Snapshot]], refused: Text
) -> Ended:
    """Why the continuation stopped: because of an end of the branch or, if none is found, for the reason `refused`."""
    target, end = along(1.0), None
    if any(target.Ca_es):
        with suppress(MeshFailure, NoSteadyState):
            end = end_after(steady, trail)
            while end is not None and end.kind == "fold" and _closer(steady, along, trail, end.at):
                end = end_after(steady, trail)
    steady.recall(trail[-1][1])
    if end is None:
        both = place(target, " to "), place(steady.parameters)
        message = Message("the continuation{} stopped{}: {}", *both, refused)
        return Ended(NoSteadyState(message, advice=_advice(steady)))
    there, off = _numbers(along(end.at)), _numbers(along(end.at + end.error))
    at = {name: (value, abs(off[name] - value)) for name, value in there.items()}
    return ended(end.kind, at, target, MESH_SPREAD)


def _closer(
    steady: SteadySolver, along: Callable[[float], Parameters], trail: deque[tuple[float, Snapshot]], fold: float
) -> bool:
    """Append a solution nearer to a fold to `trail`; False if the last one is near enough, or none is found.

    Args:
        steady: The scene.
        along: Parameters as a function of the fraction of the way.
        trail: The last solutions with their places on the way, in order.
        fold: Place of the fold on the way.
    """
    tau, last = trail[-1]
    step = CLOSER * (fold - tau)
    if step < NEAR_ENOUGH * fold:
        return False
    steady.recall(last)
    tangent = steady.linearise().tangent(lambda change: along(tau + change))
    guess = steady.y + step * tangent
    if not steady.solve(along(tau + step), guess).converged:
        return False
    trail.append((tau + step, steady.snapshot))
    return True


KINDS = {"De": PURE, "Ca_e": PURE, "d": LENGTH}  # of the parameters of a continuation
WHY = {
    "fold": "in a fold",
    "wrinkles": "where the surface of a particle is compressed so much that it wrinkles",
}


def ended(kind: str, at: Mapping[str, tuple[float, float]], target: Parameters, spread: float) -> Ended:
    """The end of a branch as the outcome of a continuation; not proven if the target is within its error.

    Args:
        kind: See `EstimatedEnd`.
        at: Parameters at the end by name, each with its error on the mesh at hand, which is 0 for a parameter that does
            not change.
        target: The parameters wanted.
        spread: Additional error due to differences between meshes, relative to the parameter.
    """
    known = {name: (value, error and error + spread * value) for name, (value, error) in at.items()}
    places = [Message("{} = {}", name, KINDS[name](value, error=error)) for name, (value, error) in known.items()]
    said, wanted = Message("steady states end at {}, {}", Message.joined(", ", places), WHY[kind]), _numbers(target)
    if all(abs(wanted.get(name, 0.0) - value) <= error for name, (value, error) in known.items()):
        unknown = Message("{}; whether they reach {} is not known", said, where(target))
        return Ended(NoSteadyState(unknown, advice=IN_TIME), kind, at, known)
    return Ended(BranchEnd(Message("{}, and do not reach {}", said, where(target))), kind, at, known)


def _numbers(parameters: Parameters) -> dict[str, float]:
    """The parameters that are not 0, by name: De, the largest Ca_e of the particles, and the smallest distance."""
    found = {"De": parameters.De, "Ca_e": max(parameters.Ca_es, default=0.0), "d": min(parameters.gaps, default=0.0)}
    return {name: value for name, value in found.items() if value}


def prepared(steady: SteadySolver, there: Parameters, guess: Array) -> Array:
    """Prepare the mesh for a predicted solution: remesh if the predicted state would distort the present mesh too much.

    Args:
        steady: The scene.
        there: Parameters of the predicted solution.
        guess: Predicted unknowns on the present mesh, shape (n_y,).

    Returns:
        The predicted unknowns on the present or the new mesh.

    Raises:
        MeshFailure: A cell is inverted in the predicted state, or no new mesh could be generated.
    """
    if steady.folded(there, guess):
        raise MeshFailure("a cell is inverted in the predicted state")
    if steady.distorted(there, guess):
        steady.remesh(there, guess)
        return steady.y
    return guess


def _advice(steady: SteadySolver) -> str:
    return IN_TIME if steady.problem.drive.free else ON_OTHER_CELLS


def place(parameters: Parameters, before: str = " at ") -> Text:
    """Parameters in words, including those of the viscosity law, preceded by `before`; "" where there are none."""
    of_viscosity = [f"{name} = {value:.4g}" for name, value in parameters.liquid.solvent.numbers.items()]
    said: list[Text] = [*of_viscosity, *each_of(parameters)]
    return before + Message.joined(", ", said) if said else ""


def where(parameters: Parameters) -> Message:
    """Parameters in words, such as "De = 1, Ca_e = 0.1, d = 0.05"."""
    return Message.joined(", ", each_of(parameters))


def each_of(parameters: Parameters) -> tuple[Message, ...]:
    """In words, each of the parameters that is not 0, such as "De = 1" and "d = 0.05"."""
    values = {"De": (parameters.De,) if parameters.De else (), "Ca_e": parameters.Ca_es, "d": parameters.gaps}
    return tuple(
        Message("{} = {}", name, KINDS[name](dict.fromkeys(each), ".5g")) for name, each in values.items() if any(each)
    )
