"""What the processes of mpirun or srun do together."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from pairsim.runtime.errors import InputError, PairsimError
from pairsim.runtime.signals import ENDING

if TYPE_CHECKING:
    from mpi4py import MPI

POLL = 0.1
"""Interval at which a waiting process looks for the end of the first one [s]."""
SIZES = ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "SLURM_STEP_NUM_TASKS")
"""Variables of mpirun and srun with the number of processes that they start; PMIx has none. SLURM_NTASKS is that of a
whole job, in which a batch script may run single processes."""


def communicator() -> MPI.Intracomm | None:
    """The communicator of the processes that mpirun or srun has started; None for a single one, which loads no MPI.

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


@contextmanager
def first_alone(say: Callable[[str], None]) -> Iterator[None]:
    """Context in which the first of several processes works, while the others wait for its end without computing.

    On two processes a case took .8 to 1.0 times as long as on one, so that it is computed on one.

    Args:
        say: Shows a note to the user.

    Raises:
        InputError: See `communicator`.
        SystemExit: The first process has ended; raised on the others.
    """
    comm = communicator()
    if comm is not None and comm.rank > 0:
        for number in ENDING:  # which the first process heeds
            signal.signal(number, signal.SIG_IGN)
        end = comm.Ibarrier()
        while not end.Test():
            time.sleep(POLL)
        sys.exit(0)
    if comm is not None:
        say(
            f"a case is computed on one process, and {comm.size - 1} of {comm.size} wait: several cases share the "
            "cores with mpirun -n N pairsim sweep, or as several commands at once"
        )
    try:
        yield
    finally:
        if comm is not None:
            comm.Ibarrier().Wait()
