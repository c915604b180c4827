"""Cell sizes and tolerances for each value of `accuracy:`, the error of dU relative to the peak of the curve.

The settings for three percentages were measured (docs/explanation/accuracy.md); those for others are interpolated.
Where the error of dU is estimated they are a first guess, and the mesh is adapted until the estimate is small enough:
`pairsim.solvers.curves.adaptation`, for runs `pairsim.solvers.transient.adaptation`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field

LEAST_PERCENT, MOST_PERCENT = 0.01, 20.0
MOST_TOLERANCE = 0.1  # largest tolerance of time steps when it is extrapolated beyond the levels


def percentage(value: Any) -> str:
    """Validate a percentage and write it in its shortest form, such as "0.5%".

    Raises:
        ValueError: The value is not a percentage, or is outside the range.
    """
    number = re.fullmatch(r"\s*(\d{1,9}\.?\d{0,9}|\.\d{1,9})\s*%\s*", value) if isinstance(value, str) else None
    if number is None or not LEAST_PERCENT <= float(number[1]) <= MOST_PERCENT:
        raise ValueError(f"must be a percentage from {LEAST_PERCENT:g}% to {MOST_PERCENT:g}%")
    return f"{float(number[1]):g}%"


Accuracy = Annotated[
    str, Field(pattern=r"^\s*(\d+\.?\d*|\.\d+)\s*%\s*$", examples=["0.5%"]), BeforeValidator(percentage)
]
Liquid = Literal["newtonian", "viscous", "thinning", "hardening"]
"""Kinds of liquids by the cells that they need:

