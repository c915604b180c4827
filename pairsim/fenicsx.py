"""DOLFINx, however it was installed.

The wheel `dolfinx-solver-real` must be imported before `dolfinx`: it orders MPI ahead of the compiled modules. A
FEniCSx from Debian, conda or Spack has no such module and is imported directly.
"""

import contextlib

from pairsim.errors import PairsimError

with contextlib.suppress(ModuleNotFoundError):
    import dolfinx_solver  # noqa: F401

try:
    import dolfinx
    import dolfinx.fem
    import dolfinx.mesh
    from petsc4py import PETSc
except ImportError as error:
    raise PairsimError(
        f"FEniCSx cannot be imported ({error}); install the wheel with pip install 'pairsim[wheel]' "
        "or use a Python that has DOLFINx 0.11"
    ) from error

__all__ = ["PETSc", "dolfinx"]
