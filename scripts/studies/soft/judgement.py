"""dU/Ca_e extrapolated to Ca_e = 0, and the modes of the sphere, beside first-order theory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pandas as pd
from book import comparison
from book.case_parts import complete
from book.comparison import Column, Table
from book.statements import Judged
from book.study import Part

from studies.soft import references as exact
from studies.soft.cases import SMALL

SOURCE = "first-order theory"


def tables(results: pd.DataFrame) -> dict[str, Table]:
    """The tables of the page; that of the sphere if it is computed."""
    pairs = results[results["kind"] == "pair"]
    pairs = pairs.assign(slope=pairs["dU"] / pairs["Ca_e"], error=pairs["dU_error"] / pairs["Ca_e"])
    wide: Any = pairs.pivot(index=["beta", "d"], columns="Ca_e", values=["slope", "error"])
    far, near = (wide["slope"][Ca_e] for Ca_e in SMALL)
    slopes = pd.DataFrame({"far": far, "near": near, "limit": 2 * near - far, "error": wide["error"].max(axis=1)})
    slopes["exact"] = [exact.S[place] for place in slopes.index]
    found = {
        "slopes": Table(
            slopes,
            [
                Column("dU/Ca_e at 0.001", "far", shown=".6g"),
                Column("at 0.0005", "near", shown=".6g"),
                Column("extrapolated", "limit", "error", to="exact", allowed=2e-3, source=SOURCE),
            ],
        )
    }
    if len(sphere := results[results["kind"] == "sphere"]):
        even = sphere[["f_2", "f_4"]].abs().max(axis=1)
        found["sphere"] = Table(
            sphere.assign(even=even).reset_index(drop=True),
            [
                Column("f_3", to=exact.F_3, allowed=3e-3, source=SOURCE),
                Column("f_5", to=exact.F_5, allowed=3e-2, source=SOURCE),
                Column("largest of f_2, f_4", "even", to=0.0, allowed=0.01, source="symmetry"),
            ],
        )
    return found


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """That all are as close as is allowed."""
    return comparison.statements(tables(results)) | complete(results, parts)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """The tables of the page."""
    return comparison.blocks(tables(results))
