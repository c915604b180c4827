"""The points of a master curve, its zeros, and what run.json says at the end."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing

import numpy as np

from pairsim.analysis.master_curve import Curve
from pairsim.analysis.rows_of_points import point_row
from pairsim.cases.differences import differ
from pairsim.cases.inputs import inputs_of
from pairsim.computing import events
from pairsim.computing.found import Found
from pairsim.computing.off_axis.beside import rates_beside
from pairsim.computing.problems import steady_problem
from pairsim.computing.spread_entry import spread_entry
from pairsim.computing.steady import (
    Solutions,
    moving_errors,
)
from pairsim.computing.warnings import finer
from pairsim.quantities.kinds import FORCE, LENGTH, VELOCITY
from pairsim.quantities.text import in_unit
from pairsim.questions.curve import GAP_OF_SLOPE, QUESTION, SLOPES, U_SLOPE, U_SLOPE_HELD, CurveCase
from pairsim.record.column import Column, names_of, table_row
from pairsim.record.columns import (
    DISTANCE,
    DU_HALF,
    DU_QUARTER,
    EQUILIBRIA_COLUMNS,
    FORCES,
    POLYMER_HEALTH,
    SENSITIVITIES,
    SLOPE,
    STABLE,
    WANTED,
    YIELD_HEALTH,
)
from pairsim.record.fields_of_frame import steady_frame
from pairsim.record.run_entries import POINTS
from pairsim.runtime.errors import RunFailure
from pairsim.runtime.message import Message, Text
from pairsim.runtime.monitor import Monitor
from pairsim.runtime.text import counted
from pairsim.solvers.curves.branch import Branch, Point
from pairsim.solvers.curves.curve import Equilibrium, Zero, equilibria, find_zeros, trace
from pairsim.solvers.curves.distances import between
from pairsim.solvers.curves.interpolant import NEGLIGIBLE_DU, CurveInterpolant
from pairsim.solvers.curves.scout import ENOUGH
from pairsim.solvers.curves.sensitivities import STIFFNESS
from pairsim.solvers.goals import DP_PLUS, D, F, Goal, U, dU
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.ends import Ended


def computation(case: CurveCase, monitor: Monitor, sensitivities: bool) -> events.Events:
    """Compute a master curve and, for a pair, its zeros; arguments as for `solve`."""
    places, by = case.in_order, _parameters(case, sensitivities)
    expected = len(between(places, case.max_points)) if case.common else len(places)
    yield events.Begin(f"{expected} point{'s' * (expected > 1)}, more as needed", expected)
    found, remarks = Solutions(case, _goals(case)), list[Text]()
    points = found.points
    try:
        with found:
            start = Parameters(places[0], case.solid_models, case.liquid_model, varied=case.varied)
            narrowest = min((d for place in places for d in place), default=math.inf)
            problem = steady_problem(case, narrowest, monitor)
            branch = found.begin(problem, start, places=places, sensitivities=by)
            if isinstance(branch, Ended):
                return found.outcome_of(branch)
            yield events.Table("curve", _columns(case, by), ascending=case.common)
            sloping = case.n > 2 and case.velocity is None
            if sloping:
                yield events.Table("slopes", SLOPES.named(case.n), ascending=case.common)
            for traced in trace(branch, places, case.tol, case.max_points):
                if isinstance(traced, Ended):
                    return found.outcome_of(traced)
                point, wanted = traced
                points.append(point)
                if case.common:
                    points.sort(key=lambda p: p.d)
                count = len(points)
                own = QUESTION.tables["curve"].own_row(case.n, Found(point, branch.solver))
                yield events.Row("curve", point_row(point) | {WANTED.name: float(wanted)} | own)
                for row in slope_rows(point) if sloping else ():
                    yield events.Row("slopes", row)
                if any(abs(point.d - d) < 1e-9 * d for d in case.fields):
                    yield events.Frame(steady_frame(point.d, branch.solver))
                yield events.Progress(min(count, expected), _shown(point, count), count)
            message = counted(len(points), "point")
            if case.n == 2 and case.velocity is None:
                zeros = yield from _zeros(branch, points)
                if isinstance(zeros, Ended):
                    return found.outcome_of(zeros)
                found_zeros = ", ".join(_said(case, zero) for zero in zeros)
                message += f"; dU = 0: {found_zeros or 'at no d'}"
            if case.focus:
                remarks += yield from _off_axis(case, branch, points, expected)
            return events.Outcome("finished", "end", message)
    finally:
        yield from _end(case, found, remarks)


def _parameters(case: CurveCase, sensitivities: bool) -> list[str]:
    """The parameters by which dU is differentiated: all, or in an experiment the difference of the diameters alone."""
    of_pair, of_spread = case.n == 2 and case.velocity is None, list[str]()
    if case.spread:
        of_spread = ["Ca_e", STIFFNESS] * bool(case.spread.modulus) + ["beta"] * bool(case.spread.diameter)
    if not sensitivities and not any(each.half_width for each in inputs_of(case)):
        difference = ["difference"] if of_pair and (case.physical is not None or case.spread.diameter) else []
        return of_spread + difference
    values = ("Ca_e", max(case.Ca_es)), ("De", case.De), ("xi", case.De and case.xi), ("beta", 1.0)
    known = [name for name, value in values if value] + ["difference"] * of_pair
    if sensitivities and of_pair and all(case.Ca_es) and differ(case):
        known.append(STIFFNESS)
    return known + [name for name in of_spread if name not in known]


def _goals(case: CurveCase) -> Sequence[Goal]:
    """What a curve is computed for."""
    if case.velocity is None and case.n > 1:
        return (dU,)
    first = U if case.velocity is None else F
    return (first, DP_PLUS, D) if any(case.Ca_es) else (first, DP_PLUS)


def _columns(case: CurveCase, parameters: Sequence[str]) -> list[str]:
    """The columns of curve.csv: a curve over one distance in common has slopes, moved particles have forces."""
    left_out: set[Column] = {DU_HALF, DU_QUARTER}  # of curves from rest
    left_out |= {column for name, column in SENSITIVITIES.items() if name not in parameters}
    left_out |= set() if case.common else {SLOPE}
    left_out |= set() if case.velocity is not None else {*FORCES}
    left_out |= set() if case.liquid_model.modes else {*POLYMER_HEALTH}
    left_out |= set() if case.liquid_model.regularisation else {*YIELD_HEALTH}
    return names_of(case.n, *(column for column in QUESTION.tables["curve"] if column not in left_out))


def slope_rows(point: Point) -> Iterator[dict[str, float]]:
    """The rows of slopes.csv for a quasi-steady solution, one for each distance."""
    slopes = zip(point.velocity_slopes.T, point.held_slopes.T, strict=True)
    for gap, (moving, held) in enumerate(slopes, 1):
        yield table_row(len(moving), {DISTANCE: point.gaps, GAP_OF_SLOPE: gap, U_SLOPE: moving, U_SLOPE_HELD: held})


def _shown(point: Point, count: int) -> Message:
    """A line of progress for a point."""
    o = point.observation
    place = [Message("d = {}", LENGTH(point.gaps, ".5g"))] if point.gaps else []
    if len(o.F):
        motion = Message("F = {}", FORCE(o.F, ".6g"))
    elif len(o.dU):
        motion = Message("dU = {}", VELOCITY(o.dU, "+.4g"))
    else:
        motion = Message("U = {}", VELOCITY(o.U[0]))
    return Message.joined("  ", [*place, motion, f"Newton {point.newton}", f"point {count}"])


def _zeros(branch: Branch, points: list[Point]) -> Generator[events.Event, None, Sequence[Equilibrium] | Ended]:
    """Find the zeros of the curve of a pair; those found before an end or a failure are written, too."""
    zeros, ended = list[Zero](), None
    failure: RunFailure | None = None
    try:
        for zero in find_zeros(branch, points):
            if isinstance(zero, Ended):
                ended = zero
            else:
                zeros.append(zero)
    except RunFailure as error:
        failure = error
    result = equilibria(zeros, points)
    rows = [vars(zero) | {STABLE.name: zero.stable} for zero in result]
    yield events.Table("equilibria", EQUILIBRIA_COLUMNS.named(2), rows)
    if failure is not None:
        raise failure
    return ended or result


def _said(case: CurveCase, zero: Equilibrium) -> str:
    """A zero in words."""
    kind = "stable" if zero.stable else "unstable"
    return f"{kind} at d = {in_unit(case.scales, LENGTH, zero.d, zero.d_error)}{'' if zero.certain else ' (uncertain)'}"


def _off_axis(
    case: CurveCase, branch: Branch, points: Sequence[Point], expected: int
) -> Generator[events.Event, None, list[Text]]:
    """Rates off the axis at the first distance, at that of the largest |dU|, and at the last one; returns warnings."""
    largest = max(points, key=lambda point: float(np.abs(point.dUs).max(initial=0.0)))
    chosen = {point.gaps: point.parameters for point in (points[0], largest, points[-1])}
    return (yield from rates_beside(case, branch, list(chosen.values()), min(len(points), expected), len(points)))


def _end(case: CurveCase, found: Solutions, remarks: Sequence[Text]) -> Iterator[events.Event]:
    """The last events: what run.json says and, where the branch ends early, the fields of its last solution."""
    points, warnings = found.points, list[Text]()
    if found.branch is not None and points and dU in found.goals:
        curve = Curve.of_points(points)
        curves = [curve.of(gap) for gap in range(1, case.n)] if case.common and len(points) > 1 else []
        if len(points) >= ENOUGH and curves:
            found.largest[dU] = max(abs(curve.peak.dU) for curve in curves)
        size = found.largest.get(dU, found.branch.largest[dU])
        if size > NEGLIGIBLE_DU:
            warnings = [*moving_errors(case, points, size), *_far_apart(case, curves, size)]
    yield from found.last_events({POINTS: len(points), **spread_entry(case)}, [*warnings, *remarks])
    if found.ended is not None and (last := found.ended.last) is not None and case.n > 1:
        last.reopen()
        with closing(last):
            shapes = steady_frame(min(last.parameters.gaps), last)
        yield events.Frame(shapes)


def _far_apart(case: CurveCase, curves: Sequence[CurveInterpolant], size: float) -> list[Text]:
    """Warn of points so far apart that the interpolation error of dU exceeds `accuracy` and the errors at the points.

    There is a curve for every gap; `size` is the largest |dU| [U_av].
    """
    if not curves:
        return []
    d, known = curves[0].d, [np.maximum(curve.dU_error[:-1], curve.dU_error[1:]) for curve in curves]
    errors = np.max([np.where(c.errors > e, c.errors, 0.0) for c, e in zip(curves, known, strict=True)], axis=0) / size
    worst = int(errors.argmax())
    if errors[worst] <= case.error_wanted:
        return []
    part = f"{100 * errors[worst]:.2g} %" if np.isfinite(errors[worst]) else "any part"
    advice = finer(case)
    if len(d) >= case.max_points:
        advice = f"more points (--set max_points={2 * case.max_points})"
    elif case.tol > case.error_wanted:
        advice = f"points nearer to each other (--set tol={case.error_wanted:g})"
    said = "between d = {} and d = {} the interpolated dU may be off by {} of its largest value, more than accuracy: {}"
    between = LENGTH(d[worst]), LENGTH(d[worst + 1])
    return [Message(said, *between, part, case.accuracy) + f"; use {advice}"]
