"""Rows of a run, its warnings, and what is said of its accuracy."""

from __future__ import annotations

import math
from typing import Any

from pairsim.config.case import Case
from pairsim.config.checked_range import beyond_checked
from pairsim.questions.warnings import (
    above,
    coarse_mesh,
    large_run_error,
    long_steps,
    narrow_gap,
    near_ends,
    unknown_run_error,
    unresolved_stress,
)
from pairsim.results.columns import observed, table_row
from pairsim.solvers.errors.run_errors import RunErrors
from pairsim.solvers.errors.time_error import LEAST
from pairsim.solvers.stepping.step import Step
from pairsim.solvers.transient.adaptation import RunAdaptation
from pairsim.solvers.transient.state import Extremes


def row_of(step: Step) -> dict[str, float]:
    """The row of a step in series.csv."""
    o = step.observation
    values: dict[str, Any] = {"t": step.t, "d": o.d, "U": step.U, "dU": step.dU, "D": o.D}
    values |= {"dp": o.dp, "dp_plus": o.dp_plus, "dt": step.dt, "newton": step.report.iterations}
    values |= {"mesh": step.mesh_id, "distortion": step.distortion, **observed(o)}
    if step.dU_correction is not None and step.dU_error is not None:
        values |= {"dU_discrete": step.dU_discrete, "dU_correction": step.dU_correction, "dU_error": step.dU_error}
    return table_row(o.U.size, **values)


def warnings_of(case: Case, errors: RunErrors, extremes: Extremes) -> list[str]:
    """Warnings about the results of a run."""
    return [
        *beyond_checked(case),
        *coarse_mesh(case),
        *long_steps(case, errors.steps.part),
        *large_run_error(case, errors.part),
        *unknown_run_error(case, errors.lost),
        *unresolved_stress(case, extremes.s_jump),
        *narrow_gap(case, *extremes.narrowest),
        *near_ends(case, extremes.span),
    ]


def entry_of(adaptation: RunAdaptation) -> dict[str, Any]:
    """The part of the entry of run.json that is known before an adapted run."""
    coarse = {"t": adaptation.t, "unknowns": adaptation.unknowns, "dU": adaptation.dU, "dU_error": adaptation.error}
    return {"wanted": adaptation.wanted, "cells": adaptation.factor, "coarse_run": coarse}


def accuracy_of(case: Case, errors: RunErrors) -> tuple[dict[str, Any], str]:
    """The part of the entry that is known after an adapted run, and what the closing line says of it."""
    peak, wanted = errors.steps.peak, case.error_wanted
    if peak <= LEAST:
        return {"kept": True}, ""
    if math.isfinite(errors.lost):
        return {"kept": False}, f"; accuracy: {case.accuracy} was not kept, dU_error is not known"
    reached = errors.largest / peak
    entry = {"reached": reached, "kept": reached <= wanted, "reference_dU": peak}
    kept = "kept" if reached <= wanted else "not kept"
    percent = f"{100 * reached:.2g}" if reached <= wanted else above(100 * reached, 100 * wanted)
    return entry, f"; accuracy: {case.accuracy} was {kept}, dU_error is up to {percent} %"
