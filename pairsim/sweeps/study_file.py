"""The keys of study files, and the checks that involve several of them; `study.py` forms the cases."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal

from pydantic import Field

from pairsim.cases.keys import Keys
from pairsim.cases.mistakes import Mistake
from pairsim.cases.values import Positive, Whole
from pairsim.sweeps.grid_file import Changes, FolderName, as_list


class StudyFile(Keys):
    """A study file: one case in many discretisations."""

    discretisations: list[dict[str, Any]] = Field(
        min_length=2,
        description="two or more discretisations, each with the keys that differ from base",
        examples=["[{mesh.Np: 20, time.tol: 1e-4}, {mesh.Np: 40}]"],
    )
    name: FolderName | None = Field(None, description="name of the study and of its folder; default: that of the file")
    command: Literal["run", "curve"] = Field("run", description="command that computes each discretisation")
    base: Changes = Field({}, description="keys that all discretisations share, or the path of a case file")
    quantity: str = Field("dU", description="what is compared: a column of the results")
    at: Positive | list[Positive] = Field(
        [], description="times [D_c/U_av] or distances [D_c] where it is compared; default: the end of the run or curve"
    )
    reference: Literal["finest"] | Whole = Field(
        "finest",
        description="index (from 0) of the discretisation from which errors are measured; finest: that with the most "
        "unknowns",
    )

    @property
    def places(self) -> list[float]:
        """The values of `at`."""
        return as_list(self.at)


def check_study(file: StudyFile) -> Iterator[Mistake]:
    """Check the keys of a study file against each other; yields mistakes."""
    last = len(file.discretisations) - 1
    if isinstance(file.reference, int) and not 0 <= file.reference <= last:
        yield Mistake("reference", file.reference, f"must be finest, or the index of a discretisation from 0 to {last}")
