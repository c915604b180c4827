"""Measurements of a rheometer (flow curves, normal stresses, moduli of small oscillations), and the same of a liquid.

Quantities are in SI units: a liquid is evaluated with U_av/D_c = 1/s, so that De is its relaxation time in s, and its
dimensionless stress times eta_0 is its stress in Pa.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pairsim.physics.homogeneous import ShearMemory, moduli, steady_shear
from pairsim.physics.liquids import Liquid
from pairsim.runtime.arrays import Array

FLOW, OSCILLATION = ("viscosity", "N1"), ("storage", "loss")
"""The quantities of steady shear, and those of small oscillations; those of a group are computed together."""
LEAST_SCATTER = 0.005  # least scatter of the logarithms that is assumed: no rheometer does better; chosen
FLAT = 0.05  # slope in logarithms below which a viscosity is that at rest; chosen
SLOWEST = 4  # number of points, at the slowest rates, from which the viscosity at rest is taken; chosen
SPARSE, OF_SPARSE = 12, 0.05  # number of points below which the scatter is at most this, the rest curvature; chosen


@dataclass(frozen=True)
class Measured:
    """Measured flow curve and moduli of a liquid.

    Attributes:
        rate: Shear rates of the flow curve [1/s], (n,).
        viscosity: Viscosities there [Pa s], (n,).
        N1: First normal stress differences there [Pa], (n,), NaN where not measured; empty if none was.
        frequency: Angular frequencies of the moduli [rad/s], (m,).
        storage: Storage moduli G' there [Pa], (m,).
        loss: Loss moduli G'' there [Pa], (m,).
    """

    rate: Array = field(default_factory=lambda: np.empty(0))
    viscosity: Array = field(default_factory=lambda: np.empty(0))
    N1: Array = field(default_factory=lambda: np.empty(0))
    frequency: Array = field(default_factory=lambda: np.empty(0))
    storage: Array = field(default_factory=lambda: np.empty(0))
    loss: Array = field(default_factory=lambda: np.empty(0))

    @property
    def curves(self) -> list[tuple[str, Array, Array]]:
        """The name of each quantity, its shear rates or frequencies, and its values, which are positive."""
        all_ = [("viscosity", self.rate, self.viscosity), ("N1", self.rate[: len(self.N1)], self.N1)]
        all_ += [("storage", self.frequency, self.storage), ("loss", self.frequency, self.loss)]
        return [(name, x[y > 0], y[y > 0]) for name, x, y in all_ if (y > 0).any()]

    @property
    def count(self) -> int:
        """The number of all values."""
        return sum(len(x) for _, x, _ in self.curves)

    @property
    def kinds(self) -> set[str]:
        """Which quantities were measured."""
        return {name for name, _, _ in self.curves}


def of_liquid(liquid: Liquid, eta_0: float, x: dict[str, Array], memory: ShearMemory | None = None) -> dict[str, Array]:
    """Quantities of `Measured` for a liquid [SI], by name, each at its own shear rates or frequencies.

    Quantities that are computed together are evaluated at the rates of all of them.

    Args:
        liquid: The liquid, in the units of this module.
        eta_0: Its unit of viscosity [Pa s].
        x: Shear rates [1/s] or frequencies [rad/s] by the name of the quantity.
        memory: Has the steady shear of a similar liquid at the same rates, from which Newton's method starts.
    """
    found = dict[str, Array]()
    for names in (FLOW, OSCILLATION):
        if own := [x[name] for name in names if name in x]:
            every = np.unique(np.concatenate(own))
            both = moduli(liquid, every) if names is OSCILLATION else steady_shear(liquid, every, memory)
            for name, values in zip(names, both, strict=True):
                if name in x:
                    found[name] = eta_0 * values[np.searchsorted(every, x[name])]
    return {name: found[name] for name in x}


def scatter(data: Measured) -> float:
    """Scatter of the points about smooth curves, the standard deviation of the logarithms.

    It is the least of the estimates from differences of second, third and fourth order, as the curvature between points
    that are far apart contributes less to the higher ones.
    """
    found = []
    for order, squares in ((2, 6), (3, 20), (4, 70)):
        each = [np.diff(np.log(y), order) ** 2 / squares for _, _, y in data.curves if len(y) > order + 1]
        if each:
            found.append(float(np.sqrt(np.median(np.concatenate(each)) / 0.455)))
    most = np.inf if max(len(y) for _, _, y in data.curves) >= SPARSE else OF_SPARSE
    return float(np.clip(min(found, default=0.0), LEAST_SCATTER, most))


def at_rest(x: Array, viscosity: Array) -> float | None:
    """The viscosity at rest [Pa s]: the median of the slowest points; None if it changes there or these are too few.

    Args:
        x: Shear rates [1/s] or frequencies [rad/s], (n,).
        viscosity: Viscosities there [Pa s], (n,).
    """
    slow = np.argsort(x)[:SLOWEST]
    if len(slow) < SLOWEST or abs(np.polyfit(np.log(x[slow]), np.log(viscosity[slow]), 1)[0]) > FLAT:
        return None
    return float(np.median(viscosity[slow]))
