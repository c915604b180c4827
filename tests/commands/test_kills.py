"""SIGKILL at random moments: the next command finishes, and the outcome is that of a command that was never killed."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest
from support.kills import KINDS, Victim

KILLS = int(os.environ.get("PAIRSIM_KILLS", "20"))
"""Number of kills over all kinds of commands."""
SEED = 28


@pytest.mark.long
@pytest.mark.timeout(60 * KILLS)
@pytest.mark.parametrize("name", KINDS)
def test_killed_commands_lose_nothing(name: str, tmp_path: Path) -> None:
    """Moments are spread over the whole duration, imports and the last file included."""
    victim, chance = Victim(name, tmp_path), random.Random(f"{SEED} {name}")
    count = max(1, KILLS // len(KINDS))
    moments = [victim.seconds * chance.uniform(0.1, 1.1) for _ in range(count)]
    killed = [victim.kill(moment, chance) for moment in moments]
    print(f"{name}: {sum(killed)} of {count} killed between {min(moments):.2f} and {max(moments):.2f} s, nothing lost")
    assert any(killed)
