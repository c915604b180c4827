"""How a bead alone moves back to the axis, to first order in softness, elasticity and inertia, without computing.

Its rate per displacement is, in units of U_av/D_c,

    a = by_Ca_e Ca_e + by_Psi_1 Psi_1 + by_Psi_2 Psi_2 + by_Re Re,

with the normal stress coefficients of slow shear, over eta_0 D_c/U_av. The factors, functions of beta, are in
focusing.csv, which the study focus_table (scripts/studies) makes with the solver of `pairsim focus`; so are the limits
up to which first order holds.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import Self

import numpy as np

from pairsim.physics.liquids import Liquid
from pairsim.physics.slow_flow import SecondOrderFluid, departure, slower
from pairsim.physics.solids import Solid

FILE = Path(__file__).with_name("focusing.csv")
POWERS = {"by_Ca_e": 2, "by_Psi_1": 2, "by_Psi_2": 2, "by_Re": 3}
"""Powers of beta with which rates of small beads vanish."""
OFF = 0.2  # largest relative error of a rate with which first order counts as valid; chosen
WALL_RATE = 8.0  # shear rate of a Newtonian liquid at the wall [U_av/D_c]
NEAR_ENOUGH = 1e-6  # tolerance of the largest De, over the range in which it is searched for; chosen


@dataclass(frozen=True)
class Row:
    """The row of focusing.csv for one diameter.

    Attributes:
        beta: Diameter [D_c].
        U: Velocity of a rigid bead in a Newtonian liquid [U_av].
        by_Ca_e: Derivative of the rate [U_av/D_c] by Ca_e.
        by_Psi_1: That by the first normal stress coefficient.
        by_Psi_2: That by the second one.
        by_Re: That by the Reynolds number rho U_av D_c/eta_0.
        Ca_e_most: Ca_e up to which first order is off by at most `OFF`, in a Newtonian liquid.
        De_most: Relaxation time [D_c/U_av] up to which it is, if viscosity and first normal stress coefficient do not
            depend on the shear rate; of several modes the longest counts.
        departure_most: Relative change of viscosity and first normal stress coefficient, from slow shear to the shear
            rate at the wall, up to which it is.
    """

    beta: float
    U: float
    by_Ca_e: float
    by_Psi_1: float
    by_Psi_2: float
    by_Re: float
    Ca_e_most: float
    De_most: float
    departure_most: float

    @classmethod
    def names(cls) -> list[str]:
        return [each.name for each in fields(cls)]

    @classmethod
    def at(cls, beta: float) -> Self | None:
        """The row of a diameter; None outside of the table.

        Numbers are interpolated linearly between diameters, rates after division by the power of beta with which they
        vanish.
        """
        table = _table()
        if not table[0, 0] <= beta <= table[-1, 0]:
            return None
        powers = [POWERS.get(name, 0) for name in cls.names()]
        columns = zip(table.T, powers, strict=True)
        found = (np.interp(beta, table[:, 0], each / table[:, 0] ** power) * beta**power for each, power in columns)
        return cls(*map(float, found))


@cache
def _table() -> np.ndarray:
    """The numbers of the file, shape (diameters, columns)."""
    with FILE.open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    assert header == Row.names(), f"{FILE.name} is made by scripts/study focus_table --page"
    return np.array(rows, dtype=float)


@dataclass(frozen=True)
class FirstOrderFocusing:
    """A bead alone on the axis of a tube, to first order.

    Attributes:
        rate: Rate per displacement without inertia, negative towards the axis [U_av/D_c].
        tube: Length of tube within which a small displacement falls to a tenth [D_c].
        Re_c: Reynolds number rho U_av D_c/eta_0 from which inertia drives it off the axis.
        share: The share of the range of first order that is used: above 1 its error exceeds `OFF`.
        Ca_e_most: Ca_e up to which first order holds at the De given.
        De_most: De up to which it holds at the Ca_e given.
    """

    rate: float
    tube: float
    Re_c: float
    share: float
    Ca_e_most: float
    De_most: float

    @property
    def holds(self) -> bool:
        """Whether first order is within `OFF` of the rate."""
        return self.share <= 1

    @classmethod
    def of(cls, beta: float, solid: Solid | None, liquid: Liquid) -> Self | None:
        """First-order focusing of a bead in a liquid.

        Args:
            beta: Diameter [D_c].
            solid: What it is made of; None if it is rigid.
            liquid: The liquid.

        Returns:
            None where there is no first order: for a rigid bead in a Newtonian liquid, in a liquid whose viscosity
            depends on the shear rate however slow the flow is, for a viscous solid, or outside of the table.
        """
        row = Row.at(beta)
        Ca_e = float(solid.Ca_e) if solid is not None else 0.0
        if row is None or liquid.yielding is not None or not liquid.solvent.linear or (solid and solid.viscosity):
            return None
        if not (Ca_e or liquid.modes):
            return None
        slow = SecondOrderFluid.of(liquid)
        rate = row.by_Ca_e * Ca_e + row.by_Psi_1 * slow.Psi_1 + row.by_Psi_2 * slow.Psi_2
        soft, elastic = (Ca_e / row.Ca_e_most) ** 2, _share(row, liquid)
        return cls(
            rate,
            math.log(10) * row.U / -rate,
            -rate / row.by_Re,
            soft + elastic,
            row.Ca_e_most * math.sqrt(max(1 - elastic, 0.0)),
            _largest_De(row, liquid, 1 - soft),
        )


def _share(row: Row, liquid: Liquid) -> float:
    """The share of the range of first order that the elasticity of the liquid uses."""
    if not liquid.modes:
        return 0.0
    return (liquid.longest / row.De_most) ** 2 + departure(liquid, WALL_RATE) / row.departure_most


def _largest_De(row: Row, liquid: Liquid, left: float) -> float:
    """The De up to which elasticity uses no more than the share `left` of the range; 0 where there is none."""
    if not liquid.modes or left <= 0:
        return 0.0

    def beyond(factor: float) -> float:  # nearly linear, as both parts of the share grow about as De^2
        return math.sqrt(_share(row, slower(liquid, factor)) / left) - 1

    least, most = 0.0, row.De_most * math.sqrt(left) / liquid.longest
    below, above, width = -1.0, beyond(most), NEAR_ENOUGH * most
    factor, value = most, above
    while abs(value) > NEAR_ENOUGH and most - least > width:  # regula falsi, as modified in Illinois
        factor = (least * above - most * below) / (above - below)
        value, before = beyond(factor), value
        if value > 0:
            most, above, below = factor, value, below / 2 if before > 0 else below
        else:
            least, below, above = factor, value, above / 2 if before <= 0 else above
    return (factor if abs(value) <= NEAR_ENOUGH else least) * float(liquid.De)
