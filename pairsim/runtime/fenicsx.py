"""DOLFINx, however it was installed.

The wheel `dolfinx-solver-real` must be imported before `dolfinx`: it orders MPI ahead of the compiled modules. A
FEniCSx from Debian, conda or Spack has no such module and is imported directly.
"""

import contextlib
import os
from typing import Any

from pairsim.runtime.errors import PairsimError
from pairsim.runtime.signals import sigterm_waits

# PETSc would take SIGTERM for itself and abort; pairsim ends its runs in order. Nor is it to tell of options that were
# set for a solver which a signal kept from its first solve. The options are read when PETSc is first loaded, which is
# before any code here could pass them.
os.environ["PETSC_OPTIONS"] = f"{os.environ.get('PETSC_OPTIONS', '')} -no_signal_handler -options_left no".strip()

# A thread of MPI or of BLAS that takes SIGTERM would run METIS's handler for it (see `sigterm_waits`); a thread begins
# with the mask of the one that makes it. Commands import this module first, therefore, and MPI from here.
with sigterm_waits():
    # Each has a BLAS of its own.
    try:
        import gmsh  # noqa: F401
    except OSError as error:
        raise PairsimError(
            f"gmsh cannot be loaded ({error}); on Debian: apt install libglu1-mesa libxrender1 libxcursor1 libxft2 "
            "libxinerama1"
        ) from error
    import numpy  # noqa: F401
    import scipy.linalg  # noqa: F401

    from pairsim.runtime.mpi import INSTALL, MPI

with contextlib.suppress(ModuleNotFoundError):
    import dolfinx_solver  # noqa: F401

try:
    import dolfinx.fem
    import dolfinx.mesh
    import petsc4py.PETSc
except ImportError as error:
    raise PairsimError(f"FEniCSx cannot be imported ({error}); {INSTALL}") from error

# Both come with stubs that miss half of what they have.
dolfinx: Any = dolfinx
PETSc: Any = petsc4py.PETSc

__all__ = ["MPI", "PETSc", "dolfinx"]
