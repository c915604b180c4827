"""Pressure gradients, velocities and conformations beside solutions of another kind."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from book import comparison
from book.case_parts import complete
from book.comparison import Column, Table
from book.statements import Judged
from book.study import Part

from studies.tube import references as exact
from studies.tube.cases import LIQUIDS
from studies.tube.pipe import LAWS, gradient_of

SOLVER, SHEAR, PARABOLIC = "another one-dimensional solution", "steady shear alone", "the exact start-up"


def tables(results: pd.DataFrame) -> dict[str, Table]:
    """The tables of the page."""
    kinds = {str(kind): rows for kind, rows in results.groupby("kind")}
    one = kinds["one dimension"].set_index(["liquid", "quantity"])["value"]
    mesh = kinds["steady"].set_index(["liquid", "quantity"])["value"] if "steady" in kinds else pd.Series(dtype=float)
    rows = [
        {"De": De, "quantity": name, "exact": value}
        | {kind: values.get((f"Giesekus, De {De:g}", name), np.nan) for kind, values in (("one", one), ("mesh", mesh))}
        for De, known in exact.STEADY.items()
        for name, value in known.items()
    ]
    laws = pd.DataFrame({"law": list(LAWS), "exact": [gradient_of(liquid) for liquid in LAWS.values()]})
    for kind, values in (("one", one), ("mesh", mesh)):
        laws[kind] = [values.get((name, "dp/L"), np.nan) for name in LAWS]
    found = {
        "giesekus": Table(
            pd.DataFrame(rows).set_index(["De", "quantity"]),
            [
                Column("one dimension", "one", to="exact", allowed=1e-7, source=SOLVER),
                Column("mesh", to="exact", allowed=1e-4, source=SOLVER),
            ],
        ),
        "laws": Table(
            laws.set_index("law"),
            [
                Column("one dimension", "one", to="exact", allowed=1e-6, source=SHEAR),
                Column("mesh", to="exact", allowed=4e-4, source=SHEAR),
            ],
        ),
    }
    starting = kinds["start-up"].query("quantity == 'dp/L'").pivot(index="t", columns="liquid", values="value")
    xi, t = LIQUIDS["Oldroyd-B, De 1"].xi, starting.index.to_numpy()
    starting["Giesekus"], starting["exact Giesekus"] = starting["Giesekus, De 1"], pd.Series(exact.START_UP)
    columns = [Column("Giesekus", to="exact Giesekus", allowed=2e-3, source=SOLVER)]
    if "Oldroyd-B, De 1" in starting:
        starting["Oldroyd-B"] = starting["Oldroyd-B, De 1"]
        starting["exact Oldroyd-B"] = 32 * (xi + (1 - xi) * (1 - np.exp(-t)))
        columns.append(Column("Oldroyd-B", to="exact Oldroyd-B", allowed=2e-3, source=PARABOLIC))
    return found | {"start-up": Table(starting, columns)}


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """That all are as close as is allowed."""
    return comparison.statements(tables(results)) | complete(results, parts)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """The tables of the page."""
    return comparison.blocks(tables(results))
