"""Times at which fields of a run are written, and what ends a run."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pairsim.cases.run_case import Case
from pairsim.computing import events
from pairsim.quantities.kinds import LENGTH, TIME
from pairsim.quantities.text import in_unit
from pairsim.runtime.message import Message
from pairsim.solvers.problems import Problem
from pairsim.solvers.transient.cycles import Cycles
from pairsim.solvers.transient.end import reason_to_end

NEARLY_DUE = 1e-9  # tolerance for rounding in the number of frames that are due


def milestones(case: Case) -> list[float]:
    """Times that steps must land on: the output times and the end time, ascending."""
    end, every = case.time.end, case.output.every
    times = {t for t in case.output.times if 0 < t < end}
    if every is not None:
        times |= {k * every for k in range(1, math.ceil(end / every - 1e-9))}
    return [*sorted(times), end]


def frames_until(case: Case, t: float, gaps: Sequence[float]) -> int:
    """How many of the `output.frames` are due at a time [D_c/U_av] and distances [D_c], N-1 values.

    They are spread evenly over the way to the end of the run: its end time, contact or `max_gap`, whichever is nearest.
    Unlike `milestones` they need no steps of their own. Stopping and resuming a run makes no difference to them.
    """
    output, limits = case.output, case.limits
    if output.times or output.every is not None:
        return 0
    passed = t / case.time.end
    for start, d in zip(case.gaps, gaps, strict=True):
        passed = max(passed, (start - d) / (start - limits.min_gap))
        if limits.max_gap is not None:
            passed = max(passed, (d - start) / (limits.max_gap - start))
    return int(output.frames * passed + NEARLY_DUE)


def moment(t: float) -> Message:
    """A time in words."""
    return Message("t = {}", TIME(t, ".6g"))


def end_of(
    case: Case, problem: Problem, t: float, gaps: Sequence[float], cycles: Cycles | None = None
) -> events.Outcome | None:
    """The outcome of a run if it ends at this time [D_c/U_av], these distances [D_c] and cycles; None if it goes on."""
    at, scales = moment(t), case.scales
    match reason_to_end(problem, t, gaps, cycles):
        case "contact":
            message = Message("contact: the gap fell below {} at {}", in_unit(scales, LENGTH, problem.min_gap), at)
            return events.Outcome("finished", "contact", message)
        case "max_gap":
            widest = in_unit(scales, LENGTH, problem.max_gap or 0.0)
            return events.Outcome("finished", "max_gap", Message("the gap exceeded {} at {}", widest, at))
        case "tube_too_short":
            pace = (sum(gaps) - sum(case.gaps)) / t
            least = math.ceil(case.cluster + max(pace, 0.0) * case.time.end + 2 * case.margin)
            message = Message(
                "the particles are only {} from the ends of the tube at {}; try a longer tube (--set length={}, enough "
                "until the end at the present pace), or limits.max_gap",
                LENGTH(problem.room(gaps), ".3g", named=True),
                at,
                least,
            )
            return events.Outcome("failed", "tube_too_short", message)
        case "periodic":
            known = f"cycles are periodic and the drift is known to accuracy: {case.accuracy}"
            return events.Outcome("finished", "periodic", Message("{} at {}", known, at))
        case "end":
            return events.Outcome("finished", "end", "finished at " + at)
        case None:
            return None
