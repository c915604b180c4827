"""Whether critical distances fall as each parameter grows, which is what the publication says."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pandas as pd
from book import comparison, pages
from book.case_parts import complete
from book.statements import Judged, falling
from book.study import Part

from studies.giesekus_pairs.cases import CENTRE

WORDS = {"holds": "yes", "within error": "yes, in part within the intervals", "does not hold": "no"}


def lines(results: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """The critical distances that repel above along each line with more than one value."""
    rows = results[(results["stable"].astype(str) == "False") & (results["kind"] == "wanted")]
    for key in CENTRE:
        others = " and ".join(f"{other} == {value}" for other, value in CENTRE.items() if other != key)
        line = rows.query(others).sort_values(key)
        if len(line) > 1:
            yield key, line


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """That the distance falls along every line."""
    found = {
        f"the critical distance falls as {key} grows": falling(_values(line), f"{key} {_listed(line, key)}: d_cr")
        for key, line in lines(results)
    }
    return found | complete(results, parts)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """The table of the page."""
    rows = [
        {
            "varied": f"{key} {_listed(line, key)}",
            "d_cr": ", ".join(comparison.cell(*each, ".4g") for each in _values(line)),
            "falls": WORDS[falling(_values(line)).verdict],
        }
        for key, line in lines(results)
    ]
    return {"critical": pages.markdown(pd.DataFrame(rows))}


def _values(line: pd.DataFrame) -> list[tuple[float, float]]:
    return list(zip(line["d_cr"].tolist(), line["d_error"].tolist(), strict=True))


def _listed(line: pd.DataFrame, key: str) -> str:
    return ", ".join(f"{value:g}" for value in line[key])
