"""Unyielded liquid between neighbours, and how their relative velocity depends on its regularisation.

Where unyielded liquid joins two particles, their distance changes only by creep due to the regularisation: dU vanishes
as 1/m. Shear rates in unyielded liquid always do so, but dU does not near an ordinary zero of a curve, nor between
particles that are surrounded by yielding liquid. `pairsim.solvers.curves.arrest` draws the conclusion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pairsim.fem.unyielded import bridges
from pairsim.quantities.scales import TUBE_RADIUS
from pairsim.runtime.arrays import Array
from pairsim.solvers.curves.interpolant import NEGLIGIBLE_DU
from pairsim.solvers.steady.scene import SteadySolver

APART = 10.0  # ratio of the two values of m at which dU is compared; chosen


@dataclass(frozen=True)
class UnyieldedBridge:
    """Unyielded liquid between neighbours.

    Attributes:
        bridge: Radius of the unyielded cylinder that joins neighbours, as in `pairsim.fem.unyielded.bridges` [D_c],
            (N-1,); 0 where there is none.
        creep: The power of 1/m with which dU at held distances falls between m/`APART` and m, (N-1,). It is NaN where
            it is not computed, because there is no bridge or the sign of dU is certain, and where dU has opposite signs
            at both m.
        plug: Radius of the plug in the flow without particles [D_c]; 0 in liquids without a yield stress.
    """

    bridge: Array
    creep: Array
    plug: float

    @classmethod
    def of(cls, steady: SteadySolver, undecided: np.ndarray) -> UnyieldedBridge:
        """Unyielded liquid at the present solution, at which the scene is left.

        Args:
            steady: The scene.
            undecided: Whether the interval of each dU contains 0, (N-1,); boolean.
        """
        h, x = steady.state()
        bridge, liquid = bridges(steady.scene, x, h), steady.parameters.liquid
        yields_at = liquid.solvent.yield_stress
        stress = abs(steady.flows.at(liquid).gradient) * TUBE_RADIUS / 2  # at the wall, 0 without flow
        plug = TUBE_RADIUS * yields_at / max(stress, yields_at) if yields_at else 0.0
        creep = np.full(len(bridge), np.nan)
        fields = steady.constraints.fields["U_p"]
        asked = undecided & (bridge > 0) & (np.abs(np.diff(steady.y[fields])) > NEGLIGIBLE_DU)
        if asked.any():
            here = steady.snapshot
            if steady.solve(steady.parameters.less_regularised(1 / APART)).converged:
                with np.errstate(invalid="ignore", divide="ignore"):
                    power = np.log(np.diff(steady.y[fields]) / np.diff(here.y[fields])) / np.log(APART)
                creep[asked] = power[asked]
            steady.recall(here)
            steady.forget()
        return cls(bridge, creep, plug)