- newtonian: any cells resolve the parabolic profile in the tube;
- viscous: without a memory, but with another profile;
- thinning: viscoelastic and shear-thinning; the polymer stress is advected far downstream;
- hardening: viscoelastic and hardening in extension; there are thin stress layers at the particles.
"""
# In runs in viscoelastic liquids, the length across the tube of cells in rows: that on the axis over that at the wall.
# During start-up the stress varies most near the wall, and the error that cells of equal length make there is advected
# past the pair. Quasi-steady pairs gain nothing from it (docs/explanation/decisions.md).
ROW_GRADING = 3.5
# `Cells.rows` in liquids without a memory: farther from the particles only the profile of the tube has to be resolved
# (docs/explanation/decisions.md).
PROFILE_ROWS = 1.0
PIPE_CELL = 0.05  # largest cell in a tube without particles, where only the profile over the radius matters


@dataclass(frozen=True)
class Cells:
    """Sizes of cells."""

    Np: int  # number of cells on the half-circle of a particle
    max_size: float  # upper bound on the cell size [D_c]
    per_beta: float = math.inf  # upper bound on the cell size over the smallest diameter; the stricter bound holds
    rows: float = 0.0  # distance from the particles beyond which cells lie in rows along the tube [D_c]; 0: no rows
    grading: float = 1.0  # length of arcs at the poles over that at the equator

    def largest(self, beta: float) -> float:
        """Largest cell size [D_c] when `beta` is the smallest particle diameter [D_c]."""
        return min(self.max_size, self.per_beta * beta)


@dataclass(frozen=True)
class Settings:
    """Discretisation settings for one value of `accuracy`."""

    steady: Mapping[Liquid, Cells]  # cells of quasi-steady solutions, whose dU contains the estimate of its error
    in_time: Mapping[Liquid, Cells]  # cells of runs
    s_jump: float  # change of log c within a cell above which larger errors of dU were measured
    time_tol: float  # of a run: local error of the velocities [U_av] that a BDF2 step of the same size would have

    def mesh(self, liquid: Liquid, betas: Iterable[float], in_time: bool = False) -> dict[str, float]:
        """The keys of `mesh` for particles with these diameters [D_c], of runs in time or of quasi-steady solutions."""
        chosen = (self.in_time if in_time else self.steady)[liquid]
        beta = min(betas, default=0.0)
        if not beta:
            return {"Np": chosen.Np, "max_size": chosen.max_size if liquid == "newtonian" else PIPE_CELL, "rows": 0.0}
        cells = {"Np": chosen.Np, "max_size": chosen.largest(beta), "rows": chosen.rows, "grading": chosen.grading}
        return cells | {"row_grading": ROW_GRADING} if in_time and liquid in ("thinning", "hardening") else cells


def _by_liquid(newtonian: Cells, profile: float, *others: Cells) -> dict[Liquid, Cells]:
    """Cells by kind of liquid; `profile` is the largest cell [D_c] if the viscosity depends on the shear rate."""
    viscous = replace(newtonian, max_size=profile, rows=PROFILE_ROWS)
    return dict(zip(get_args(Liquid), (newtonian, viscous, *others), strict=True))


# Stresses have thin layers around the equator of a particle, where the liquid is as fast as it, but not at its poles.
_GRADED = 2.0
SETTINGS: dict[str, Settings] = {
    "5%": Settings(
        _by_liquid(Cells(20, 0.2, rows=2.0), 0.1, Cells(18, 0.12, 0.5, 0.5, _GRADED), Cells(24, 0.06, 0.3, 0.5)),
        _by_liquid(Cells(20, 0.2, rows=2.0), 0.1, Cells(20, 0.1, 0.35, 0.5, _GRADED), Cells(28, 0.05, 0.25, 0.5)),
        s_jump=2.0,
        time_tol=1e-3,
    ),
    "1%": Settings(
        _by_liquid(Cells(28, 0.2, rows=2.0), 0.07, Cells(20, 0.066, 0.3, 0.5, _GRADED), Cells(40, 0.05, 0.25, 0.5)),
        _by_liquid(Cells(40, 0.2, rows=2.0), 0.07, Cells(28, 0.05, 0.18, 0.5, _GRADED), Cells(64, 0.05, 0.25, 0.5)),
        s_jump=1.6,
        time_tol=3e-4,
    ),
    "0.1%": Settings(
        _by_liquid(Cells(40, 0.2, rows=2.0), 0.05, Cells(36, 0.038, 0.15, 0.5, _GRADED), Cells(64, 0.04, 0.2, 0.5)),
        _by_liquid(
            Cells(56, 0.14, rows=2.0), 0.05, Cells(80, 0.025, 0.125, 0.5, _GRADED), Cells(80, 0.025, 0.125, 0.5)
        ),
        s_jump=1.0,
        time_tol=5e-5,
    ),
}
DEFAULT = "1%"
USUAL = SETTINGS[DEFAULT]


def percent(accuracy: str) -> float:
    """The number of a valid accuracy, in percent."""
    return float(accuracy.removesuffix("%"))


def settings_of(accuracy: str) -> Settings:
    """The settings of a valid accuracy, interpolated by power laws between the two nearest levels of `SETTINGS`.

    Beyond the outermost levels, cells and `s_jump` keep the values of the level, and the tolerance of time steps is
    extrapolated, up to `MOST_TOLERANCE`.
    """
    wanted, levels = percent(accuracy), sorted(SETTINGS, key=percent)
    upper = next((i for i, level in enumerate(levels) if i and percent(level) >= wanted), len(levels) - 1)
    low, high = levels[upper - 1], levels[upper]
    part = math.log(wanted / percent(low)) / math.log(percent(high) / percent(low))
    inside = min(max(part, 0.0), 1.0)
    a, b = SETTINGS[low], SETTINGS[high]

    def power(x: float, y: float, at: float) -> float:
        return x if x == y else float(f"{x * (y / x) ** at:.3g}")

    def cells(x: Cells, y: Cells) -> Cells:
        sizes = {name: power(size, getattr(y, name), inside) for name, size in vars(x).items()}
        return Cells(round(sizes.pop("Np")), **sizes)

    return Settings(
        {kind: cells(each, b.steady[kind]) for kind, each in a.steady.items()},
        {kind: cells(each, b.in_time[kind]) for kind, each in a.in_time.items()},
        s_jump=power(a.s_jump, b.s_jump, inside),
        time_tol=min(power(a.time_tol, b.time_tol, part), MOST_TOLERANCE),
    )
