"""Drag beside that of another code, and deformation beside dclab's table."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Any

import pandas as pd
from book import comparison
from book.case_parts import complete
from book.comparison import Column, Table
from book.statements import Judged
from book.study import Part

from studies.thinning import references as known

OTHER_CODE, DCLAB = "a code of another method", "dclab's table"


def drag(rows: pd.DataFrame, unbounded: pd.DataFrame) -> Table:
    """F over 3 pi K V^n D_p^(2 - n) on all meshes, and the upper bound of that in an unbounded liquid."""
    unit = 3 * pi * rows["beta"] ** (2 - rows["n"])
    rows = rows.assign(X=rows["F_1"] / unit, error=rows["F_error_1"] / unit)
    wide: Any = rows.pivot(index="n", columns="accuracy", values=["X", "error"]).sort_index(ascending=False)
    accuracies = list(rows["accuracy"].unique())
    frame = pd.DataFrame({"exact": pd.Series(known.DRAG)}, index=wide.index)
    for accuracy in accuracies:
        frame[f"X {accuracy}"], frame[f"error {accuracy}"] = wide["X"][accuracy], wide["error"][accuracy]
    if len(unbounded):
        frame["unbounded"] = unbounded.set_index("n")["X"]
    *coarser, finest = accuracies
    columns = [Column(f"X, `accuracy: {each}`", f"X {each}", f"error {each}") for each in coarser]
    judged = Column(f"`{finest}`", f"X {finest}", f"error {finest}", "exact", 2e-4, OTHER_CODE)
    columns += [judged] + ([Column("unbounded", shown=".4f")] if len(unbounded) else [])
    return Table(frame, columns)


def cytometry(rows: pd.DataFrame) -> Table:
    """The deformation of the hull."""
    frame = rows.set_index(["beta", "Ca_e"])[["deformation_hull"]]
    frame["table"] = pd.Series(known.DEFORMATION)
    return Table(frame, [Column("deformation", "deformation_hull", "", "table", 0.015, DCLAB)])


def tables(results: pd.DataFrame) -> dict[str, Table]:
    """The tables of the page."""
    dragged, carried, unbounded = (results[results["kind"] == kind] for kind in ("dragged", "carried", "unbounded"))
    return {"drag": drag(dragged, unbounded), "cytometry": cytometry(carried)}


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """That all are as close as is allowed."""
    return comparison.statements(tables(results)) | complete(results, parts)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """The tables of the page."""
    return comparison.blocks(tables(results))
