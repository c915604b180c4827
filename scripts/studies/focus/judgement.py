"""Rates over their limits for small spheres, and what is of first order; the square duct."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from book import comparison
from book.case_parts import complete
from book.comparison import Column, Table
from book.statements import Judged
from book.study import Part

from studies.focus import references as exact
from studies.focus.cases import ALPHAS, CA_E, DE, XI

THEORY, ILFHC = "the limit of small spheres", "the data of ILFHC"


def over_limit(rows: pd.DataFrame) -> pd.DataFrame:
    """Rates and half-widths over the limits of small spheres, without the drag; alpha is NaN for the soft ones."""
    elastic = -16 * (1 + 11 * rows["alpha"] / 9) * (1 - XI) * DE * rows["beta"] ** 2
    limit = elastic.where(rows["alpha"].notna(), -100 / 9 * CA_E * rows["beta"] ** 2)
    return rows.assign(over=rows["rate"] / limit, error=rows["half_width"] / limit.abs())


def small_spheres(rows: pd.DataFrame) -> Table:
    """Rates over limits, extrapolated to beta 0 by the next order in it: beta^2 with the drag, beta^3 of soft ones."""
    found = {}
    table = over_limit(rows).sort_values("beta")
    for alpha in ALPHAS:
        one, two = (table["over"] * table["drag"])[table["alpha"] == alpha]
        found[f"rigid, Giesekus, alpha {alpha:g}"] = (4 * one - two) / 3
    one, two = table["over"][table["alpha"].isna()]
    found["soft, Newtonian"] = (8 * one - two) / 7
    frame = pd.Series(found, name="rate over limit").rename_axis("sphere").to_frame()
    return Table(frame, [Column("rate over limit", to=1.0, allowed=2e-3, source=THEORY, shown=".5f")])


def first_order(rows: pd.DataFrame) -> Table:
    """Rates over the same limits, and those of inertia over Re beta^3."""
    table, frame = over_limit(rows), pd.DataFrame()
    for alpha in (*ALPHAS, None):
        name = "soft" if alpha is None else f"alpha {alpha:g}"
        chosen = table["alpha"].isna() & table["rate"].notna() if alpha is None else table["alpha"] == alpha
        own = table[chosen].set_index("beta")
        frame[name], frame[f"error {name}"] = own["over"], own["error"]
    own = table[table["by_Re"].notna()].set_index("beta")
    frame["inertia"], frame["error inertia"] = own["by_Re"] / own.index**3, own["half_width"] / own.index**3
    names = [name for name in frame if not str(name).startswith("error")]
    return Table(frame, [Column(str(name), error=f"error {name}") for name in names])


def square_duct(rows: pd.DataFrame) -> Table:
    """Velocity over the largest of the flow, lateral drag, and the rate by inertia over (diameter/width)^3."""
    table = rows.set_index(rows["size"].rename("diameter over width"))
    table = table.assign(U=table["U"] / 2, inertia=table["by_Re"] / table["size"] ** 3)
    for name, known in (("U", exact.U), ("drag", exact.DRAG), ("inertia", exact.INERTIA)):
        table[f"exact {name}"] = pd.Series(known)
    columns = [
        Column("U", to="exact U", allowed=5e-4, source=ILFHC, shown=".6f"),
        Column("drag", to="exact drag", allowed=4e-3, source=ILFHC, shown=".4f"),
        Column("inertia", to="exact inertia", allowed=3e-2, source=ILFHC, shown=".4f"),
    ]
    return Table(table, columns)


def tables(results: pd.DataFrame) -> dict[str, Table]:
    """The tables of the page."""
    kinds = {str(kind): rows for kind, rows in results.groupby("kind")}
    made = {"limits": small_spheres, "first-order": first_order, "duct": square_duct}
    return {name: make(kinds[name]) for name, make in made.items() if name in kinds}


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """That all are as close as is allowed."""
    return comparison.statements(tables(results)) | complete(results, parts)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """The tables of the page."""
    return comparison.blocks(tables(results))
