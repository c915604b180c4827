"""Pages: prose written by hand, and tables between marks that come from stored results.

A page is its own template: what stands between `<!-- NAME -->` and `<!-- end of NAME -->` is replaced. The tables are
CSV files in docs/results/PAGE, so that a page can be written again without computing anything.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from textwrap import fill

import pandas as pd

from book.computing import DOCS
from pairsim.record.folder import write_text

RESULTS = DOCS / "results"
WIDTH = 100  # of lines of prose
MARKED = re.compile(r"(<!-- (?P<name>[\w-]+) -->\n)(?P<inside>.*?)(?=<!-- end of (?P=name) -->)", re.DOTALL)


def markdown(table: pd.DataFrame) -> str:
    """A table in Markdown; cells are text."""
    cells = table.map(lambda cell: str(cell).replace("|", r"\|"))
    rows = [list(table.columns), ["---"] * len(table.columns), *cells.to_numpy().tolist()]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows) + "\n"


def prose(text: str) -> str:
    """A paragraph, wrapped."""
    return fill(text, WIDTH) + "\n"


def marks(page: str) -> set[str]:
    """Names of the marks of a page."""
    return {match["name"] for match in MARKED.finditer(page)}


def filled(page: str, blocks: Mapping[str, str]) -> str:
    """The page with every block between its marks; marks without a block keep what they have."""
    return MARKED.sub(lambda match: match[1] + (blocks.get(match["name"]) or match["inside"]), page)


def save(page: str, tables: Mapping[str, pd.DataFrame], keys: Mapping[str, list[str]] | None = None) -> None:
    """Store tables of a page, those that are not empty.

    Args:
        page: Name of the folder.
        tables: The tables; cells are text.
        keys: Columns that identify the rows of a table, of which those that are not new stay.
    """
    (RESULTS / page).mkdir(parents=True, exist_ok=True)
    known = stored(page)
    for name, table in tables.items():
        if name in known and (same := (keys or {}).get(name)):
            both = pd.concat([known[name], table]).fillna("").set_index(same)
            table = both[~both.index.duplicated(keep="last")].loc[both.index.unique()].reset_index()
        if len(table):
            write_text(RESULTS / page / f"{name}.csv", table.to_csv(index=False))


def stored(page: str) -> dict[str, pd.DataFrame]:
    """The stored tables of a page by name; cells are text."""
    files = sorted((RESULTS / page).glob("*.csv"))
    return {path.stem: pd.read_csv(path, dtype=str, keep_default_na=False) for path in files}


def write(path: Path, blocks: Mapping[str, str]) -> None:
    """Replace the blocks of a page."""
    write_text(path, filled(path.read_text(), blocks))
