"""Detection of mpirun and srun, which set environment variables with the number of processes started."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from mpi4py import MPI

# SLURM_NTASKS is not used: it refers to the whole job, in which a batch script may run single processes.
SIZES = ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "SLURM_STEP_NUM_TASKS")


def launched() -> int:
    """Number of processes started by the launcher; 1 without a launcher or if it does not set a known variable."""
    return max((int(os.environ[name]) for name in SIZES if os.environ.get(name, "").isdigit()), default=1)


def check_launcher(comm: MPI.Comm, advice: str = "") -> None:
    """Check that all processes of the launcher are in one communicator; otherwise each would do all of the work.

    Args:
        comm: The communicator of all processes.
        advice: An alternative to mpirun, appended to the message.

    Raises:
        InputError: The launcher belongs to another MPI than mpi4py: it started several processes, but the
            communicator has one.
    """
    if launched() > comm.size == 1:
        problem = (
            f"the launcher started {launched()} processes that do not see each other: its MPI is not that of mpi4py"
        )
        cure = f"Use the mpirun installed with this Python{advice}; see docs/how-to/cluster.md"
        raise InputError("mpirun", "", None, f"{problem}. {cure}")


def launcher_communicator() -> MPI.Comm | None:
    """The communicator of a sweep started by mpirun or srun, None for a single process, which does not load MPI.

    Raises:
        InputError: The launcher belongs to another MPI than mpi4py (see `check_launcher`).
    """
    if launched() == 1 and "PMIX_RANK" not in os.environ:
        return None
    from pairsim.runtime.mpi import MPI

    check_launcher(MPI.COMM_WORLD, ", or --shard")
    return MPI.COMM_WORLD if MPI.COMM_WORLD.size > 1 else None
