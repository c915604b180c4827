"""`--emit slurm`: a script for a Slurm job array in which each task computes one shard of a sweep.

Number of tasks, time limit and memory come from the cost estimate of the cases (`config/cost.py`).
"""

from __future__ import annotations

import math
import shlex
from dataclasses import dataclass
from pathlib import Path

import jinja2

from pairsim.runtime.child_process import module_command
from pairsim.runtime.duration import duration
from pairsim.sweeps.grid import Grid
from pairsim.sweeps.options import Options
from pairsim.sweeps.queue import shards

SCRIPT = Path(__file__).parent / "templates" / "job.sh.j2"
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

    @property
    def hours_minutes(self) -> tuple[int, int]:
        """The time limit as Slurm takes it."""
        return divmod(math.ceil(self.time / 60), 60)


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


def job_script(grid: Grid, directory: Path, options: Options) -> tuple[str, list[str]]:
    """The text of the script, and warnings.

    Args:
        grid: The grid.
        directory: Folder of the sweep.
        options: Number of parts and wall time are those of the array, see `array_of`; its tasks have the other ones.
    """
    walltime = options.walltime
    array = array_of(grid, tasks=options.shard.n if options.shard else None, walltime=walltime)
    extra = [word for setting in options.settings for word in ("--set", setting)]
    extra += ["--cold"] if options.cold else []
    extra += ["--case-timeout", f"{options.case_timeout:g}"] if options.case_timeout else []
    words = [*module_command("pairsim", "sweep", str(grid.source.resolve())), "-o", str(directory.resolve()), *extra]
    estimated = f"{TIME_FACTOR:g} times the estimate and {duration(START)}, at most {duration(LONGEST)}"
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, keep_trailing_newline=True)
    environment.filters["duration"] = duration
    text = environment.from_string(SCRIPT.read_text(encoding="utf-8")).render(
        array=array,
        cases=len(grid.cases),
        command=grid.command.name,
        total=sum(case.estimate.seconds for case in grid.cases),
        name="".join(letter if letter.isalnum() or letter in "._-" else "-" for letter in grid.name),
        limit="as given by --walltime" if walltime else estimated,
        memory_factor=MEMORY_FACTOR,
        least_memory=f"{LEAST_MEMORY / 1e9:g}",
        signal=SIGNAL,
        words=shlex.join([*words, "-q"]),
    )
    return text, warnings_of(array, len(grid.cases))
