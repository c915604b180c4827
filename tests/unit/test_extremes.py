"""The smallest and largest values that a case file may have: each alone, all together, and many combinations.

What can be computed has a finite estimate and a folder; what cannot is refused for a reason. Without a solve.
"""

from __future__ import annotations

import math
import random
from collections import Counter
from typing import Any

import pytest
import yaml
from support.fuzz import CASES, allowed

from pairsim.commands import COMMANDS
from pairsim.runtime.duration import duration
from pairsim.runtime.errors import InputError
from pairsim.sweeps.case import SweepCase

COMBINATIONS = 300  # of each command
LONGEST = 2000  # characters of a message
LONGEST_FOLDER = 240  # bytes of the name of a folder


def loaded(text: str) -> Any:
    """A value as YAML reads it; numbers as pairsim does."""
    value = yaml.safe_load(text)
    try:
        return float(value) if isinstance(value, str) else value
    except ValueError:
        return value


def outcome(command: str, changes: dict[str, str]) -> str:
    """Check a case with some values; returns "refused" or "ready"."""
    data: dict[str, Any] = {key: loaded(text) for key, text in CASES[command].items()}
    for key, text in changes.items():
        group, _, name = key.rpartition(".")
        (data.setdefault(group, {}) if group else data)[name] = loaded(text)
    try:
        checked = SweepCase.of(COMMANDS[command], data, "case")
    except InputError as error:
        message = str(error)
    else:
        message = ""
    assert len(message) < LONGEST
    if message:
        return "refused"
    estimate = checked.estimate
    assert all(map(math.isfinite, (estimate.unknowns, estimate.seconds, estimate.memory))), changes
    assert duration(estimate.seconds)
    assert len(checked.folder.encode()) <= LONGEST_FOLDER
    return "ready"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_limit_is_allowed_or_refused_for_a_reason(command: str) -> None:
    for key, texts in allowed(command).items():
        for text in texts:
            outcome(command, {key: text})


@pytest.mark.parametrize("command", COMMANDS)
def test_combinations_of_limits_are_allowed_or_refused_for_a_reason(command: str) -> None:
    choose = random.Random(command)
    keys = list(allowed(command).items())
    codes = Counter(
        outcome(command, {key: choose.choice(texts) for key, texts in choose.sample(keys, choose.randint(2, 12))})
        for _ in range(COMBINATIONS)
    )
    assert codes["ready"] > 0
    assert codes["refused"] > 0
