"""Criteria for remeshing, and the generation of meshes on one process."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import RunFailure
from pairsim.runtime.fenicsx import MPI

# All three were chosen. A new mesh is made when the Jacobian of a cell falls below LEAST_DISTORTION times its reference
# value, or when a gap has changed by the factor GAP_RATIO. A new mesh around undeformed spheres is used only if its
# smallest ratio is at least FRESH_DISTORTION.
LEAST_DISTORTION = 0.25
FRESH_DISTORTION = 0.45
GAP_RATIO = 1.6


def needs_mesh(
    distortion: float, gaps: Array, reference_gaps: Sequence[float], least: float = LEAST_DISTORTION
) -> bool:
    """Whether a new mesh is needed.

    Args:
        distortion: Smallest ratio of a liquid cell's current to its reference Jacobian.
        gaps: Current distances, shape (N-1,).
        reference_gaps: Distances for which the mesh was made, N-1 values.
        least: Smallest ratio that is accepted.
    """
    if distortion < least:
        return True
    ratio = gaps / np.asarray(reference_gaps) if gaps.size else np.ones(1)
    return bool(ratio.max() > GAP_RATIO or ratio.min() < 1 / GAP_RATIO)


def on_root[T](comm: MPI.Comm, make: Callable[[], T]) -> T:
    """Call a function on rank 0 and broadcast its result; collective.

    Raises:
        RunFailure: Raised by the function on rank 0; raised on every process.
    """
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
