"""Turn a validated case into the problem for a solver."""

from __future__ import annotations

from math import inf

from pairsim.cases.case import FREE_ENDS, SceneCase
from pairsim.cases.run_case import Case
from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.problems import Problem, Setup, SteadyProblem
from pairsim.solvers.stepping.step_size import StepControl

SMALLEST_STEP = 1e-8
STEPS_PER_PERIOD = 16  # least number in a period of a varying flow, so that results always show its cycle


def mesh_settings(case: SceneCase) -> MeshSettings:
    """The cell sizes of a case, without adaptation."""
    return MeshSettings(**case.mesh.model_dump(exclude={"adapt"}))


def _setup_of(case: SceneCase, monitor: Monitor | None) -> Setup:
    """The part of the problem that runs and quasi-steady solutions of a case share."""
    return Setup(
        betas=case.betas,
        length=case.tube_length,
        periodic=case.ends != "developed",
        mesh=mesh_settings(case),
        drive=case.drive,
        closed=case.closed,
        monitor=monitor or Monitor(),
    )


def problem_of(case: Case, monitor: Monitor | None = None) -> Problem:
    """The problem of a run in time, with the monitor of its computation."""
    time_options, drive = case.time, case.drive
    largest, longest = max(case.betas, default=0.0), time_options.max_step
    if drive.waveform is not None and drive.waveform.period is not None:
        longest = min(longest, drive.waveform.period / STEPS_PER_PERIOD)
    accuracy = case.error_wanted if drive.varies and case.n > 1 and case.limits.drift else None
    return _setup_of(case, monitor).of_kind(
        Problem,
        solids=case.solid_models,
        gaps=case.gaps,
        control=StepControl(time_options.tol, SMALLEST_STEP, longest, time_options.fixed_step),
        first_step=time_options.first_step,
        liquid=case.liquid_model,
        t_end=time_options.end,
        min_gap=case.limits.min_gap,
        max_gap=case.limits.max_gap,
        least_room=-inf if case.closed else FREE_ENDS,
        dU_error=case.estimates_error,
        from_steady=case.start == "steady" and drive.flow != 0,
        held=case.hold and case.n > 1,
        U_m=2 * (1 - 2 / 3 * largest**2),  # Faxen's law without wall corrections
        until_known=accuracy,
    )


def steady_problem(case: SceneCase, narrowest: float, monitor: Monitor | None = None) -> SteadyProblem:
    """The quasi-steady problem of a case: all that is constant along a curve.

    Args:
        case: The case.
        narrowest: Smallest distance of the curve, which sets the cells on the particles [D_c].
        monitor: The monitor of the computation.
    """
    volume_modulus = case.n == 1 and not case.closed
    return _setup_of(case, monitor).of_kind(SteadyProblem, narrowest=narrowest, volume_modulus=volume_modulus)
