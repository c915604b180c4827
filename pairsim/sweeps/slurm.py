"""`--emit slurm`: a script for a Slurm job array in which each task computes one shard of a sweep."""

from __future__ import annotations

import math
import shlex
from pathlib import Path

from pairsim.runtime.child_process import module_command
from pairsim.sweeps.grid import Grid

MOST_TASKS = 32
DEFAULT_WALLTIME = 24 * 3600.0


def job_script(
    grid: Grid, directory: Path, *, tasks: int | None, ranks_per_case: int, walltime: float | None, extra: list[str]
) -> str:
    """The text of the script.

    Args:
        grid: The grid.
        directory: Folder of the sweep.
        tasks: Number of tasks of the array; default: one for each case, at most 32.
        ranks_per_case: MPI processes of each case.
        walltime: Time limit of a task [s]; default: one day.
        extra: Further options of `pairsim sweep`.
    """
    count = min(len(grid.cases), tasks or MOST_TASKS)
    minutes = math.ceil((walltime or DEFAULT_WALLTIME) / 60)
    hours = sum(case.checked.estimate.seconds for case in grid.cases) / 3600
    options = [*extra, *(["--ranks-per-case", str(ranks_per_case)] if ranks_per_case > 1 else [])]
    command = shlex.join(module_command("pairsim", "sweep", str(grid.source.resolve())))
    command += " " + shlex.join(["-o", str(directory.resolve()), *options, "-q"])
    name = "".join(letter if letter.isalnum() or letter in "._-" else "-" for letter in grid.name)
    return f"""#!/usr/bin/env bash
# {len(grid.cases)} cases of pairsim {grid.command.name}, about {hours:.2g} core hours, in {count} tasks.
# Add what the site requires (account, partition, modules). If a task runs out of time, submit the script again:
# finished cases are not repeated. At the end, the command below without --shard writes one table of all cases.
#SBATCH --job-name={name}
#SBATCH --array=1-{count}
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task={ranks_per_case}
#SBATCH --time={minutes // 60:02d}:{minutes % 60:02d}:00
#SBATCH --signal=B:TERM@60
#SBATCH --output={name}-%A-%a.log

export OMP_NUM_THREADS=1
# exec, so that the signal before the time limit reaches pairsim, which then stops its case in order.
exec {command} --shard "$SLURM_ARRAY_TASK_ID/{count}"
"""
