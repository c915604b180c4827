"""Whether unyielded liquid arrests neighbours: their distance then changes by creep of the regularisation alone."""

from __future__ import annotations

import numpy as np

from pairsim.runtime.arrays import Array

# Exponents -d ln dU/d ln m of creep. Between decades of m from 1e2 to 1e5 those of arrested pairs were .74 to 1.0.
CREEPS = 0.67, 1.33


def arrested(dU: Array, error: Array, bridge: Array, creep: Array) -> np.ndarray:
    """Whether neighbours are arrested; arrays of one shape, boolean.

    Args:
        dU: Their relative velocities [U_av].
        error: Half-widths of these.
        bridge, creep: See `pairsim.solvers.curves.unyielded_bridge.UnyieldedBridge`.
    """
    return np.asarray((np.abs(dU) <= error) & (bridge > 0) & (creep > CREEPS[0]) & (creep < CREEPS[1]))
