"""Points of curves without cells, whose dU are formulas."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from pairsim.physics.solids import soft
from pairsim.solvers.parameters import Parameters


def made_point(d: float, dU: Any, slope: Any, error: float = 0.0) -> Any:
    """A point of which curves are made: dU and its slope of every gap, at the same distance."""
    dUs, slopes = np.atleast_1d(np.asarray(dU, dtype=float)), np.atleast_1d(np.asarray(slope, dtype=float))
    return SimpleNamespace(
        parameters=Parameters((d,) * len(dUs), soft(*(0.1,) * (len(dUs) + 1))),
        d=d,
        dU=float(dUs[0]),
        dUs=dUs,
        discrete=SimpleNamespace(dU=dUs),
        slopes=slopes,
        slope_at_rest=float(slopes[0]),
        dU_errors=np.full(len(dUs), error),
        correction=np.zeros(len(dUs)),
    )
