"""What the particles of a run do once its start-up has decayed, for run.json."""

from __future__ import annotations

import math
from typing import Any

from pairsim.config.case import Case
from pairsim.drivers.outcome import Outcome
from pairsim.results.run_answer import SETTLED
from pairsim.runtime.errors import RunFailure
from pairsim.runtime.signals import Stopped
from pairsim.solvers.problems import Problem
from pairsim.solvers.transient.end import settled


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
    entry = {"d": list(point.gaps), "dU": point.dUs.tolist(), "dU_error": point.dU_errors.tolist()}
    return {SETTLED: entry | {"t_relax": point.t_relax, "start": case.start, "accuracy": case.error_wanted}}
