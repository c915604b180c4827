"""Whether unyielded liquid arrests neighbours: their distance then changes by creep of the regularisation alone."""

from __future__ import annotations

import numpy as np

from pairsim.runtime.arrays import Array

# Least and largest exponent -d ln dU/d ln m that counts as creep, with the m of the regularisation. Those of arrested
# pairs were .74 to 1.0 between decades of m from 1e2 to 1e5.
CREEPS = 0.67, 1.33


def arrested(dU: Array, error: Array, bridge: Array, creep: Array) -> np.ndarray:
    """Whether neighbours are arrested: joined by unyielded liquid, with a dU that is creep alone.

    Args:
        dU: Their relative velocities [U_av].
        error: Half-widths of these.
        bridge, creep: See `pairsim.solvers.curves.unyielded_bridge.UnyieldedBridge`.

    Returns:
        A boolean array; all five have the same shape.
    """
    return np.asarray((np.abs(dU) <= error) & (bridge > 0) & (creep > CREEPS[0]) & (creep < CREEPS[1]))
