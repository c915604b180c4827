"""Child processes: their command line, their environment, and their end with that of their parent."""

from __future__ import annotations

import ctypes
import os
import signal
import sys

LAUNCHER = ("PMI_", "PMI2_", "PMIX_", "HYDRA_", "HYDI_", "MPI_", "PALS_", "PRTE_", "OMPI_", "SLURM_")
_PR_SET_PDEATHSIG = 1


def module_command(module: str, *words: str) -> list[str]:
    """Command line that runs a module with these words and this Python interpreter, from any folder.

    The option `-P` keeps the current folder off the import path: otherwise a file yaml.py there would be imported
    instead of the library, and a folder named pairsim would hide an editable installation. PYTHONPATH is respected.
    """
    return [sys.executable, "-P", "-m", module, *words]


def clean_environment() -> dict[str, str]:
    """The environment without the launcher's variables, so that MPI in a child starts as a job of its own.

    BLAS and OpenMP are limited to one thread, as a sweep runs one process per core.
    """
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(LAUNCHER) or name.startswith("OMPI_ALLOW")
    }
    return kept | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def end_with_parent() -> None:
    """Ask the system to kill this process when the thread that started it ends; called first in a child, on Linux."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
