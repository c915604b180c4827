"""The groups of keys in a case: cells, time steps, limits of a run and its output."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, Field

from pairsim.cases import values
from pairsim.cases.accuracy import DEFAULT, PIPE_CELL, ROW_GRADING, SETTINGS
from pairsim.cases.default_end import DEFAULT_END, SHORTEST_RUN

MOST_OUTPUTS = 10_000
USUAL = SETTINGS[DEFAULT]
LIQUIDS = "a liquid without a memory, one that thins and one that hardens in extension"


def _defaults(name: str) -> str:
    """The default values of a cell size, of runs and of quasi-steady solutions."""
    values = [
        ", ".join(f"{getattr(getattr(each, kind), name):g}" for kind in ("newtonian", "thinning", "hardening"))
        for each in (USUAL.in_time, USUAL.steady)
    ]
    return f"default: by accuracy; at {DEFAULT}, in {LIQUIDS}: {values[0]} in runs, else {values[1]}"


class Keys(BaseModel):
    """A group of keys; others than those of its model are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    def filled(self, values: Mapping[str, Any], always: Collection[str] = ()) -> Self:
        """A copy with values of keys that are not given, which are not given there either; of some keys in any case."""
        given = self.model_fields_set
        copy = self.model_copy(update={key: each for key, each in values.items() if key in always or key not in given})
        object.__setattr__(copy, "__pydantic_fields_set__", set(given))
        return copy


class MeshOptions(Keys):
    """Cell sizes."""

    Np: values.Whole = Field(
        USUAL.in_time.thinning.Np,
        ge=6,
        le=1000,
        description=f"least number of cells on the half-circle of each particle ({_defaults('Np')})",
    )
    grading: values.Grading = Field(
        USUAL.in_time.thinning.grading,
        description="length of the cells at the poles of a particle over that at its equator, of Np cells in all "
        "(default: by accuracy; 1 in a liquid without a memory, and in one that hardens in extension)",
    )
    growth: values.Growth = Field(0.15, description="growth of the cell size per unit distance from a particle")
    gap_cells: values.CellCount = Field(0, description="cells across a gap between particles (0: Np/4)")
    gap_exponent: values.Fraction = Field(
        0.0, description="below d = 0.1 the number of cells across a gap grows as (0.1/d)^gap_exponent"
    )
    wall_cells: values.CellCount = Field(0, description="cells between a particle and the wall (0: Np/4)")
    max_size: values.CellSize = Field(
        USUAL.in_time.thinning.max_size,
        description=f"largest cell size [D_c] ({_defaults('max_size')}; less beside small particles in viscoelastic "
        f"liquids, and {PIPE_CELL:g} without particles)",
    )
    adapt: bool = Field(
        True,
        strict=True,
        description="make cells smaller where the estimated error is more than accuracy allows (default: true, unless "
        "Np is given)",
    )
    core_growth: values.Growth = Field(0.3, description="growth of the cell size per unit depth inside a particle")
    rows: values.Rows = Field(
        USUAL.in_time.thinning.rows,
        description="distance from the particles beyond which cells lie in rows along the tube [D_c] (default: by "
        "accuracy; 0, no rows, without particles)",
    )
    row_grading: values.Grading = Field(
        1.0,
        description="length of the cells across the tube on the axis over that at the wall, in rows (default: by "
        f"accuracy; {ROW_GRADING:g} in runs in viscoelastic liquids, else 1)",
    )


class TimeOptions(Keys):
    """Time steps."""

    end: values.Time = Field(
        SHORTEST_RUN,
        description=f"end time [D_c/U_av] (default: {DEFAULT_END}, by when a start from rest is forgotten)",
    )
    tol: values.Tolerance = Field(
        USUAL.time_tol,
        description="allowed local error of the particles' velocities [U_av] (default: by accuracy)",
    )
    first_step: values.Time = Field(5e-4, description="size of the first step [D_c/U_av]")
    max_step: values.Time = Field(2.0, description="largest step [D_c/U_av]")
    fixed_step: values.Time | None = Field(
        None, description="constant step size [D_c/U_av], without error control; shortened to land on output times"
    )


class Limits(Keys):
    """Conditions that end a run before its end time."""

    min_gap: values.Gap = Field(0.002, description="contact: the run ends when a gap falls below this [D_c]")
    max_gap: values.Distance | None = Field(None, description="the run ends when a gap exceeds this [D_c]")
    wall_time: values.Seconds | None = Field(
        None, description="largest wall time of the whole run [s]; the run fails beyond it"
    )
    max_steps: values.Whole = Field(
        100_000, ge=1, le=10**9, description="largest number of steps; the run fails beyond it"
    )


class OutputOptions(Keys):
    """When files are written. Steps land on `times` and `every`; the first and the last step are always written."""

    times: tuple[values.Time, ...] = Field(
        (), max_length=MOST_OUTPUTS, description="times at which fields are written to fields.xdmf [D_c/U_av]"
    )
    every: values.Time | None = Field(None, description="interval between fields in fields.xdmf [D_c/U_av]")
    frames: values.Whole = Field(
        20,
        ge=0,
        le=MOST_OUTPUTS,
        description="approximate number of times in fields.xdmf, at steps as they come; if times and every are unset",
    )
    fields: bool = Field(True, strict=True, description="whether fields.xdmf is written")
    checkpoint: values.Interval = Field(
        60.0, description="interval between checkpoints (checkpoint.npz, for run --resume) [s of wall time]"
    )
