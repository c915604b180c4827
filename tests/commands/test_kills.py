"""SIGKILL at random moments: the next command finishes, and the outcome is that of a command that was never killed."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest
from support.kills import KINDS, Victim

KILLS = int(os.environ.get("PAIRSIM_KILLS", "20"))
"""Number of kills over all kinds of commands."""
EACH = 5  # kills of a command and those that continue it, before one may finish
SEED = 28


@pytest.mark.long
@pytest.mark.timeout(120 + 60 * KILLS)
@pytest.mark.parametrize("name", KINDS)
def test_killed_commands_lose_nothing(name: str, tmp_path: Path) -> None:
    """Also those that were killed while they continued one that had been killed."""
    victim, chance = Victim(name, tmp_path), random.Random(f"{SEED} {name}")
    count, kills, met, finished = max(1, KILLS // len(KINDS)), 0, 0, 0
    while kills < count:
        done = victim.kill(min(EACH, count - kills), chance)
        kills, met, finished = kills + done[0], met + done[1], finished + 1
    print(f"{name}: {kills} kills, {met} of them of a running process; {finished} outcomes compared, nothing lost")
    assert met
