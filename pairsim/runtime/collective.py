"""What the first process of a job does for all of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from mpi4py import MPI


def collectively[T](comm: MPI.Comm | None, make: Callable[[], T]) -> T | None:
    """Run on the first process; its error is raised on every one, its result is None on the others.

    Args:
        comm: Communicator of all processes, each of which calls this; None: there is one, without MPI.
        make: What to run.

    Raises:
        InputError, OSError: What it raised.
    """
    made: T | None = None
    error: Exception | None = None
    if comm is None or comm.rank == 0:
        try:
            made = make()
        except (InputError, OSError) as caught:
            error = caught
    if comm is not None:
        error = comm.bcast(error)
    if error is not None:
        raise error
    return made
