"""What started this process: mpirun and srun tell in the environment how many processes they have started."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from mpi4py import MPI

# Slurm's SLURM_NTASKS is that of the whole job, in which a batch script may well run single processes.
SIZES = ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "SLURM_STEP_NUM_TASKS")


def _size() -> int:
    """Processes that the launcher has started; 1 without one, or where it does not tell."""
    return max((int(os.environ[name]) for name in SIZES if os.environ.get(name, "").isdigit()), default=1)


def check_launcher(comm: MPI.Comm, advice: str = "") -> None:
    """Make sure that the processes of a job are one job to MPI, too: otherwise each would do all of the work.

    Args:
        comm: The communicator of all processes.
        advice: What else would do.

    Raises:
        InputError: They do not see each other.
    """
    if _size() > comm.size == 1:
        problem = f"the launcher started {_size()} processes that do not see each other: its MPI is not that of mpi4py"
        cure = f"Use the mpirun beside this Python{advice}; docs/how-to/cluster.md"
        raise InputError("mpirun", "", None, f"{problem}. {cure}")


def launcher_communicator() -> MPI.Comm | None:
    """The communicator of a sweep's job, None for a sweep on its own, which needs no MPI.

    Raises:
        InputError: The job has several processes that do not see each other.
    """
    if _size() == 1 and "PMIX_RANK" not in os.environ:
        return None
    from pairsim.runtime.mpi import MPI

    check_launcher(MPI.COMM_WORLD, ", or --shard")
    return MPI.COMM_WORLD if MPI.COMM_WORLD.size > 1 else None
