"""Keys of sweep and study files: what each is for, and which there are.

`pairsim.sweeps.grid` and `pairsim.sweeps.study_file` read these files and check what stands under the keys.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

Base = Annotated[
    dict[str, Any] | str, Field(description="keys of the case that all others change, or the path of a case file")
]
Values = dict[str, list[Any] | dict[str, Any]]


class _Keys(BaseModel):
    model_config = ConfigDict(extra="forbid")


class SweepFile(_Keys):
    """A grid file: many cases of one command."""

    name: str | None = Field(None, description="name of the sweep and of its folder; that of the file by default")
    command: Literal["run", "curve", "critical"] = Field("run", description="what is repeated")
    base: Base = {}
    grid: Values = Field({}, description="keys (mesh.Np in a group) with a list or a range each; every combination")
    zip: Values | list[Values] = Field(
        {}, description="keys whose values go together; a list of such groups multiplies"
    )
    cases: list[dict[str, Any] | str] = Field([], description="further cases: their keys, or paths of case files")
    exclude: list[dict[str, Any]] = Field([], description="entries of grid and zip left out: values, or {min, max}")


class StudyFile(_Keys):
    """A study file: one case in many discretisations."""

    discretisations: list[dict[str, Any]] = Field(
        description="two or more, each the keys in which it differs from base; command and repeat are allowed too"
    )
    name: str | None = Field(None, description="name of the study and of its folder; that of the file by default")
    command: Literal["run", "curve"] = Field("run", description="what is computed")
    base: Base = {}
    quantity: str | None = Field(None, description="what is compared: a column, or d_cr of curves; dU by default")
    over: Literal["t", "d"] | None = Field(
        None, description="whether at holds times or distances; d where there are curves, else t"
    )
    at: float | list[float] = Field([], description="times [D_c/U_av] or distances [D_c]; the end of a run by default")
    exact: float | list[float] | None = Field(None, description="exact values there, in place of a reference")
    reference: Literal["finest"] | int = Field(
        "finest", description="index of the discretisation that errors refer to; finest: the most unknowns"
    )
    repeat: int = Field(1, ge=1, le=100, description="how often each is computed; times are medians")
