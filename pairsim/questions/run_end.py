"""When a run ends, and what its particles do once its start-up has decayed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from pairsim.config.case import Case
from pairsim.questions.outcome import Outcome
from pairsim.results.run_answer import SETTLED
from pairsim.runtime.errors import RunFailure
from pairsim.runtime.signals import Stopped
from pairsim.solvers.problems import Problem
from pairsim.solvers.transient.end import reason_to_end, settled


def end_of(problem: Problem, t: float, gaps: Sequence[float]) -> Outcome | None:
    """The outcome of a run that has reached its end at a time and distances, else None."""
    match reason_to_end(problem, t, gaps):
        case "contact":
            message = f"contact: the gap fell below {problem.min_gap:g} at t = {t:g}"
            return Outcome("finished", "contact", message)
        case "max_gap":
            return Outcome("finished", "max_gap", f"the gap exceeded {problem.max_gap:g} at t = {t:g}")
        case "tube_too_short":
            message = (
                f"the particles are only {problem.room(gaps):.3g} D_c from the ends of the tube at t = {t:g}; try a "
                "larger length, or limits.max_gap"
            )
            return Outcome("failed", "tube_too_short", message)
        case "end":
            return Outcome("finished", "end", f"finished at t = {t:g}")
        case None:
            return None


def settled_entry(case: Case, problem: Problem, gaps: tuple[float, ...], ended: Outcome) -> dict[str, Any]:
    """The quasi-steady solution at the last distances of a run.

    Args:
        case: The case.
        problem: Its problem, with the cells of the run.
        gaps: The last distances [D_c], N-1 values.
        ended: How the run ended.

    Returns:
        The entry of run.json: dU with its error at every gap [U_av], the decay time of a disturbance [D_c/U_av], how
        the run started and which part of dU `accuracy` allows as error; a message, if there is no such solution. Empty
        for a single particle, and for a run that ended early.
    """
    if case.n < 2 or ended.reason not in ("end", "max_gap"):
        return {}
    try:
        point = settled(problem, gaps)
    except RunFailure as failure:
        return {SETTLED: {"message": failure.message}}
    except Stopped:
        return {SETTLED: {"message": "the quasi-steady solution at the last distances was interrupted"}}
    if not math.isfinite(point.t_relax):
        return {SETTLED: {"message": "disturbances of the quasi-steady state at the last distances do not decay"}}
    # What a run without estimates tends to is the solution on its cells, without the estimate of their error.
    left = 0 * point.correction if case.estimates_error else point.correction
    dU, error = point.dUs - left, point.dU_errors + np.abs(left)
    entry = {"d": list(point.gaps), "dU": dU.tolist(), "dU_error": error.tolist()}
    return {SETTLED: entry | {"t_relax": point.t_relax, "start": case.start, "accuracy": case.error_wanted}}
