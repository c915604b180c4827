"""How much wider intervals are where cells do not resolve the stress of a polymer, which estimates see only in part."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pairsim.fem.diagnostics import Observation

# Read off 73 quasi-steady solutions and six runs (scripts/error_bars), in which errors were up to 1.4 and 1.9 times the
# interval; two further runs, which were not used, all hold.
RESOLVED = 1.1  # largest change of log c within a cell up to which intervals hold
OF_POINTS = 1  # power of it by which intervals widen above, of quasi-steady solutions
OF_RUNS = 3  # the same of runs, whose estimate has no scatter


def widening(s_jump: float, power: int) -> float:
    """Factor of the cells' part of an interval; `s_jump` is the largest change of log c within a cell."""
    return max(1.0, s_jump / RESOLVED) ** power


def widening_at(observation: Observation) -> float:
    """That of a quasi-steady solution."""
    return widening(observation.s_jump, OF_POINTS)
