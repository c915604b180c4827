"""Velocities, drag and extra pressure drop beside those of the multipoles."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import pandas as pd
from book import comparison
from book.case_parts import complete
from book.comparison import Column, Table
from book.statements import Judged
from book.study import Part

from studies.rigid import references as exact

SOURCE = "exact multipoles"


def tables(results: pd.DataFrame) -> dict[str, Table]:
    """The tables of the page."""
    spheres = {kind: rows.set_index("beta") for kind, rows in results.groupby("kind")}
    free = spheres["free"].assign(exact_U=pd.Series(exact.U), exact_dp_plus=pd.Series(exact.DP_PLUS))
    drag = pd.DataFrame(index=free.index)
    # The velocity that the force is divided by is 1, or 2 in the middle of the flow past a sphere that is held.
    for kind, unit, wanted in (("dragged", 3 * pi, exact.DRAGGED), ("held", -6 * pi, exact.HELD)):
        forces = spheres[kind]
        drag[kind], drag[f"exact {kind}"] = forces["F_1"] / unit / forces.index, pd.Series(wanted)
        drag[f"error of {kind}"] = forces["F_error_1"] / abs(unit) / forces.index
    pairs = spheres["pair"].set_index("d")
    pairs = pairs.assign(exact_U=pd.Series(exact.PAIR_U), exact_dp_plus=pd.Series(exact.PAIR_DP_PLUS))
    return {
        "free": Table(
            free,
            [
                Column("U", "U_1", to="exact_U", allowed=1e-6, source=SOURCE),
                Column("dp_plus", to="exact_dp_plus", allowed=2e-3, source=SOURCE),
            ],
        ),
        "drag": Table(
            drag,
            [
                Column(f"{kind}", error=f"error of {kind}", to=f"exact {kind}", allowed=2e-5, source=SOURCE)
                for kind in ("dragged", "held")
            ],
        ),
        "pairs": Table(
            pairs,
            [
                Column("U", "U_L", to="exact_U", allowed=1e-6, source=SOURCE),
                Column("dp_plus", to="exact_dp_plus", allowed=1e-3, source=SOURCE),
                Column("dU", error="dU_error", to=0.0, allowed=1e-11, source="reversibility"),
            ],
        ),
    }


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """That all are as close as is allowed."""
    return comparison.statements(tables(results)) | complete(results, parts)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """The tables of the page."""
    return comparison.blocks(tables(results))
