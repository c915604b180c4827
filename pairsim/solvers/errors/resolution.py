"""How much wider intervals are where cells do not resolve the stress of a polymer, of which no estimate sees enough."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pairsim.fem.diagnostics import Observation

# Largest change of log c within a cell up to which estimates held. Above it errors were up to 1.4 times the interval in
# 73 quasi-steady solutions, and 1.9 times in runs, which have no scatter. It widens by these powers of the change
# (determined on half of the scenes of scripts/error_bars, and on six runs).
RESOLVED, OF_POINTS, OF_RUNS = 1.1, 1, 3


def widening(s_jump: float, power: int) -> float:
    """Factor of the cells' part of an interval; `s_jump` is the largest change of log c within a cell."""
    return max(1.0, s_jump / RESOLVED) ** power


def widening_at(observation: Observation) -> float:
    """That of a quasi-steady solution."""
    stress = observation.conformation
    return 1.0 if stress is None else widening(stress.s_jump, OF_POINTS)
