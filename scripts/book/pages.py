"""Pages: prose written by hand, and tables between marks that come from stored results.

A page is its own template: what stands between `<!-- NAME -->` and `<!-- end of NAME -->` is replaced.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from textwrap import fill

import pandas as pd

from pairsim.record.folder import write_text

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


def write(path: Path, blocks: Mapping[str, str]) -> None:
    """Replace the blocks of a page."""
    write_text(path, filled(path.read_text(), blocks))
