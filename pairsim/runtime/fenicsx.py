"""Imports DOLFINx, PETSc and MPI in the order that they require: MPI ahead of the compiled modules.

The FEniCSx wheel requires nothing else; its module `dolfinx_solver` would do the same, but also read the metadata of
all installed packages.
"""

import os
import sys
from typing import Any

from pairsim.runtime.errors import EnvironmentFailure
from pairsim.runtime.signals import sigterm_waits

# PETSc's signal handler would turn SIGTERM into an abort, whereas pairsim completes the time step and writes its files.
# `-options_left no` suppresses PETSc's list of unused options, which an interrupt before the first solve would cause.
# PETSc reads its options when it is first loaded, hence the environment variable.
os.environ["PETSC_OPTIONS"] = f"{os.environ.get('PETSC_OPTIONS', '')} -no_signal_handler -options_left no".strip()

# The system may deliver SIGTERM to a thread of MPI or BLAS, in which METIS's handler would run (see `sigterm_waits`).
# Threads inherit the signal mask of the thread that creates them; SIGTERM is therefore blocked while these libraries
# are loaded, and commands import this module first.
with sigterm_waits():
    # gmsh, numpy and scipy each load their own BLAS with its threads.
    try:
        import gmsh  # noqa: F401
    except OSError as error:
        raise EnvironmentFailure(
            f"gmsh cannot be loaded ({error}); on Debian: apt install libgl1 libglu1-mesa libxrender1 libxcursor1 "
            "libxft2 libxinerama1"
        ) from error
    import numpy  # noqa: F401
    import scipy.linalg  # noqa: F401

    from pairsim.runtime.mpi import INSTALL, MPI

try:
    import petsc4py

    # A case is computed on one process; by default PETSc would wait for all processes of an MPI job.
    petsc4py.init(comm=MPI.COMM_SELF)
    # DOLFINx reads its own options from the command line, and fails if a name there is not in UTF-8.
    arguments, sys.argv = sys.argv, ["pairsim"]
    try:
        import dolfinx.fem
        import dolfinx.mesh
        import petsc4py.PETSc
    finally:
        sys.argv = arguments
except ImportError as error:
    raise EnvironmentFailure(f"FEniCSx cannot be imported ({error}); {INSTALL}") from error

# The type stubs of both packages are incomplete.
dolfinx: Any = dolfinx
PETSc: Any = petsc4py.PETSc

__all__ = ["MPI", "PETSc", "dolfinx", "petsc_version"]


def petsc_version() -> str:
    """Version of the PETSc in use."""
    return ".".join(map(str, PETSc.Sys.getVersion()))
