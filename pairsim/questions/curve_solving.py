"""The computation of `pairsim curve`: quasi-steady solutions over the distance, and their zeros."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from pairsim.config.curve_case import CurveCase
from pairsim.questions import events
from pairsim.questions.adaptive import adaptation_report
from pairsim.questions.outcome import Outcome
from pairsim.questions.problems import solution_order, steady_problem
from pairsim.questions.steady import Solutions, health_columns, moving_errors, point_row
from pairsim.questions.warm_start import WarmStart
from pairsim.questions.warnings import ErrorAt, far_apart, large_errors
from pairsim.results.columns import EQUILIBRIA_COLUMNS, curve_columns
from pairsim.results.fields import SteadyMoment, frame
from pairsim.results.xdmf import FieldFrame
from pairsim.runtime.errors import RunFailure
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.curves.adaptation import ENOUGH
from pairsim.solvers.curves.branch import Branch, Point
from pairsim.solvers.curves.curve import ROUNDING, Equilibrium, Zero, equilibria, find_zeros, interpolants, trace
from pairsim.solvers.curves.distances import between
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.continuation import where
from pairsim.solvers.steady.scene import SteadySolver


def solve(
    case: CurveCase, *, monitor: Monitor, sensitivities: bool = False, warm_start: WarmStart | None = None
) -> events.Events:
    """Compute a master curve and, for a pair, its zeros.

    Args:
        case: The validated case.
        monitor: Ends the computation.
        sensitivities: Compute the derivatives of dU with respect to Ca_e, De and beta, too.
        warm_start: Solutions of the previous curve to start from; keeps those of this curve. The caller closes it.
    """
    places = solution_order(case)
    expected = len(between(places, case.max_points)) if case.common else len(places)
    yield events.Begin(f"{expected} point{'s' * (expected > 1)}, more as needed", expected)
    with Solutions(case, warm_start) as found:
        points, warnings = found.points, list[str]()
        yield events.AtEnd(partial(_end, case, found, warnings))
        start = Parameters(places[0], case.solid_models, case.liquid_model)
        narrowest = min((d for place in places for d in place), default=np.inf)
        problem = steady_problem(case, narrowest, monitor)
        branch = found.begin(problem, start, places=places, sensitivities=sensitivities)
        yield events.Table("curve", _columns(case, sensitivities), ascending=case.common)
        for point, wanted in trace(branch, places, case.tol, case.max_points):
            points.append(point)
            if case.common:
                points.sort(key=lambda p: p.d)
            count = len(points)
            yield events.Row("curve", point_row(point) | {"wanted": float(wanted)})
            if any(abs(point.d - d) < 1e-9 * d for d in case.fields):
                yield events.Frame(_frame(point.d, branch.solver))
            yield events.Progress(min(count, expected), _shown(point, count), count)
        message = f"{len(points)} points"
        if case.n == 2 and case.velocity is None:
            zeros = yield from _zeros(branch, points, warnings)
            message += f"; dU = 0: {', '.join(map(_said, zeros)) or 'at no d'}"
        return Outcome("finished", "end", message)
    return found.outcome  # the branch ends before all distances were reached


def _columns(case: CurveCase, sensitivities: bool) -> list[str]:
    """The columns of curve.csv."""
    parameters = [name for name, value in (("Ca_e", max(case.Ca_es)), ("De", case.De), ("beta", 1.0)) if value]
    parameters = parameters if sensitivities else []
    columns = curve_columns(case.n, case.common, parameters, case.velocity is not None)
    return [*columns, *health_columns(case)]


def _shown(point: Point, count: int) -> str:
    """A line of progress for a point."""
    o = point.observation
    gaps = f"d = {', '.join(f'{d:.5f}' for d in point.gaps)}  " if point.gaps else ""
    if len(o.F):
        name, values = "F", ", ".join(f"{F:.6g}" for F in o.F)
    elif o.U.size > 1:
        name, values = "dU", ", ".join(f"{dU:+.4e}" for dU in o.dU)
    else:
        name, values = "U", f"{o.U[0]:.6f}"
    return f"{gaps}{name} = {values}  Newton {point.newton}  point {count}"


def _frame(d: float, solver: SteadySolver) -> FieldFrame:
    """The fields of the present solution."""
    (h, x), flow = solver.state(), solver.developed_flow
    moment = SteadyMoment(d, solver.scene, x, h, solver.constraints.V @ solver.y)
    return frame(moment, solver.h_star(solver.parameters), flow)


def _last_shapes(solver: SteadySolver) -> FieldFrame:
    """The fields of the last solution on the way to parameters that were not reached."""
    solver.reopen()
    try:
        return _frame(min(solver.parameters.gaps), solver)
    finally:
        solver.close()


def _zeros(
    branch: Branch, points: list[Point], warnings: list[str]
) -> Generator[events.Event, None, Sequence[Equilibrium]]:
    """Find the zeros of the curve of a pair; those found before a failure are written, too."""
    zeros: list[Zero] = []
    failure: RunFailure | None = None
    try:
        for found in find_zeros(branch, points):
            if isinstance(found, Zero):
                zeros.append(found)
            else:
                warnings.append(found.message)
    except RunFailure as error:
        failure = error
    result = equilibria(zeros, points)
    yield events.Table("equilibria", EQUILIBRIA_COLUMNS, [vars(zero) | {"stable": zero.stable} for zero in result])
    if failure is not None:
        raise failure
    return result


def _said(zero: Equilibrium) -> str:
    """A zero in words."""
    kind = "stable" if zero.stable else "unstable"
    return f"{kind} at d = {zero.d:.5g}{'' if zero.certain else ' (uncertain)'}"


def _end(case: CurveCase, found: Solutions, warnings: list[str]) -> Iterator[events.Event]:
    """What run.json says, and the fields of the last state on a way that has not arrived."""
    points, entries = found.points, dict[str, Any](points=len(found.points))
    if case.velocity is not None:
        warnings = [*warnings, *_large_force_errors(case, points)]
    elif found.branch is not None and case.n > 1 and points:
        curves = interpolants(points) if case.common and len(points) > 1 else []
        size = max(abs(curve.peak.dU) for curve in curves) if len(points) >= ENOUGH and curves else found.branch.dU
        reported = adaptation_report(case, found.branch, points, [size] * len(points), f"the largest |dU| ({size:.3g})")
        entries["adaptation"], missed = reported
        entries["adaptation"]["reference_dU"] = size
        moved = moving_errors(case, points, size) if size > ROUNDING else []
        warnings = [*warnings, *missed, *moved, *(far_apart(case, curves, size) if size > ROUNDING else [])]
    yield from found.last_events(entries, warnings)
    if found.ended is not None and found.ended.last is not None and case.n > 1:
        yield events.Frame(_last_shapes(found.ended.last))


def _large_force_errors(case: CurveCase, points: list[Point]) -> list[str]:
    """Warnings of large errors of the forces that move the particles, relative to themselves."""
    errors = [
        ErrorAt(float(error / abs(F)), where(point.parameters), 0.0)
        for point in points
        for F, error in zip(point.observation.F, point.estimate.F_error, strict=True)
        if F
    ]
    return large_errors(case, "F_error", "F", errors)
