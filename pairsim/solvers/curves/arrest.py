"""Whether unyielded liquid arrests neighbours: their distance then changes only by creep due to the regularisation."""

from __future__ import annotations

import numpy as np

from pairsim.runtime.arrays import Array

# Smallest and largest exponent -d ln dU/d ln m that counts as creep, with the regularisation m. Exponents of arrested
# pairs were .74 to 1.0 between decades of m from 1e2 to 1e5.
CREEPS = 0.67, 1.33


def arrested(dU: Array, error: Array, bridge: Array, creep: Array) -> np.ndarray:
    """Whether neighbours are arrested: joined by unyielded liquid, with a dU that is mere creep.

    Args:
        dU: Their relative velocities [U_av], shape (N-1,).
        error: Half-widths of these [U_av].
        bridge, creep: As in `pairsim.solvers.curves.unyielded_bridge.UnyieldedBridge`.

    Returns:
        A boolean array; arguments and result have the same shape.
    """
    return np.asarray((np.abs(dU) <= error) & (bridge > 0) & (creep > CREEPS[0]) & (creep < CREEPS[1]))
