"""How many errors are inside half-widths, and how large they are beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from book import comparison, pages
from book.case_parts import complete
from book.half_widths import half_widths_hold
from book.made import made
from book.statements import Judged
from book.study import Part

from studies.error_bars.parts import KINDS

KNOWN, NEGLIGIBLE = 0.2, 2e-4
"""An error of `scenes` is judged if the two truths differ by less than a part of it, and it is no smaller part of the
largest |dU| of the curve."""
TRUTH = 1 / 3
"""An error of `runs` is judged if the half-width of the truth is below a part of that which is judged."""


def judged(results: pd.DataFrame) -> pd.DataFrame:
    """All errors with their verdicts: inside the half-width or outside; undecided or negligible ones decide nothing."""
    columns = [
        "part",
        "kind",
        "scene",
        "law",
        "De",
        "mesh",
        "quantity",
        "value",
        "half_width",
        "error",
        "known",
        "peak",
    ]
    table = results.reindex(columns=[*columns, "ended"])
    table = table[table["ended"].isna()]
    error, by_two = table["error"].abs(), table["kind"] == "scenes"
    unknown = np.where(by_two, table["known"] > KNOWN * error, table["known"] > TRUTH * table["half_width"])
    conditions: Any = [by_two & (error < NEGLIGIBLE * table["peak"]), unknown, error <= table["half_width"]]
    verdict = np.select(conditions, ["negligible", "undecided", "inside"], "outside")
    return table.assign(verdict=verdict, ratio=error / table["half_width"])


def able(table: pd.DataFrame) -> pd.DataFrame:
    """The errors that can be judged."""
    return table[table["verdict"].isin(["inside", "outside"])]


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """What the study states, judged by what is stored."""
    found, table = dict[str, Judged](), able(judged(results))
    for kind, what in zip(KINDS, ("dU on given meshes", "quantities of runs"), strict=True):
        own = table[table["kind"] == kind]
        if len(own):
            of_kind = half_widths_hold(own["ratio"], own["known"] / own["half_width"], what)
            found |= {f"{kind}: {text}": each for text, each in of_kind.items()}
    return found | complete(results, parts)


def summary(table: pd.DataFrame, by: str) -> pd.DataFrame:
    """How many errors are inside, a row for each value of a column."""
    lines = []
    for name, own in table.groupby(by, sort=False):
        good = able(own)
        inside = int((good["verdict"] == "inside").sum())
        line = {by: str(name), "errors": str(len(own)), "judged": str(len(good)), "inside": str(inside)}
        line["half-width over error, median"] = f"{(1 / good['ratio']).median():.1f}" if len(good) else ""
        line["error over half-width, largest"] = f"{good['ratio'].max():.2f}" if len(good) else ""
        lines.append(line)
    return pd.DataFrame(lines)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[str, str]:
    """What stands between the marks of the page."""
    table = judged(results)
    scenes, runs = (table[table["kind"] == kind] for kind in KINDS)
    tables = {"meshes": (scenes, "mesh"), "scenes": (scenes, "scene"), "quantities": (runs, "quantity")}
    found = {name: pages.markdown(summary(*each)) for name, each in tables.items() if len(each[0])}
    return {
        "made": pages.prose(made(results, parts)),
        "statements": comparison.stated(statements(results, parts)),
        **{name: found.get(name, pages.prose("Not computed yet.")) for name in tables},
    }
