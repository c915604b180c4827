"""The size of a quantity elsewhere on a curve, from solutions on coarse cells, which are called scouts.

Errors are compared with the largest |dU| of a curve, although a case may request a single point of it. A scout begins
with the solution at that point, carried over to coarse cells, and continues to other distances.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.runtime.errors import BudgetSpent, MeshFailure, NoSteadyState
from pairsim.solvers.goals import Goal
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.continuation import prepared
from pairsim.solvers.steady.first_solution import first_scene, try_from_other_mesh
from pairsim.solvers.steady.scene import SteadySolver

# Constants without another origin were chosen.
ENOUGH = 3  # number of distances of a case from which on the scout solves at some of these only
# Distances at which it solves otherwise [D_c]. In ten cases (beta .2 to .6, De 0 to 2) the largest |dU| at these was 83
# to 100 % of the largest of the curve.
SCALE_DISTANCES = 0.4, 0.2, 0.1
SCALE_CELLS = 10  # cells of a scout on a half-circle
SCALE_GROWTH = 0.3  # growth of its cells
SCALE_SIZE = 0.35  # size of its largest cells, relative to the smallest diameter
STEP = 1.6  # largest ratio by which a distance changes in one of its steps


def largest_value(goal: Goal, known: SteadySolver, places: Sequence[tuple[float, ...]], enough: float) -> float:
    """Estimate the largest absolute value of a goal, such as dU, on the curve of a case, by solutions on coarse cells.

    Args:
        goal: dU, or another goal that is linear in the unknowns.
        known: A solver at a solution of the curve.
        places: The distances of the points of the case [D_c]. If these are few, other ones are tried, too.
        enough: Value beyond which no larger one is looked for.

    Returns:
        The largest value that was found; 0 if there was no solution on coarse cells.
    """
    problem, parameters = known.problem, known.parameters
    here, wanted = parameters.gaps, {*places, parameters.gaps}
    if len(wanted) < ENOUGH:
        # Distances are widened only as far as meshes for them fit into the tube.
        others = {tuple(d for _ in here) for d in SCALE_DISTANCES}
        room = problem.length - sum(problem.betas) - max(map(sum, wanted))
        wanted |= {o for o in others if sum(o) - max(map(sum, wanted)) < room / 4}
    else:
        wanted = {min(wanted, key=lambda gaps: abs(np.log(sum(gaps) / len(gaps) / d))) for d in SCALE_DISTANCES}
    size = max(problem.mesh.max_size, SCALE_SIZE * min(problem.betas))
    cells = MeshSettings(Np=SCALE_CELLS, growth=SCALE_GROWTH, max_size=size, rows=problem.mesh.rows)
    coarse, found = replace(problem, mesh=cells), 0.0
    scout = carried_over(coarse, parameters, known)
    if scout is None:  # for very soft particles far apart Newton's method may fail from a solution on fine cells
        for gaps in sorted(wanted - {here}, reverse=True):
            if found < enough:
                found = max(found, _largest_anew(goal, coarse, replace(parameters, gaps=gaps)))
        return found
    try:
        start, found = scout.snapshot, _largest(goal, scout)
        wider = sorted(gaps for gaps in wanted if gaps > here)
        narrower = sorted((gaps for gaps in wanted if gaps < here), reverse=True)
        for side in (wider, narrower):
            with suppress(NoSteadyState, MeshFailure):  # soft particles at the narrowest distances
                for gaps in side:
                    if found >= enough or not _moved(scout, gaps):
                        break
                    found = max(found, _largest(goal, scout))
            scout.recall(start)
        return found
    finally:
        scout.close()


def carried_over(problem: SteadyProblem, parameters: Parameters, known: SteadySolver) -> SteadySolver | None:
    """The solution on other cells; None unless Newton's method converges from the interpolated solution.

    If it does not, no continuation is tried, which might take longer than the solution is worth.
    """
    found, solver = False, None
    try:
        with suppress(NoSteadyState, MeshFailure):
            solver = SteadySolver(problem, parameters)
            found = try_from_other_mesh(solver, parameters, known)
    finally:  # also of a budget that is spent
        if solver is not None and not found:
            solver.close()
    return solver if found else None


def found_anew(problem: SteadyProblem, parameters: Parameters) -> SteadySolver | None:
    """A solution that is found without an earlier one; None if none is found."""
    with suppress(NoSteadyState, MeshFailure):
        found = first_scene(problem, parameters)
        return found if isinstance(found, SteadySolver) else None
    return None


def found_within(seconds: float, problem: SteadyProblem, parameters: Parameters) -> SteadySolver | None:
    """A solution that is found without an earlier one; None if none is found in this processor time [s].

    The time is that of the processor, so that what is found does not depend on the load of the machine. It is not
    limited where the computation has a budget, until which the search may go on.

    Raises:
        BudgetSpent: The budget of the computation is spent.
    """
    if problem.monitor.left is not None:
        return found_anew(problem, parameters)
    monitor = problem.monitor.within(seconds, "it was not found within {}", of_processor=True)
    solver = None
    with suppress(BudgetSpent):
        solver = found_anew(replace(problem, monitor=monitor), parameters)
    if solver is not None:
        solver.problem = problem
    return solver


def _largest_anew(goal: Goal, problem: SteadyProblem, parameters: Parameters) -> float:
    """The largest absolute value of a goal at a solution found without an earlier one; 0 if none is found."""
    found = found_anew(problem, parameters)
    if found is None:
        return 0.0
    largest = _largest(goal, found)
    found.close()
    return largest


def _moved(scout: SteadySolver, gaps: tuple[float, ...]) -> bool:
    """Continue to other distances in steps of at most `STEP`; False if one fails, as shorter ones may take long."""
    here = np.array(scout.parameters.gaps)
    count = int(np.ceil(np.abs(np.log(np.divide(gaps, here))).max() / np.log(STEP)))
    for part in np.arange(1, count + 1) / count:
        there = replace(scout.parameters, gaps=tuple(map(float, here ** (1 - part) * np.array(gaps) ** part)))
        step = np.subtract(there.gaps, scout.parameters.gaps) @ scout.linearise().gap_tangents
        scout.forget()
        if not scout.solve(there, prepared(scout, there, scout.y + step)).converged:
            return False
    return True


def _largest(goal: Goal, scout: SteadySolver) -> float:
    """The largest absolute value of a goal, such as dU, at a solution."""
    return float(np.abs(goal.linear_value(scout.solution)).max())
