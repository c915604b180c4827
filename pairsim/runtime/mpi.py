"""Imports MPI, with a one-line error that says how to install it: mpi4py on PyPI contains no MPI library."""

from __future__ import annotations

import os
from contextlib import suppress

from pairsim.runtime.errors import EnvironmentFailure

INSTALL = (
    "install the wheel of FEniCSx with pip install 'pairsim[fenicsx]', or install pairsim into the Python of a FEniCSx "
    "with DOLFINx 0.11"
)

# UCX, which MPICH loads, would catch SIGHUP: a closed terminal would not end a command, and nohup would be undone.
os.environ.setdefault("UCX_DEBUG_SIGNO", "0")

try:
    from mpi4py import MPI
except (ImportError, RuntimeError) as error:
    reason = str(error).splitlines()[0] if str(error) else type(error).__name__
    raise EnvironmentFailure(f"MPI cannot be loaded ({reason}); {INSTALL}") from error

if MPI.COMM_WORLD.size == 1:
    # MPICH's shared memory, a megabyte, has no use in a single process, and a killed process would leave it behind.
    with suppress(OSError):
        os.unlink(f"/dev/shm/mpich_shm_{os.getpid():x}_0")

__all__ = ["INSTALL", "MPI"]
