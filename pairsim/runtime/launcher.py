"""The processes that mpirun or srun has started."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from pairsim.runtime.errors import InputError, PairsimError

if TYPE_CHECKING:
    from mpi4py import MPI

SIZES = ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "SLURM_STEP_NUM_TASKS")
"""Environment variables with the number of processes that mpirun or srun has started; PMIx has none.

SLURM_NTASKS is not among them: it is the number of tasks of the whole job, whose script may also run single processes.
"""


def communicator() -> MPI.Intracomm | None:
    """The communicator of the processes that mpirun or srun has started; None for a single one, without loading MPI.

    Raises:
        InputError: The launcher belongs to another MPI than mpi4py: it started several processes, but the communicator
            has one, so that each would do all of the work.
    """
    started = max((int(os.environ[name]) for name in SIZES if os.environ.get(name, "").isdigit()), default=1)
    if started == 1 and "PMIX_RANK" not in os.environ:
        return None
    from pairsim.runtime.mpi import MPI

    if MPI.COMM_WORLD.size > 1:
        return MPI.COMM_WORLD
    if started > 1:
        problem = f"the launcher started {started} processes that do not see each other"
        cure = "its MPI is not that of mpi4py: use the mpirun installed with this Python (docs/how-to/cluster.md)"
        raise InputError("mpirun", "", None, f"{problem}; {cure}")
    return None


def rank() -> int:
    """Rank of this process; 0 without a launcher, and where MPI cannot be used."""
    try:
        comm = communicator()
    except PairsimError:
        return 0
    return comm.rank if comm is not None else 0


def check_single() -> None:
    """Raise an InputError if there are several processes: one case is computed on one.

    On two processes, cases took 0.8 to 1.0 times as long as on one.
    """
    if (comm := communicator()) is not None:
        cure = "leave mpirun or srun out, or compute several cases at once with mpirun -n N pairsim sweep"
        raise InputError("mpirun", "", None, f"one process computes a case, but {comm.size} were started; {cure}")
