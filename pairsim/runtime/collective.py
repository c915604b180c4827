"""Work that rank 0 does on behalf of all processes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from mpi4py import MPI


def collectively[T](comm: MPI.Comm | None, make: Callable[[], T]) -> T | None:
    """Call a function on rank 0; an error that it raises is raised on every process.

    Collective: every process of the communicator must call it.

    Args:
        comm: Communicator of all processes, or None in a single process without MPI.
        make: The function.

    Returns:
        The function's result on rank 0, None on the other processes.

    Raises:
        InputError: Raised by the function on rank 0.
        OSError: Raised by the function on rank 0.
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
