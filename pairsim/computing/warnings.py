"""Warnings about results that may be less accurate than requested, for run.json and the terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pairsim.cases.accuracy import SETTINGS, settings_of
from pairsim.cases.case import Case, SceneCase
from pairsim.cases.checked_range import beyond_checked
from pairsim.solvers.errors.run_errors import RunErrors
from pairsim.solvers.errors.time_error import LEAST
from pairsim.solvers.transient.state import Extremes

LONG_ARC = 1.5  # allowed length of an arc over the gap beside it; dU is 2.5 % off at 3 (N_p 40, gap 0.005)
# Least length of tube on each side, relative to that with `length: auto`; with less, errors above about 1 % of the peak
# were measured. Periodic ends need more, since the polymer stress caused by the particles returns to them.
NEAR_ENDS = {"developed": 0.5, "periodic": 0.65}
# Relative length as above, and the largest error measured below it with either kind of ends [% of the largest |dU|].
ENDS_ERRORS = ((0.33, 44), (0.5, 7), (0.65, 2))
COARSEST = "5%"
FINER, SHORTER = 1.5, 4.0  # what sizes of cells and tolerances are divided by in advice; chosen


def above(value: float, limit: float) -> str:
    """A number that exceeds a limit, with two significant digits, or as many as it takes to read above the limit."""
    texts = (f"{value:.{digits}g}" for digits in range(2, 17))
    return next((text for text in texts if float(text) > limit), f"{value}")


def coarse_mesh(case: SceneCase) -> list[str]:
    """Warn of a mesh that is coarser than any whose error was measured."""
    measured = SETTINGS[COARSEST].mesh(case.liquid_model.cells, case.betas, "time" in type(case).model_fields)
    coarse = {"Np": case.mesh.Np < measured["Np"], "max_size": case.mesh.max_size > measured["max_size"]}
    return [
        f"mesh.{name} = {getattr(case.mesh, name):g} is coarser than accuracy: {COARSEST} ({measured[name]:g}): the "
        f"error of dU may exceed {COARSEST} of its largest value"
        for name, is_coarse in coarse.items()
        if case.n and is_coarse
    ]


def finer(case: SceneCase) -> str:
    """A finer mesh as options of the command line."""
    sizes = {"Np": round(FINER * case.mesh.Np), "max_size": f"{case.mesh.max_size / FINER:.2g}"}
    return f"a finer mesh ({' '.join(f'--set mesh.{name}={size}' for name, size in sizes.items())})"


def long_steps(case: Case, part: float) -> list[str]:
    """Warn of time steps whose estimated error of dU exceeds `accuracy`; `part` is relative to the largest |dU|."""
    if part <= case.error_wanted:
        return []
    key = "tol" if case.time.fixed_step is None else "fixed_step"
    smaller = f"--set time.{key}={getattr(case.time, key) / SHORTER:.2g}"
    return [
        f"time steps may cause an error of {above(100 * part, 100 * case.error_wanted)} % of the largest |dU|, more "
        f"than accuracy: {case.accuracy}; use shorter steps ({smaller})"
    ]


def large_run_error(case: Case, part: float) -> list[str]:
    """Warn of a largest dU_error in a run that exceeds `accuracy`; `part` is relative to the largest |dU|."""
    if part <= case.error_wanted:
        return []
    percent = above(100 * part, 100 * case.error_wanted)
    if case.adapts:
        return [f"accuracy: {case.accuracy} was not kept: dU_error is up to {percent} % of the largest |dU|"]
    return [
        f"dU_error is up to {percent} % of the largest |dU|, more than accuracy: {case.accuracy}; use "
        f"{finer(case)} or shorter steps (--set time.tol={case.time.tol / SHORTER:.2g})"
    ]


def unknown_run_error(case: Case, lost: float) -> list[str]:
    """Warn of a run whose error is unknown from the time `lost` on; infinite where it is known throughout."""
    if lost == np.inf:
        return []
    return [
        f"the estimate of the error diverged at t = {lost:.4g}: dU_error is not known from there on; use {finer(case)}"
    ]


def unresolved_stress(case: SceneCase, s_jump: float) -> list[str]:
    """Warn of a polymer stress that the mesh does not resolve; `s_jump` is the largest change of s within a cell."""
    allowed = settings_of(case.accuracy).s_jump
    if s_jump <= allowed:
        return []
    return [
        f"s = log c changes by {above(s_jump, allowed)} within one cell: the polymer stress is not resolved there. "
        f"Above {allowed:g}, the error of dU may exceed {case.accuracy} of its largest value "
        f"(docs/how-to/accuracy.md); compare with {finer(case)}"
    ]


@dataclass(frozen=True)
class ErrorAt:
    """The estimated error of a result.

    Attributes:
        relative: The error, relative to the size of what is asked for.
        where: The place, such as "d = 0.1".
        ends: The part of it that is due to the ends of the tube, relative as well.
    """

    relative: float
    where: str
    ends: float


def _longer(case: SceneCase) -> str:
    """A longer tube as an option of the command line."""
    return f"a longer tube (--set length={1.5 * case.tube_length:.3g})"


def large_errors(case: SceneCase, error: str, size: str, errors: Sequence[ErrorAt]) -> list[str]:
    """Warn of estimated errors that exceed `accuracy`; `error` is their name, `size` what they are relative to."""
    allowed = case.error_wanted
    worst = max(errors, key=lambda each: each.relative, default=None)
    if worst is None or worst.relative <= allowed:
        return []
    advice = _longer(case) if worst.ends > worst.relative / 2 else finer(case)
    return [
        f"{error} is {above(100 * worst.relative, 100 * allowed)} % of {size} at {worst.where}, more than "
        f"accuracy: {case.accuracy}; use {advice}"
    ]


def moves_on(case: SceneCase, places: Sequence[str], part: float) -> list[str]:
    """Warn of particles that move on before they have forgotten their start.

    Args:
        case: The case.
        places: Where the motion alone leaves an error of dU above `accuracy`, such as "d = 0.1".
        part: The largest of these errors, relative to the largest |dU|.
    """
    if not places:
        return []
    at = places[0] if len(places) == 1 else f"{len(places)} places from {places[0]} to {places[-1]}"
    return [
        f"at {at} the particles move on before they have forgotten their start (t_relax): dU_error is up to "
        f"{above(100 * part, 100 * case.error_wanted)} % of the largest |dU| by that alone, more than accuracy: "
        f"{case.accuracy}, and no mesh reduces it; pairsim run tells how particles move there from a start of their own"
    ]


def narrow_gap(case: Case, gap: float, arc: float) -> list[str]:
    """Warn of a gap [D_c] that is too narrow for the longest arc of the outlines beside it [D_c]."""
    if arc <= LONG_ARC * gap:
        return []
    return [
        f"the arcs beside a gap of {gap:.3g} are {arc / gap:.2g} times as long as the gap (their length is set by d0): "
        f"dU there is accurate to a few percent only; use shorter ones "
        f"(--set mesh.Np={round(FINER * case.mesh.Np)}), or pairsim curve at that d"
    ]


def near_ends(case: SceneCase, span: float) -> list[str]:
    """Warn of a row of particles, whose largest length is `span` [D_c], that comes too near the ends of the tube.

    The measured errors are in docs/explanation/decisions.md, "Tube and ends".
    """
    part = NEAR_ENDS[case.ends if case.liquid_model.modes else "developed"]
    left, least = (case.tube_length - span) / 2, part * case.margin
    if not case.n or left >= least:
        return []
    message = (
        f"there are {left:.3g} D_c of tube on each side of the particles, less than {least:.3g}: the ends affect dU"
    )
    if case.liquid_model.modes:
        off = next(error for below, error in ENDS_ERRORS if left < below * case.margin)
        message += f", by up to {off} % of the largest |dU| in the tubes measured"
    return [f"{message}; use {_longer(case)}, or limits.max_gap in a run"]


def warnings_of_run(case: Case, errors: RunErrors, extremes: Extremes) -> list[str]:
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
