"""The smallest and largest values that a case file may have: what can be computed has a finite estimate and a folder.

What cannot is refused for a reason. Without a solve.
"""

from __future__ import annotations

import math
from collections import Counter

import pytest
from hypothesis import HealthCheck, given, settings
from support.fuzz import CASES, Tree, changed, numbers

from pairsim.commands import COMMANDS
from pairsim.runtime.duration import duration
from pairsim.runtime.errors import InputError
from pairsim.sweeps.case import SweepCase

LONGEST_FOLDER = 240  # bytes of the name of a folder


def outcome(command: str, data: Tree) -> str:
    """Check a case with some values; returns "refused" or "ready"."""
    try:
        checked = SweepCase.of(COMMANDS[command], data, "case")
    except InputError:
        return "refused"
    estimate = checked.estimate
    assert all(map(math.isfinite, (estimate.unknowns, estimate.seconds, estimate.memory))), data
    assert duration(estimate.seconds)
    assert len(checked.folder.encode()) <= LONGEST_FOLDER
    return "ready"


@pytest.mark.parametrize("command", COMMANDS)
def test_a_case_is_ready_with_an_estimate_or_refused_for_a_reason(command: str) -> None:
    codes: Counter[str] = Counter()

    @settings(derandomize=True, database=None, deadline=None, max_examples=50, suppress_health_check=list(HealthCheck))
    @given(changed(command, CASES[command]))
    def each(data: Tree) -> None:
        codes[outcome(command, data)] += 1

    each()
    assert codes["ready"] > 0
    assert codes["refused"] > 0


@pytest.mark.parametrize("command", COMMANDS)
def test_every_limit_is_ready_or_refused(command: str) -> None:
    for key, value in ((key, value) for key, *limits in numbers(command) for value in limits):
        group, _, name = key.rpartition(".")
        outcome(command, CASES[command] | ({group: {name: value}} if group else {name: value}))
