"""How much wider intervals are where cells do not resolve the stress of a polymer, which estimates see only in part."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pairsim.fem.diagnostics import Observation

# Largest change of log c within a cell up to which estimates held, and the powers of it by which intervals widen above,
# where errors were up to 1.4 times the interval in 73 quasi-steady solutions, and 1.9 times in six runs, whose estimate
# has no scatter. They were read off these (scripts/error_bars); two further runs, which were not used, all hold.
RESOLVED, OF_POINTS, OF_RUNS = 1.1, 1, 3


def widening(s_jump: float, power: int) -> float:
    """Factor of the cells' part of an interval; `s_jump` is the largest change of log c within a cell."""
    return max(1.0, s_jump / RESOLVED) ** power


def widening_at(observation: Observation) -> float:
    """That of a quasi-steady solution."""
    return widening(observation.s_jump, OF_POINTS)
