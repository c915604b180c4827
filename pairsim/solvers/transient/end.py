"""Why a run ends, and the quasi-steady solution at its last distances, which it approaches."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from typing import Literal

from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.curves.point import Point
from pairsim.solvers.problems import Problem
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.steady.first_solution import first_scene
from pairsim.solvers.stepping.step_size import reached
from pairsim.solvers.transient.cycles import Cycles
from pairsim.solvers.transient.start import steady_scene

Reason = Literal["contact", "max_gap", "tube_too_short", "periodic", "end"]


def reason_to_end(problem: Problem, t: float, gaps: Sequence[float], cycles: Cycles | None = None) -> Reason | None:
    """Why a run ends at a time and distances; None if it goes on.

    Args:
        problem: The problem of the run.
        t: Time [D_c/U_av].
        gaps: Distances [D_c], N-1 values.
        cycles: Changes of the distances over the cycles of a flow that varies.
    """
    if problem.closed and problem.betas:  # also the distance to the next period, without the effect of the shapes
        gaps = (*gaps, 2 * problem.room(gaps))
    if gaps and min(gaps) < problem.min_gap:
        return "contact"
    if problem.max_gap is not None and gaps and max(gaps) > problem.max_gap:
        return "max_gap"
    if not problem.closed and problem.betas and problem.room(gaps) < problem.least_room:
        return "tube_too_short"
    if cycles is not None and problem.until_known is not None and cycles.are_known(problem.until_known):
        return "periodic"
    return "end" if reached(t, problem.t_end) else None


CREEPS = 10**0.5  # shapes creep if t_relax grows by more than this where the regularisation grows by 10; chosen


def settled_branch(problem: Problem, narrowest: float) -> Branch:
    """Quasi-steady solutions of a run's scene with its cell sizes, beginning with that at its first distances.

    Args:
        problem: The problem of the run.
        narrowest: The smallest distance at which solutions are wanted [D_c].

    Raises:
        NoSteadyState: There is none, or it was not found.
        MeshFailure: A mesh could not be generated.
    """
    steady, parameters = steady_scene(problem, problem.gaps)
    return Branch(arrived(first_scene(replace(steady, narrowest=narrowest), parameters)))


def settled(problem: Problem, gaps: tuple[float, ...]) -> tuple[Point, bool]:
    """The quasi-steady solution of a run's scene with its cell sizes.

    Args:
        problem: The problem of the run.
        gaps: Distances [D_c], N-1 values.

    Returns:
        The solution, and whether disturbances decay by creep alone, in a time that grows with the regularisation m of
        the liquid: without regularisation unyielded liquid would preserve them for ever.

    Raises:
        NoSteadyState: There is none, or it was not found.
        MeshFailure: A mesh could not be generated.
    """
    steady, parameters = steady_scene(problem, gaps)
    with closing(Branch(arrived(first_scene(steady, parameters)))) as branch:
        point, creeps = arrived(branch.at(parameters)), False
        if parameters.liquid.regularisation:
            creeps = point.t_relax > CREEPS * arrived(branch.at(parameters.less_regularised(0.1))).t_relax
        return point, creeps
