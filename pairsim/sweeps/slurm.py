"""`--emit slurm`: a script for a Slurm job array in which each task computes one shard of a sweep.

Number of tasks, time limit and memory come from the cost estimate of the cases (`config/cost.py`).
"""

from __future__ import annotations

import math
import shlex
from dataclasses import dataclass
from pathlib import Path

from pairsim.runtime.child_process import module_command
from pairsim.runtime.duration import duration
from pairsim.sweeps.grid import Grid
from pairsim.sweeps.queue import shards

TIME_FACTOR = 3.0  # time limit over the estimated time, which is right within a factor of 2, less often of 3
MEMORY_FACTOR = 1.5  # memory over the estimate, which is right within 15 %
START = 300.0  # added to the time limit for imports, the compilation of forms and Slurm's early signal [s]
SHORTEST = 900.0  # estimated work below which it is not worth having a task of its own [s]
LONGEST = 24 * 3600.0  # largest time limit [s]; many sites allow one day
STEP = 600.0  # time limits are multiples of this [s]
WIDEST = 32  # largest number of tasks, unless more are needed to stay below the largest time limit
MOST = 1000  # tasks that an array can have where Slurm's MaxArraySize is at its default of 1001
SWEEP_MEMORY = 100e6  # of the process that hands out the cases [bytes]
LEAST_MEMORY = 1e9  # for compiling forms [bytes]
MEMORY_STEP = 100e6  # memory is a multiple of this [bytes]
SIGNAL = 60  # seconds before the time limit at which Slurm is asked for SIGTERM
EARLIER = 60  # seconds by which Slurm may send it earlier still
SHORTEST_WALLTIME = 180.0  # time limit below which Slurm's signal leaves a task hardly any time [s]


@dataclass(frozen=True)
class Array:
    """A job array.

    Attributes:
        tasks: Number of tasks.
        work: Estimated wall time of the longest task [s].
        time: Time limit of a task [s].
        memory: Memory of a task [bytes].
    """

    tasks: int
    work: float
    time: float
    memory: float

    @property
    def fits(self) -> bool:
        """Whether the time limit leaves the longest task `TIME_FACTOR` times its estimate."""
        return TIME_FACTOR * self.work + SIGNAL + EARLIER <= self.time


def array_of(grid: Grid, *, tasks: int | None, walltime: float | None) -> Array:
    """Divide a grid into the tasks of a job array.

    Args:
        grid: The grid.
        tasks: Number of tasks; default: so many that each has at least a quarter of an hour of work, at most 32, or as
            many as the time limit needs.
        walltime: Time limit of a task [s]; default: three times the estimate and five minutes, at most one day.
    """
    estimates = [case.estimate for case in grid.cases]
    total = sum(estimate.seconds for estimate in estimates)
    if tasks is None:
        usable = max((walltime or LONGEST) - START, SHORTEST_WALLTIME)
        wanted = max(min(WIDEST, math.ceil(total / SHORTEST)), math.ceil(TIME_FACTOR * total / usable))
        tasks = min(wanted, MOST)
    tasks = min(tasks, len(grid.cases))
    work = max(sum(case.estimate.seconds for case in part) for part in shards(grid.cases, tasks))
    time = walltime or min(math.ceil((TIME_FACTOR * work + START) / STEP) * STEP, LONGEST)
    case = max(estimate.memory for estimate in estimates)
    memory = max(MEMORY_FACTOR * case + SWEEP_MEMORY, LEAST_MEMORY)
    return Array(tasks, work, time, math.ceil(memory / MEMORY_STEP) * MEMORY_STEP)


def warnings_of(array: Array, cases: int) -> list[str]:
    """What the user of a job array of so many cases should know before submitting it."""
    found = []
    if array.time < SHORTEST_WALLTIME:
        found.append(
            f"Slurm stops a task {SIGNAL} to {SIGNAL + EARLIER} s before its time limit, so that --walltime "
            f"{duration(array.time)} leaves little or no time to compute; use 3 minutes or more"
        )
    if not array.fits:
        found.append(
            f"the longest task may not end within its time limit of {duration(array.time)} (estimate: "
            f"{duration(array.work)}); submit the script again for what is left"
            + (", or use more tasks (--shard 1/N)" if array.tasks < cases else "")
        )
    return found


def job_script(
    grid: Grid, directory: Path, *, tasks: int | None, walltime: float | None, extra: list[str]
) -> tuple[str, list[str]]:
    """The text of the script, and warnings.

    Args:
        grid: The grid.
        directory: Folder of the sweep.
        tasks: Number of tasks of the array; default: see `array_of`.
        walltime: Time limit of a task [s]; default: see `array_of`.
        extra: Further options of `pairsim sweep`.
    """
    array = array_of(grid, tasks=tasks, walltime=walltime)
    total = sum(case.estimate.seconds for case in grid.cases)
    minutes = math.ceil(array.time / 60)
    command = shlex.join(module_command("pairsim", "sweep", str(grid.source.resolve())))
    command += " " + shlex.join(["-o", str(directory.resolve()), *extra, "-q"])
    name = "".join(letter if letter.isalnum() or letter in "._-" else "-" for letter in grid.name)
    limit = (
        "as given by --walltime"
        if walltime
        else f"{TIME_FACTOR:g} times the estimate and {duration(START)}, at most {duration(LONGEST)}"
    )
    text = f"""#!/usr/bin/env bash
# {len(grid.cases)} cases of pairsim {grid.command.name}, estimated at {duration(total)} on one core, in {array.tasks} \
task{"s" if array.tasks > 1 else ""}; the longest: {duration(array.work)}.
# Time limit: {limit}.
# Memory: {MEMORY_FACTOR:g} times the estimate of the largest case, at least {LEAST_MEMORY / 1e9:g} GB.
# Add what the site requires (account, partition, modules). If a task runs out of time, submit the script again:
# finished cases are not repeated. At the end, the command below without --shard writes one table of all cases.
#SBATCH --job-name={name}
#SBATCH --array=1-{array.tasks}
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --time={minutes // 60:02d}:{minutes % 60:02d}:00
#SBATCH --mem={array.memory / 1e6:.0f}M
#SBATCH --signal=B:TERM@{SIGNAL}
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output={name}-%A-%a.log

export OMP_NUM_THREADS=1
# exec, so that the signal before the time limit reaches pairsim, which then stops its case in order.
exec {command} --shard "$SLURM_ARRAY_TASK_ID/{array.tasks}"
"""
    return text, warnings_of(array, len(grid.cases))
