"""Criteria for remeshing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pairsim.runtime.arrays import Array

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
