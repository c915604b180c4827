"""Tables of all studies: what each shows, how many statements hold, its date, and how many half-widths hold."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import ItemsView, Sequence
from pathlib import Path

import pandas as pd

from book import pages
from book.computing import DOCS
from book.results import Results
from book.statements import Judged
from book.study import Study

INDEX = DOCS / "validation" / "index.md"
MARK = "index"
HALF_WIDTHS, MARK_OF_HALF_WIDTHS = DOCS / "explanation" / "error-estimate.md", "half-widths-that-hold"
INSIDE = re.compile("inside (their|the) half-widths")
"""Words by which statements on how many half-widths hold are found."""


def overview(studies: Sequence[Study], page: Path = INDEX) -> pd.DataFrame:
    """A row for each study, by its stored results.

    Args:
        studies: The studies.
        page: Where the table stands, from which their pages are linked.
    """
    rows = []
    for study in studies:
        row = {"study": _linked(study, page), "shows": study.shows}
        results = _stored(study)
        if len(results):
            found = Counter(each.verdict for _, each in _statements(study, results))
            row["statements that hold"] = f"{found['holds']} of {found.total()}"
            days = sorted(results["computed"].unique())
            row["computed"] = " to ".join(dict.fromkeys((days[0], days[-1])))
        rows.append(row)
    return pd.DataFrame(rows, columns=["study", "shows", "statements that hold", "computed"]).fillna("")


def half_widths(studies: Sequence[Study], page: Path = HALF_WIDTHS) -> pd.DataFrame:
    """A row for each statement of a study on how many half-widths hold, by its stored results."""
    rows = [
        {"study": _linked(study, page), "statement": text, "": judged.verdict, "inside": judged.numbers}
        for study in studies
        if len(results := _stored(study))
        for text, judged in _statements(study, results)
        if INSIDE.search(text)
    ]
    return pd.DataFrame(rows, columns=["study", "statement", "", "inside"])


def _stored(study: Study) -> pd.DataFrame:
    return Results(study.stored).of(study.parts(False))


def _statements(study: Study, results: pd.DataFrame) -> ItemsView[str, Judged]:
    return study.statements(results, study.parts(False)).items()


def _linked(study: Study, page: Path) -> str:
    return f"[`{study.name}`]({os.path.relpath(study.page, page.parent)})"


def write(studies: Sequence[Study]) -> None:
    """Write the tables into their pages."""
    pages.write(INDEX, {MARK: pages.markdown(overview(studies))})
    pages.write(HALF_WIDTHS, {MARK_OF_HALF_WIDTHS: pages.markdown(half_widths(studies))})
