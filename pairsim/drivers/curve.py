"""`pairsim curve`: compute the master curve of a case and write it to a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pairsim.config.curve_case import CurveCase
from pairsim.config.form_kinds import forms_of
from pairsim.drivers.adaptive import Adaptation
from pairsim.drivers.curve_output import CurveOutput
from pairsim.drivers.outcome import Outcome
from pairsim.drivers.problems import solution_order, steady_problem
from pairsim.drivers.quasi_steady import conclude, error_at, kept, moving_errors
from pairsim.drivers.session import Options, Session, open_session
from pairsim.drivers.warnings import ErrorAt, far_apart, large_errors
from pairsim.fem.form_cache import ensure_compiled
from pairsim.runtime.errors import NoSteadyState, RunFailure
from pairsim.solvers.curves.branch import Branch, Point
from pairsim.solvers.curves.curve import ROUNDING, Zero, equilibria, find_zeros, interpolants, trace
from pairsim.solvers.curves.distances import between
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.continuation import where


class WarmStart:
    """Keeps the solvers of a curve, so that the next curve can start from its solutions."""

    def __init__(self) -> None:
        self._branch: Branch | None = None
        self._kind: tuple[Any, ...] = ()

    def start(self, problem: SteadyProblem, first: Parameters, mesh_error: bool, sensitivities: bool) -> Branch:
        """A branch at the first point of a curve, continued from the previous curve if possible, else solved anew.

        Args:
            problem: The problem of the curve.
            first: Parameters of its first point.
            mesh_error: Whether to solve on a coarser mesh, too.
            sensitivities: Whether to compute derivatives by the parameters.

        Raises:
            NoSteadyState: There is no solution at the first point.
        """
        laws = first.liquid.structure, [solid and solid.name for solid in first.solids]
        old, self._kind = self._kind, (problem, laws, mesh_error, sensitivities)
        if self._branch is not None and self._kind == old:  # only distances and parameters of materials differ
            try:
                self._branch.move(first)
                return self._branch
            except NoSteadyState:
                pass
        self.close()
        self._branch = Branch(problem, first, mesh_error, sensitivities)
        return self._branch

    def replace(self, branch: Branch) -> None:
        """Keep another branch, from which no other curve is continued, until it is closed."""
        self.close()
        self._branch, self._kind = branch, ()

    def close(self) -> None:
        """Free the memory of the solvers; the next curve is solved from undeformed spheres."""
        if self._branch is not None:
            self._branch.close()
        self._branch = None


def run_curve(
    case: CurveCase,
    directory: Path,
    options: Options,
    *,
    sensitivities: bool = False,
    warm_start: WarmStart | None = None,
) -> Outcome:
    """Compute a master curve and write it to a folder.

    Args:
        case: The validated case.
        directory: Folder for the results.
        options: Overwriting, progress and signals.
        sensitivities: Compute the derivatives of dU with respect to Ca_e, De and beta, too.
        warm_start: Solutions of the previous curve to start from; keeps those of this curve. The caller closes it.

    Returns:
        How the command ended. Points solved before a failure are in the folder, too.

    Raises:
        InputError: The folder exists and may not be overwritten, or another command is writing to it.
        WriteFailure: The first files of the folder cannot be written.
    """
    own = WarmStart()
    with open_session(case, directory, options) as session:
        try:
            outcome = _run(case, session, sensitivities, warm_start or own)
        finally:
            own.close()
        if warm_start is not None and outcome.status != "finished":
            warm_start.close()
        session.reporter.finish(outcome.message)
        return outcome


def _run(case: CurveCase, session: Session, sensitivities: bool, warm_start: WarmStart) -> Outcome:
    """Solve the points of the curve and, for a pair, its zeros."""
    session.write(lambda: session.record.write(None, {}, {}))
    places = solution_order(case)
    expected = len(between(places, case.max_points)) if case.common else len(places)
    goal = f"{expected} point{'s' * (expected > 1)}, more as needed"
    session.announce(goal, expected)
    output = CurveOutput(case, session, expected, sensitivities)
    branch: Branch | None = None
    adaptation: Adaptation | None = None

    def work() -> Outcome:
        nonlocal branch, adaptation
        ensure_compiled(forms_of(case), session.reporter.note)
        start = Parameters(places[0], case.solid_models, case.liquid_model)
        narrowest = min((d for place in places for d in place), default=np.inf)
        problem = steady_problem(case, narrowest)
        if case.adapts:
            options: Any = {"sensitivities": sensitivities, "mesh_error": case.mesh_error}
            adaptation = Adaptation.begin(case, problem, start, places, **options)
        if adaptation is not None:
            branch = adaptation.branch
            warm_start.replace(branch)
        else:
            branch = warm_start.start(problem, start, case.mesh_error, sensitivities)
        for point, wanted in trace(branch, places, case.tol, case.max_points):
            output.take(point, wanted, branch.fine)
        message = f"{len(output.points)} points"
        if case.n == 2 and case.velocity is None:
            message += f"; dU = 0: {_find_zeros(branch, output) or 'at no d'}"
        return Outcome("finished", "end", message)

    def finish() -> Outcome:
        output.finish()
        return outcome

    outcome = session.carry_out(work, kept)
    finished = session.carry_out(finish, kept)
    outcome = finished if outcome.status == "finished" else outcome
    points = output.points
    summary: dict[str, Any] = {"points": len(points)}
    warnings = [*output.warnings, *(_large_errors if case.velocity is None else _large_force_errors)(case, points)]
    if adaptation is not None:
        summary["adaptation"], missed = adaptation.report(points, adaptation.size(points))
        warnings += missed
    return conclude(case, session, outcome, branch, points, warnings, summary)


def _large_errors(case: CurveCase, points: list[Point]) -> list[str]:
    """Warnings of large errors of dU, at the points and between them, relative to the largest |dU| of the curve."""
    curves = interpolants(points) if case.common and len(points) > 1 else []
    values = [abs(dU) for point in points for dU in point.dUs] + [abs(curve.peak.dU) for curve in curves]
    peak = max(values, default=0.0)
    if peak < ROUNDING:
        return []
    errors = [error_at(point, gap, peak) for point in points for gap in range(len(point.gaps))]
    return [
        *large_errors(case, "dU_error", "the largest |dU|", errors),
        *moving_errors(case, points, peak),
        *far_apart(case, curves, peak),
    ]


def _large_force_errors(case: CurveCase, points: list[Point]) -> list[str]:
    """Warnings of large errors of the forces that move the particles, relative to themselves."""
    errors = [
        ErrorAt(float(error / abs(F)), where(point.parameters), 0.0, False)
        for point in points
        for F, error in zip(point.observation.F, point.estimate.F_error, strict=True)
        if F
    ]
    return large_errors(case, "F_error", "F", errors)


def _find_zeros(branch: Branch, output: CurveOutput) -> str:
    """Find and write the zeros of the curve of a pair; returns a summary, empty if there are none."""
    points = output.points
    zeros: list[Zero] = []
    try:
        for found in find_zeros(branch, points):
            if isinstance(found, Zero):
                zeros.append(found)
            else:
                output.warnings.append(found.message)
    except RunFailure:  # keep the zeros found so far
        output.take_zeros(equilibria(zeros, points))
        raise
    result = equilibria(zeros, points)
    output.take_zeros(result)
    return ", ".join(
        f"{'stable' if z.stable else 'unstable'} at d = {z.d:.5g}{'' if z.certain else ' (uncertain)'}" for z in result
    )
