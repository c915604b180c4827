"""When a reference mesh has served its time, and gmsh on one process for all."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import RunFailure
from pairsim.runtime.fenicsx import MPI

# A cell squeezed below this fraction of its reference area, or a gap changed by this factor, calls for a new mesh;
# one around undeformed spheres must do better than the second figure to be used.
LEAST_DISTORTION = 0.25
FRESH_DISTORTION = 0.45
GAP_RATIO = 1.6


def needs_mesh(
    distortion: float, gaps: Array, reference_gaps: Sequence[float], least: float = LEAST_DISTORTION
) -> bool:
    """Whether a new mesh is due.

    Args:
        distortion: Smallest ratio of a liquid cell's current to its reference Jacobian.
        gaps: Distances now.
        reference_gaps: Those that the mesh was made for.
        least: Distortion that is still borne.
    """
    if distortion < least:
        return True
    ratio = gaps / np.asarray(reference_gaps) if gaps.size else np.ones(1)
    return bool(ratio.max() > GAP_RATIO or ratio.min() < 1 / GAP_RATIO)


def on_root[T](comm: MPI.Comm, make: Callable[[], T]) -> T:
    """Run gmsh on one process; every process gets the result, or raises the same error."""
    made: T | RunFailure | None = None
    if comm.rank == 0:
        try:
            made = make()
        except RunFailure as error:
            made = error
    result: T | RunFailure = comm.bcast(made)
    if isinstance(result, RunFailure):
        raise result
    return result
