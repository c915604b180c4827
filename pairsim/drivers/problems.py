"""The problem that a solver is given, from a validated case."""

from __future__ import annotations

from pairsim.config.case import Case, SceneCase
from pairsim.config.curve_case import CurveCase
from pairsim.fem.geometry import MeshSettings
from pairsim.solvers.problems import Problem, SteadyProblem
from pairsim.solvers.step_size import StepControl

SMALLEST_STEP = 1e-8


def problem_of(case: Case) -> Problem:
    """The transient problem of a validated case."""
    time_options = case.time
    largest = max(case.betas, default=0.0)
    return Problem(
        case.betas,
        case.Ca_es,
        case.gaps,
        case.tube_length,
        case.ends == "periodic",
        MeshSettings(**case.mesh.model_dump()),
        StepControl(time_options.tol, SMALLEST_STEP, time_options.max_step, time_options.fixed_step),
        time_options.first_step,
        polymer=case.polymer,
        t_end=time_options.end,
        U_m=2 * (1 - 2 / 3 * largest**2),  # Faxen's law without wall corrections: only a first guess
    )


def steady_problem(case: SceneCase, narrowest: float) -> SteadyProblem:
    """The part of a validated case that stays along its curve, whose least distance is `narrowest`."""
    settings = MeshSettings(**case.mesh.model_dump())
    return SteadyProblem(case.betas, case.tube_length, case.ends == "periodic", settings, case.law, narrowest=narrowest)


def solution_order(case: CurveCase) -> list[tuple[float, ...]]:
    """The places in the order in which they are solved: from the widest distance down, where the start is easy."""
    places = case.places
    if case.common:
        wanted = {place[0] for place in places} | set(case.fields)
        return [(d,) * (case.n - 1) for d in sorted(wanted, reverse=True)]
    return places
