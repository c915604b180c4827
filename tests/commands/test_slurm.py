"""`scripts/slurm-test`: arrays, srun, time limits, requeue and crashes on a Slurm of one node."""

from __future__ import annotations

import subprocess
import sys

import pytest
from support.inputs import ROOT


@pytest.mark.long
@pytest.mark.timeout(700)
def test_pairsim_on_a_real_slurm() -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "slurm_test.py")], capture_output=True, text=True, check=False
    )
    if done.returncode == 2 and "apt install" in done.stderr:
        pytest.skip(f"NO SLURM, nothing of it is tried: {done.stderr.strip()}")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "All of it was done" in done.stdout
