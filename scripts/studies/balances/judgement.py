"""What is integrated beside what must be there."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import pandas as pd
from book import comparison
from book.case_parts import complete
from book.comparison import Column, Table
from book.statements import Judged
from book.study import Part


def tables(results: pd.DataFrame) -> dict[str, Table]:
    """The tables of the page."""
    rows = results.set_index("pair")
    soft = rows[rows["volume"].notna()]
    soft = soft.assign(sphere=pi * soft["beta"] ** 3 / 6)
    flow_rate = Column("flow rate", "flow_rate", to=pi / 4, allowed=1e-4, source="pi/4")
    volume = Column("volume of a particle", "volume", to="sphere", allowed=5e-6, source="that of the sphere")
    forces = [
        Column(each, f"force_{each}", to=f"outside_{each}", allowed=1e-4, source="the force from outside")
        for each in "TL"
    ]
    power = Column("power", to="put_in", allowed=5e-5, source="what is put in")
    return {"mass": Table(soft, [flow_rate, volume]), "force": Table(rows, forces), "energy": Table(rows, [power])}


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """That all are as close as is allowed."""
    return comparison.statements(tables(results)) | complete(results, parts)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """The tables of the page."""
    return comparison.blocks(tables(results))
