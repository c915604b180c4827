"""What a process can learn about the Slurm job in which it runs."""

from __future__ import annotations

import os
import subprocess

PATIENCE = 20.0  # time allowed for the answer of a controller [s]; chosen, busy ones take seconds


def job_end() -> float | None:
    """Time at which the time limit of the Slurm job ends it.

    Slurm tells it in SLURM_JOB_END_TIME; where older versions (such as 22.05) do not, squeue is asked.

    Returns:
        Seconds since the epoch, or None: outside of Slurm, without a time limit, or if Slurm does not answer.
    """
    end = os.environ.get("SLURM_JOB_END_TIME", "")
    if not end and (job := os.environ.get("SLURM_JOB_ID")):
        try:
            end = subprocess.run(
                ["squeue", "--noheader", "--jobs", job, "--format", "%e"],
                env={**os.environ, "SLURM_TIME_FORMAT": "%s"},  # seconds since the epoch
                capture_output=True,
                text=True,
                timeout=PATIENCE,
                check=False,
            ).stdout.strip()
        except (OSError, subprocess.SubprocessError):
            return None
    return float(end) if end.isdigit() else None
