"""The keys of sweep and study files.

`pairsim.sweeps.grid` and `pairsim.sweeps.study_file` read these files and check the values.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

Base = Annotated[dict[str, Any] | str, Field(description="keys that all cases share, or the path of a case file")]
Values = dict[str, list[Any] | dict[str, Any]]


class _Keys(BaseModel):
    model_config = ConfigDict(extra="forbid")


class SweepFile(_Keys):
    """A grid file: many cases for one command."""

    name: str | None = Field(None, description="name of the sweep and of its folder; default: that of the file")
    command: Literal["run", "curve", "critical"] = Field("run", description="command that computes each case")
    base: Base = {}
    grid: Values = Field(
        {},
        description="keys (dotted within a group, such as mesh.Np), each with a list or a range; all combinations",
    )
    zip: Values | list[Values] = Field(
        {}, description="keys whose values are combined one by one; several such groups (a list) are multiplied"
    )
    cases: list[dict[str, Any] | str] = Field([], description="further cases: keys and values, or paths of case files")
    exclude: list[dict[str, Any]] = Field(
        [], description="combinations of grid and zip to leave out, by values or {min, max}"
    )


class StudyFile(_Keys):
    """A study file: one case in many discretisations."""

    discretisations: list[dict[str, Any]] = Field(
        description="two or more discretisations, each with the keys that differ from base, command or repeat"
    )
    name: str | None = Field(None, description="name of the study and of its folder; default: that of the file")
    command: Literal["run", "curve"] = Field("run", description="command that computes each discretisation")
    base: Base = {}
    quantity: str | None = Field(None, description="what is compared: a column, or d_cr of curves; default: dU")
    over: Literal["t", "d"] | None = Field(
        None, description="whether `at` lists times or distances; default: d if there are curves, else t"
    )
    at: float | list[float] = Field(
        [], description="times [D_c/U_av] or distances [D_c] of the comparison; default: the end of a run"
    )
    exact: float | list[float] | None = Field(
        None, description="exact values at these times or distances, in place of a reference"
    )
    reference: Literal["finest"] | int = Field(
        "finest",
        description="index (from 0) of the discretisation that errors refer to; finest: the one with the most unknowns",
    )
    repeat: int = Field(
        1, ge=1, le=100, description="number of repetitions of each discretisation; wall times are medians"
    )
