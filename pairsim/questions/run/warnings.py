"""The warnings of a run, and whether it has kept its accuracy."""

from __future__ import annotations

import math

import numpy as np

from pairsim.cases.run_case import Case
from pairsim.computing.warnings import FINER, above, common_warnings, finer
from pairsim.quantities.kinds import LENGTH, TIME
from pairsim.runtime.message import Message, Text
from pairsim.solvers.errors.run_errors import RunErrors
from pairsim.solvers.errors.time_error import LEAST
from pairsim.solvers.goals import U, dU
from pairsim.solvers.transient.state import Extremes

LONG_ARC = 1.5  # allowed length of an arc over the gap beside it; dU is 2.5 % off at 3 (N_p 40, gap 0.005)
SHORTER = 4.0  # divisor of tolerances and steps in advice; chosen


def long_steps(case: Case, part: float) -> list[str]:
    """Warn if the error of dU by time steps may exceed `accuracy`; `part` is this error over the largest |dU|."""
    if part <= case.error_wanted:
        return []
    key = "tol" if case.time.fixed_step is None else "fixed_step"
    smaller = f"--set time.{key}={getattr(case.time, key) / SHORTER:.2g}"
    return [
        f"time steps may cause an error of {above(100 * part, 100 * case.error_wanted)} % of the largest |dU|, more "
        f"than accuracy: {case.accuracy}; use shorter steps ({smaller})"
    ]


def large_run_error(case: Case, part: float) -> list[str]:
    """Warn if the largest dU_error of a run exceeds `accuracy`; `part` is this error over the largest |dU|."""
    if part <= case.error_wanted:
        return []
    percent = above(100 * part, 100 * case.error_wanted)
    if case.adapts:
        return [f"accuracy: {case.accuracy} was not kept: dU_error is up to {percent} % of the largest |dU|"]
    return [
        f"dU_error is up to {percent} % of the largest |dU|, more than accuracy: {case.accuracy}; use "
        f"{finer(case)} or shorter steps (--set time.tol={case.time.tol / SHORTER:.2g})"
    ]


def unknown_run_error(case: Case, lost: float) -> list[Text]:
    """Warn if the error of a run is unknown from the time `lost` on [D_c/U_av], infinite if it is known throughout."""
    if lost == np.inf:
        return []
    said = "the estimate of the error diverged at t = {}: dU_error is not known from there on; use {}"
    return [Message(said, TIME(lost), finer(case))]


def narrow_gap(case: Case, gap: float, arc: float) -> list[Text]:
    """Warn of a gap [D_c] that is too narrow for the longest arc of the outlines beside it [D_c]."""
    if arc <= LONG_ARC * gap:
        return []
    said = (
        "cell sides on the particles beside a gap of {} are {} times as long as the gap (d0 sets their length): dU "
        "there is accurate to a few per cent only; use shorter ones (--set mesh.Np={}), or pairsim curve at that d"
    )
    return [Message(said, LENGTH(gap, ".3g"), f"{arc / gap:.2g}", round(FINER * case.mesh.Np))]


def warnings_of_run(case: Case, errors: RunErrors, extremes: Extremes) -> list[Text]:
    """Warnings about the results of a run."""
    return [
        *long_steps(case, errors[dU].steps.part),
        *large_run_error(case, errors.part),
        *unknown_run_error(case, errors.lost),
        *narrow_gap(case, *extremes.narrowest),
        *common_warnings(case, (dU if case.n > 1 else U).name, extremes.s_jump, extremes.span),
    ]


def accuracy_of(case: Case, errors: RunErrors) -> tuple[dict[str, float], str]:
    """Whether an adapted run has kept its accuracy: values for the entry `ADAPTATION`, and the end of the message."""
    of_dU, wanted = errors[dU], case.error_wanted
    peak = of_dU.steps.peak
    if peak <= LEAST:
        return {"kept": True}, ""
    if math.isfinite(errors.lost):
        return {"kept": False}, f"; accuracy: {case.accuracy} was not kept, dU_error is not known"
    reached = of_dU.largest / peak
    entry = {"reached": reached, "kept": reached <= wanted, "reference_dU": peak}
    kept = "kept" if reached <= wanted else "not kept"
    percent = f"{100 * reached:.2g}" if reached <= wanted else above(100 * reached, 100 * wanted)
    return entry, f"; accuracy: {case.accuracy} was {kept}, dU_error is up to {percent} %"
