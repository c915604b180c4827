"""The rows of series.csv of a run, and its entries of run.json."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pairsim.cases.run_case import Case
from pairsim.computing import events
from pairsim.fem.unyielded import bridges
from pairsim.record.column import Column, table_row
from pairsim.record.columns import (
    BRIDGE,
    DISTANCE,
    DISTORTION,
    DP,
    DP_PLUS,
    DT,
    DU,
    DU_CORRECTION,
    DU_DISCRETE,
    ERROR_COLUMNS,
    MESH,
    NEWTON,
    TAYLOR,
    T,
    U,
    Z,
    observed,
)
from pairsim.record.run_entries import (
    FACTORISATIONS,
    NEWTON_ITERATIONS,
    REACHED,
    REJECTED,
    REMESHINGS,
    SETTLED,
    SIZE,
    TIME_STEPS,
    Entries,
    Entry,
    WholeCycles,
)
from pairsim.runtime.errors import RunFailure
from pairsim.runtime.signals import Stopped
from pairsim.solvers.goals import IN_TIME, dU
from pairsim.solvers.problems import Problem
from pairsim.solvers.stepping.step import Step
from pairsim.solvers.transient.cycles import Cycles
from pairsim.solvers.transient.end import settled
from pairsim.solvers.transient.state import Counts

HALF_WIDTHS = {goal: next(each for each in ERROR_COLUMNS if each.name == goal.error_column) for goal in IN_TIME}


def settled_entry(case: Case, problem: Problem, gaps: tuple[float, ...], ended: events.Outcome) -> Entries:
    """The entry of run.json with the quasi-steady solution at the last distances of a run, on the cells of its problem.

    It is empty for a single particle, held distances, a flow that varies, a run that ended early, and a polymer with a
    yield stress.

    Args:
        case: The case.
        problem: Its problem.
        gaps: The last distances [D_c], N-1 values.
        ended: How the run ended.

    Returns:
        The entry `SETTLED`, see `pairsim.record.run_entries.Settled`; it is a message if there is no such solution.
    """
    if case.waveform is not None:
        return {}
    if case.n < 2 or ended.reason not in ("end", "max_gap") or case.hold or case.liquid_model.yielding is not None:
        return {}
    try:
        point, creeps = settled(problem, gaps)
    except RunFailure as failure:
        return {SETTLED: {"message": failure.message}}
    except Stopped:
        return {SETTLED: {"message": "the quasi-steady solution at the last distances was interrupted"}}
    if not math.isfinite(point.t_relax):
        return {SETTLED: {"message": "disturbances of the quasi-steady state at the last distances do not decay"}}
    # A run without error estimates tends to the solution on its cells, which lacks the estimate of their error.
    left = 0 * point.correction if case.estimates_error else point.correction
    dU, error = point.dUs - left, point.dU_errors + abs(left)
    entry = {"d": list(point.gaps), "dU": dU.tolist(), "dU_error": error.tolist()}
    entry |= {"creeps": True} if creeps else {}
    entry |= {"held_together": True} if point.arrested else {}
    return {SETTLED: entry | {"t_relax": point.t_relax, "start": case.start, "accuracy": case.error_wanted}}


def cycles_entry(case: Case, cycles: Cycles) -> WholeCycles:
    """The entry of run.json about the cycles of a flow that varies."""
    assert case.waveform is not None, "there are no cycles"
    part, ones = case.error_wanted, np.zeros(cycles.d.size)
    entry = WholeCycles(
        shape=case.waveform.shape,
        cycle=cycles.cycle,
        repeats=cycles.repeats,
        U_av=case.unit_of_flow,
        whole=cycles.count,
        accuracy=part,
    )
    if cycles.count:
        drift, errors = (np.asarray(each + ones).tolist() for each in (cycles.drift, cycles.error))
        known = [each if math.isfinite(each) else None for each in errors]  # its estimate may have diverged
        entry |= {"drift": drift, "drift_error": known, "dU_peak": cycles.peak}
    if cycles.count > 1:
        entry |= {"change": cycles.remaining, "periodic": cycles.are_periodic(part), "known": cycles.are_known(part)}
    return entry


def row_of(step: Step) -> dict[str, float]:
    """The row of a step in series.csv."""
    o = step.observation
    values: dict[Column, Any] = {T: step.t, Z: step.z, DISTANCE: o.d, U: step.U, DU: step.dU, TAYLOR: o.D}
    values |= {DP: o.dp, DP_PLUS: o.dp_plus, DT: step.dt, NEWTON: step.report.iterations}
    values |= {MESH: step.mesh_id, DISTORTION: step.distortion, **observed(o)}
    values |= {HALF_WIDTHS[goal]: each if goal.per else float(each[0]) for goal, each in step.half_widths.items()}
    if step.scene.material.plastic.yield_stress:
        values[BRIDGE] = bridges(step.scene, step.x, step.h)
    if step.corrections:
        values |= {DU_DISCRETE: step.dU_discrete, DU_CORRECTION: step.corrections[dU]}
    return table_row(o.U.size, values)


def summary(counts: Counts, t: float, unknowns: int) -> dict[Entry[Any], Any]:
    """Entries of run.json: time, unknowns and counts."""
    return {
        REACHED: t,
        SIZE: unknowns,
        TIME_STEPS: counts.steps,
        REJECTED: counts.rejected,
        NEWTON_ITERATIONS: counts.newton,
        FACTORISATIONS: counts.factorisations,
        REMESHINGS: counts.remeshings,
    }
