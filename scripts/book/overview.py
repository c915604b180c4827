"""The table of all studies: what each shows, what it states, and when it was computed."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from book import pages
from book.computing import DOCS
from book.results import Results
from book.study import Study

INDEX = DOCS / "validation" / "index.md"
MARK = "index"


def overview(studies: Sequence[Study], page: Path = INDEX) -> pd.DataFrame:
    """A row for each study, by its stored results.

    Args:
        studies: The studies.
        page: Where the table stands, from which their pages are linked.
    """
    rows = []
    for study in studies:
        parts = study.parts(False)
        results = Results(study.stored).of(parts)
        row = {"study": f"[`{study.name}`]({os.path.relpath(study.page, page.parent)})", "shows": study.shows}
        if len(results):
            found = Counter(each.verdict for each in study.statements(results, parts).values())
            row["statements that hold"] = f"{found['holds']} of {found.total()}"
            days = sorted(results["computed"].unique())
            row["computed"] = " to ".join(dict.fromkeys((days[0], days[-1])))
        rows.append(row)
    return pd.DataFrame(rows, columns=["study", "shows", "statements that hold", "computed"]).fillna("")


def write(studies: Sequence[Study]) -> None:
    """Write the table into its page."""
    pages.write(INDEX, {MARK: pages.markdown(overview(studies))})
