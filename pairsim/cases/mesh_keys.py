"""The group `mesh` of a case: cell sizes, whose defaults `accuracy` sets."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from pairsim.cases.accuracy import DEFAULT, PIPE_CELL, ROW_GRADING, USUAL
from pairsim.cases.keys import Key, Keys
from pairsim.cases.values import Number, Whole, zero_or

THINNING = USUAL.in_time["thinning"]

Growth = Annotated[Number, Field(ge=0.01, le=2)]
Grading = Annotated[Number, Field(ge=0.1, le=10)]
CellCount = Annotated[Whole, Field(ge=0, le=1000)]


def _defaults(name: str) -> str:
    """The default values of a cell size in runs and in quasi-steady solutions, in words."""
    values = [
        ", ".join(f"{getattr(cells, name):g}" for cells in each.values()) for each in (USUAL.in_time, USUAL.steady)
    ]
    kinds = (
        "Newtonian liquids, other liquids without a memory, viscoelastic ones that thin, and viscoelastic ones that "
        "harden in extension"
    )
    return f"default: by accuracy; at {DEFAULT}, for {kinds}: {values[0]} in runs, else {values[1]}"


class MeshOptions(Keys):
    """Cell sizes."""

    Np: Annotated[Whole, Key("N_p")] = Field(
        THINNING.Np,
        ge=6,
        le=1000,
        description=f"smallest number of cells along the half-circle of each particle ({_defaults('Np')})",
    )
    grading: Grading = Field(
        THINNING.grading,
        description="length of the cells at the poles of a particle over that at its equator; their number remains Np "
        "(default: by accuracy; 1 in liquids without a memory and in those that harden in extension)",
    )
    growth: Growth = Field(0.15, description="growth of the cell size per unit distance from a particle")
    gap_cells: CellCount = Field(0, description="number of cells across a gap between particles (0: Np/4)")
    gap_exponent: Annotated[Number, Field(ge=0, le=1)] = Field(
        0.0, description="the number of cells across a gap below d = 0.1 grows as (0.1/d)^gap_exponent"
    )
    wall_cells: CellCount = Field(0, description="number of cells between a particle and the wall (0: Np/4)")
    max_size: Annotated[Number, Field(ge=1e-4, le=0.5)] = Field(
        THINNING.max_size,
        description=f"largest cell size [D_c] ({_defaults('max_size')}; less with small particles in viscoelastic "
        f"liquids, and {PIPE_CELL:g} without particles)",
    )
    adapt: bool = Field(
        True,
        strict=True,
        description="refine the mesh where the estimated error is larger than accuracy allows (default: true, unless "
        "Np is given)",
    )
    core_growth: Growth = Field(0.3, description="growth of the cell size per unit depth inside a particle")
    rows: Annotated[Number, *zero_or(0.05, 1e4)] = Field(
        THINNING.rows,
        description="distance from the particles beyond which the cells lie in rows along the tube [D_c]; 0: no rows "
        "(default: by accuracy; 0 without particles)",
    )
    row_grading: Grading = Field(
        1.0,
        description="in the rows, height of the cells on the axis over that at the wall (default: by accuracy; "
        f"{ROW_GRADING:g} in runs in viscoelastic liquids, else 1)",
    )
