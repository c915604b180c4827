"""The computation of a master curve: its points, its zeros, and the entries of run.json at the end."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from contextlib import closing

import numpy as np

from pairsim.analysis.master_curve import Curve
from pairsim.analysis.rows_of_points import point_row
from pairsim.computing import events
from pairsim.computing.off_axis.beside import rates_beside
from pairsim.computing.spread_entry import spread_entry
from pairsim.computing.steady import (
    Solutions,
    moving_errors,
)
from pairsim.computing.warnings import finer
from pairsim.computing.workers import Workers
from pairsim.quantities.kinds import FORCE, LENGTH, VELOCITY
from pairsim.quantities.text import in_unit
from pairsim.questions.curve import GAP_OF_SLOPE, QUESTION, SLOPES, U_SLOPE, U_SLOPE_HELD, CurveCase
from pairsim.questions.curve.parts import Others, begun, goals_of, parameters_of, read_off
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
    TAYLOR_ERROR,
    WANTED,
    YIELD_HEALTH,
)
from pairsim.record.fields_of_frame import steady_frame
from pairsim.record.run_entries import POINTS
from pairsim.runtime.errors import RunFailure
from pairsim.runtime.message import Message, Text
from pairsim.runtime.monitor import Monitor
from pairsim.runtime.text import counted
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.curves.curve import EarlyZeros, Equilibrium, Zero, equilibria, find_zeros, trace
from pairsim.solvers.curves.distances import between
from pairsim.solvers.curves.interpolant import NEGLIGIBLE_DU, CurveInterpolant
from pairsim.solvers.curves.point import Point
from pairsim.solvers.curves.scout import ENOUGH
from pairsim.solvers.goals import dU
from pairsim.solvers.steady.ends import Ended


def computation(case: CurveCase, monitor: Monitor, workers: Workers, sensitivities: bool) -> events.Events:
    """Compute a master curve and, for a pair, its zeros; arguments as for `solve`."""
    places, by = case.in_order, parameters_of(case, sensitivities)
    expected = len(between(places, case.max_points)) if case.common else len(places)
    yield events.Begin(f"{counted(expected, 'point')}, more as needed", expected)
    found, remarks = Solutions(case, goals_of(case)), list[Text]()
    points, others = found.points, Others(case, workers, monitor, found, by)
    try:
        with found:
            others.begin(between(places, case.max_points) if case.common else places)
            branch = begun(case, found, places[0], monitor, by)
            if isinstance(branch, Ended):
                return found.outcome_of(branch)
            yield events.Table("curve", _columns(case, by), ascending=case.common)
            sloping = case.n > 2 and case.velocity is None
            if sloping:
                yield events.Table("slopes", SLOPES.named(case.n), ascending=case.common)
            early = EarlyZeros() if case.of_free_pairs else None
            for traced in trace(branch, places, case.tol, case.max_points, others, early):
                if isinstance(traced, Ended):
                    return found.outcome_of(traced)
                point, wanted = traced
                points.append(point)
                if case.common:
                    points.sort(key=lambda p: p.d)
                count = len(points)
                read = others.of(point) or read_off(case, point, branch.solver)
                yield events.Row("curve", point_row(point) | {WANTED.name: float(wanted)} | read.own)
                for row in slope_rows(point) if sloping else ():
                    yield events.Row("slopes", row)
                if read.frame is not None:
                    yield events.Frame(read.frame)
                yield from others.notes()
                yield events.Progress(min(count, expected), _shown(point, count), count)
            message = counted(len(points), "point")
            if early is not None:
                zeros = yield from _zeros(branch, points, early)
                if isinstance(zeros, Ended):
                    return found.outcome_of(zeros)
                found_zeros = ", ".join(_zero_in_words(case, zero) for zero in zeros)
                message += f"; dU = 0: {found_zeros or 'at no d'}"
            if case.focus:
                remarks += yield from _off_axis(case, branch, points, expected)
            return events.Outcome("finished", "end", message)
    finally:
        yield from _end(case, found, remarks)


def _columns(case: CurveCase, parameters: Sequence[str]) -> list[str]:
    """The columns of curve.csv: all that it may have, without those that do not apply to this case."""
    left_out: set[Column] = {DU_HALF, DU_QUARTER}  # of curves from rest
    left_out |= {column for name, column in SENSITIVITIES.items() if name not in parameters}
    left_out |= set() if case.common else {SLOPE}
    left_out |= set() if case.velocity is not None else {*FORCES}
    left_out |= set() if case.n == 1 and any(case.Ca_es) else {TAYLOR_ERROR}  # estimated of a single soft particle only
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


def _zeros(
    branch: Branch, points: list[Point], early: EarlyZeros
) -> Generator[events.Event, None, Sequence[Equilibrium] | Ended]:
    """Find the zeros of the curve of a pair; those found before the branch ends or a failure are written, too."""
    zeros, ended = list[Zero](), None
    failure: RunFailure | None = None
    try:
        for zero in find_zeros(branch, points, early):
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


def _zero_in_words(case: CurveCase, zero: Equilibrium) -> str:
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
    """The last events: the summary for run.json and, if the branch ended early, the fields of its last solution."""
    points, warnings = found.points, list[Text]()
    if found.report is not None and points and dU in found.goals:
        curve = Curve.of_points(points)
        curves = [curve.of(gap) for gap in range(1, case.n)] if case.common and len(points) > 1 else []
        if len(points) >= ENOUGH and curves:
            found.largest[dU] = max(abs(curve.peak.dU) for curve in curves)
        size = found.largest.get(dU, found.report.largest[dU])
        if size > NEGLIGIBLE_DU:
            warnings = [*moving_errors(case, points, size), *_far_apart(case, curves, size)]
    yield from found.last_events({POINTS: len(points), **spread_entry(case)}, [*warnings, *remarks])
    if found.ended is not None and (last := found.ended.last) is not None and case.n > 1:
        last.reopen()
        with closing(last):
            shapes = steady_frame(min(last.parameters.gaps), last)
        yield events.Frame(shapes)


def _far_apart(case: CurveCase, curves: Sequence[CurveInterpolant], size: float) -> list[Text]:
    """Warn if between two points the interpolation error of dU exceeds both `accuracy` and the errors at the points.

    `curves` has a curve for each gap; `size` is the largest |dU| [U_av].
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
