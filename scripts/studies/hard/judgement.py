"""Whether cases at the edge of what works end in an answer, or for a reason that is documented."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd
from book import pages
from book.case_parts import complete
from book.made import made
from book.statements import Judged
from book.study import Part

from pairsim.runtime.errors import BranchEnd

UNTYPED = ("error", "crashed", "refused", "not_computed", "out_of_memory", "case_timeout", "write_failed")
"""Reasons that are assigned to cases that did not report their own end."""
KINDS = {"run": "runs", "curve": "curves", "random": "points at random", "yielding": "with a yield stress"}


def ends(results: pd.DataFrame) -> pd.DataFrame:
    """The rows with how each case ended: answered, no steady state, or the reason of its failure."""
    answered = (results["outcome"] == "finished") & (results["reason"] != BranchEnd.reason)
    end = results["reason"].where(~answered, "answered")
    return results.assign(end=end.str.replace("_", " "))


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """What the study states, judged by what is stored."""
    table = ends(results)
    ended = table["outcome"].isin(["finished", "failed"])
    wrong = table[table["reason"].isin(UNTYPED) | ~ended]
    broken = table[table["finite"].astype("boolean").eq(False).fillna(False)]
    return {
        "every case is answered, or ends for a documented reason": _none(wrong),
        "all numbers are finite": _none(broken),
        **complete(results, parts),
    }


def _none(table: pd.DataFrame) -> Judged:
    names = ", ".join(table["part"])
    return Judged(((0.5 - len(table), 0.0),), f"{len(table)} not{': ' if names else ''}{names}")


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[str, str]:
    """What stands between the marks of the page."""
    table = ends(results)
    counts = pd.crosstab(table["file"], table["end"]).reindex([name for name in KINDS if name in set(table["file"])])
    order = counts.sum().sort_values(ascending=False).index
    counts = counts[order]
    counts.insert(0, "cases", counts.sum(axis=1))
    counts = counts.astype(str).replace("0", "").rename(index=KINDS).rename_axis("").reset_index()
    lost = table[table["outcome"] != "finished"]
    names = ("`" + lost["part"] + "`").groupby(lost["end"]).agg(", ".join)
    named = names.rename_axis("without an answer").rename("cases").reset_index()
    return {
        "hard": pages.markdown(counts),
        "hard-lost": pages.markdown(named) if len(named) else pages.prose("All have an answer."),
        "hard-made": pages.prose(made(results, parts)),
    }
